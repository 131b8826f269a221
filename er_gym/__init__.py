"""er-gym: household tasks in AI2-THOR rooms, as Gymnasium environments.

An agent stands in a room and gets an instruction: find an object, pick one up, switch one on, carry
one somewhere. It sees the room as a picture, as text or as numbers, and acts in words such as
``navigate to Fridge``. An embedded engine simulates and renders all 120 iTHOR rooms on a CPU; no
Unity build, display or download is needed. ``import er_gym`` registers the environments, so this
is an episode in five lines::

    import gymnasium, er_gym

    env = gymnasium.make("ER-SinglePickup-v0", obs_mode="text")
    obs, info = env.reset(seed=0)
    print(obs["text"])
    obs, reward, terminated, truncated, info = env.step("navigate to CounterTop")

The package offers:

- ``EmbodiedEnv``: the environment behind all ids; its docstring has actions, observations, rewards
  and arguments;
- ``Task``: what an agent is asked to do; ``load_suite("mini").tasks`` are bundled ones;
- ``play_episode``: plays a task with an agent and returns a record; ``agents.make_agent("oracle")``
  makes an agent by name;
- ``make_controller``: an AI2-THOR controller on the embedded engine or on Unity;
- ``thor_executable``: the player that an AI2-THOR program can start in place of Unity's build.

Where to look next, in a checkout:

- ``examples/``: a short script for each thing that one does first: an agent, a reward, a task file
  or a prompt of one's own, training, trajectories, comparing runs, saving an episode;
- ``README.md``: the ids of the environments, the command line, the results;
- ``docs/extending.md``: verbs, observations and other parts from your own package.

On the command line, ``er-gym --help`` lists the commands, and ``er-gym doctor`` says what works on
this machine.
"""

from typing import TYPE_CHECKING, Any

from er_gym.envs.registration import register_all
from er_gym.version import __version__

if TYPE_CHECKING:
    from er_gym.envs.embodied_env import EmbodiedEnv
    from er_gym.rollout.play import play_episode
    from er_gym.tasks import Task, load_suite
    from er_gym.thor import make_controller, thor_executable

__all__ = [
    "EmbodiedEnv",
    "Task",
    "__version__",
    "load_suite",
    "make_controller",
    "play_episode",
    "thor_executable",
]

_LAZY = {
    "EmbodiedEnv": "er_gym.envs.embodied_env",
    "Task": "er_gym.tasks",
    "load_suite": "er_gym.tasks",
    "make_controller": "er_gym.thor",
    "play_episode": "er_gym.rollout.play",
    "thor_executable": "er_gym.thor",
}
"""The module of each name. It is imported when the name is first used, since the AI2-THOR client
takes half a second to import and registering environments needs none of it."""

register_all()


def __getattr__(name: str) -> Any:
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(_LAZY[name]), name)


def __dir__() -> list[str]:
    return [*__all__]
