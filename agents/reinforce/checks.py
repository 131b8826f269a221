"""How the model converses and which tasks it plays; what is refused before anything is loaded."""

from __future__ import annotations

import random
from collections.abc import Iterable

from agents import configs
from agents.finetune.model_files import ModelFiles
from agents.reinforce.settings import ReinforceSettings
from agents.vlm.settings import AgentSettings
from agents.vlm.tuned_model import AGENT
from er_gym.tasks.splits import rooms_kept_for_evaluation
from er_gym.tasks.suites import Suite, load_suite
from er_gym.tasks.task import Task


def agent_settings(files: ModelFiles, settings: ReinforceSettings) -> AgentSettings:
    """How the model converses while it learns.

    Raises:
        ValueError: its directory does not say, or says what cannot be learnt.
    """
    if not files.agent:
        raise ValueError(
            f"{files.path} has no {AGENT}, which says how it converses; give a model of er-gym "
            f"finetune, or write one (docs/agents.md)"
        )
    play = settings.play
    overrides = [
        f"sampling.temperature={play.temperature}",
        "sampling.top_p=1.0",
        f"local.batch={play.concurrency}",
    ]
    if play.max_tokens is not None:
        overrides.append(f"sampling.max_tokens={play.max_tokens}")
    agent = configs.load(AgentSettings, files.path / AGENT, "agent", overrides)
    if agent.sees == "pictures" and not files.has_vision:
        raise ValueError(
            f"{files.path} has no vision, and its {AGENT} shows it pictures; set sees: text there, "
            "or give a model that sees"
        )
    penalty = _repetition_penalty(files)
    if penalty not in (None, 1.0):
        raise ValueError(
            f"{files.path} is played with repetition_penalty {penalty}, so it would learn from "
            "other chances than it plays by; set it to 1.0 in its generation_config.json"
        )
    return agent


def _repetition_penalty(files: ModelFiles) -> float | None:
    import transformers

    try:
        found = transformers.GenerationConfig.from_pretrained(files.base, local_files_only=True)
    except OSError:  # it has none
        return None
    return found.repetition_penalty


def eyes_learn(files: ModelFiles, settings: ReinforceSettings) -> bool:
    """Whether weights learn that a conversation without pictures does not use."""
    return files.has_vision and not {"vision", "projector"} <= {*settings.model.freeze}


def greedy(agent: AgentSettings) -> AgentSettings:
    """The same settings, but the likeliest tokens are said."""
    sampling = agent.sampling.model_copy(update={"temperature": 0.0})
    return agent.model_copy(update={"sampling": sampling})


def check_suite(suite: Suite, settings: ReinforceSettings) -> None:
    """Raise ValueError if models are measured by the suite's tasks, or in its rooms or their
    arrangements."""
    kept = rooms_kept_for_evaluation(suite.tasks)
    if kept or suite.name == settings.validation.suite:
        why = f"plays in rooms that are kept for evaluation, such as {kept[0]}" if kept else (
            "is the one that validation chooses by"
        )  # fmt: skip
        raise ValueError(f"the suite {suite.name} {why}; learn from --suite train")
    if settings.validation.tasks:
        shown = _layouts(load_suite(settings.validation.suite).tasks) & _layouts(suite.tasks)
        if shown:
            scene, layout = min(shown)
            raise ValueError(
                f"{len(shown)} arrangements of rooms, such as {layout} of {scene}, are also in "
                f"{settings.validation.suite}, by which validation chooses; make the tasks with "
                "another seed"
            )


def _layouts(tasks: Iterable[Task]) -> set[tuple[str, str]]:
    """The rearranged rooms: scene and arrangement."""
    return {(t.scene, t.arrangement.layout) for t in tasks if t.arrangement.layout}


def tasks_of_types(suite: Suite, settings: ReinforceSettings) -> tuple[Task, ...]:
    """The tasks of ``curriculum.types``.

    Raises:
        ValueError: the suite has none.
    """
    types = settings.curriculum.types
    found = tuple(task for task in suite.tasks if not types or task.type.name in types)
    if not found:
        raise ValueError(
            f"the suite {suite.name} has no task of curriculum.types {', '.join(types)}; give "
            "another suite or other types"
        )
    return found


def validation_tasks(settings: ReinforceSettings) -> list[Task]:
    """The tasks of validation, always the same; none if there is no validation.

    Raises:
        ValueError: the suite of validation does not exist, or has none of these types.
    """
    if not settings.validation.tasks:
        return []
    every = list(tasks_of_types(load_suite(settings.validation.suite), settings))
    random.Random(0).shuffle(every)
    return every[: settings.validation.tasks]
