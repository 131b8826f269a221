"""Checks of a plan's phases before the first one runs.

What a command would refuse after hours, its phase refuses at once. Each check raises ValueError, as
the command would. What earlier phases make, such as a model, cannot be checked here.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from agents import make_agent
from agents.expert.recipe import load_recipe
from agents.factory import is_model_agent
from agents.factory import load_settings as load_agent_settings
from agents.finetune.architecture import load_architecture
from agents.finetune.settings import load_settings as load_finetune_settings
from benchmarks.study.settings import Collected, PlaySettings
from er_gym.data.dialects import load_dialect
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.extras import MissingPackage
from er_gym.tasks.suites import load_suite
from er_gym.tasks.types import canonical_names

_LIBRARIES = {"local": ("torch", "transformers"), "finetune": ("torch", "transformers", "peft")}
"""Of each extra, what a plan cannot do without."""


def check_tasks(settings: PlaySettings, suite: str) -> None:
    """Whether a suite can be played with a plan's settings."""
    wanted = _wanted(settings)
    if wanted and not wanted & _types_of(suite).keys():
        raise ValueError(f"{suite} has no task of the types {', '.join(sorted(wanted))}")
    stated: dict[str, Any] = {
        "width": settings.width,
        "height": settings.height,
        "instances": settings.instances or None,
    }
    EmbodiedEnv((), **{name: value for name, value in stated.items() if value is not None})


@lru_cache(maxsize=8)  # most phases ask for the same
def _types_of(suite: str) -> Counter[str]:
    return Counter(task.type.name for task in load_suite(suite).tasks)


def _wanted(settings: PlaySettings) -> set[str]:
    return set(canonical_names(settings.types))


def check_skip(settings: PlaySettings, suite: str, skip: int) -> None:
    """Whether a suite has tasks after those that are skipped, of the plan's types."""
    wanted = _wanted(settings)
    number = sum(many for name, many in _types_of(suite).items() if not wanted or name in wanted)
    if skip >= number:
        of_these = " of these types" if wanted else ""
        raise ValueError(f"{suite} has {number} tasks{of_these}; skip fewer than {skip}")


def check_recipe(collected: Collected) -> None:
    """Whether there is a recipe, with these parts."""
    load_recipe(collected.recipe).only(collected.parts)


def check_agent(name: str) -> None:
    """Whether there is an agent of this name; a model is not loaded."""
    if not is_model_agent(name):
        make_agent(name)


def check_model_play(overrides: Sequence[str]) -> None:
    """Whether these override an agent's settings."""
    _check_installed("local")
    load_agent_settings(None, overrides)


def check_new_model(architecture: str, dialect: str) -> None:
    """Whether a model of this architecture can be made."""
    _check_installed("local")
    load_architecture(architecture)
    load_dialect(dialect)


def check_finetune(config: str, overrides: Sequence[str]) -> None:
    """Whether there is such a configuration."""
    _check_installed("finetune")
    load_dialect(load_finetune_settings(config, overrides).data.dialect)


def check_model_there(path: str) -> None:
    """Whether there is a directory that can hold a model."""
    if not Path(path).is_dir():
        raise ValueError(
            f"{path} is not a directory; give one with a model in it, or a run of er-gym finetune"
        )


def _check_installed(extra: str) -> None:
    for library in _LIBRARIES[extra]:
        if find_spec(library) is None:
            raise MissingPackage("this phase", library, f"er-gym[{extra}]")
