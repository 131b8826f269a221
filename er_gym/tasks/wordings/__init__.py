"""The wordings of instructions, in English and Chinese.

- :mod:`~er_gym.tasks.wordings.grammar`: what a language's wordings are made of;
- :mod:`~er_gym.tasks.wordings.english` (with ``english_sentences``) and
  :mod:`~er_gym.tasks.wordings.chinese`: the parts;
- :mod:`~er_gym.tasks.wordings.english_further`: more of them, for learning alone;
- :mod:`~er_gym.tasks.wordings.names`: what object types are called;
- :mod:`~er_gym.tasks.wordings.told`: what a task's name says, which every wording says too;
- :mod:`~er_gym.tasks.wordings.instructions`: instructions of tasks, and which wording one has.
"""
