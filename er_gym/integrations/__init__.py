"""Plugs: er-gym inside the programs and protocols of others, one small file each.

Every plug plays a :class:`~er_gym.integrations.session.Session`: actions go in as texts, and text,
a picture, rewards and ends come out. What the text tells and what is rewarded is one switch, the
same for all (:mod:`er_gym.integrations.scaffold`). :data:`~er_gym.integrations.plugs.PLUGS` has a
row for each. A plug imports its library at its top, so only those who use it need the library.
"""
