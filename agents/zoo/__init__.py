"""The zoo: small trained models that come with er-gym, as the agents ``zoo:NAME``.

``models/NAME/`` holds a model's weights as safetensors, the files that ``rl:`` or ``hf:`` loads
beside them, and ``card.yaml``, which says what the model is and can do. ``er-gym zoo`` lists the
cards, ``er-gym zoo add`` writes such a folder.

* :mod:`agents.zoo.card`: what a card says.
* :mod:`agents.zoo.index`: finds models by name.

:mod:`agents.packing` makes a model's folder from a training run.

This file imports nothing, so a name is resolved quickly.
"""
