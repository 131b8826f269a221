"""Play one episode and record what happened."""

from __future__ import annotations

import hashlib
import time
import traceback
from collections.abc import Mapping
from typing import Any, Protocol

from er_gym.envs.info import with_details
from er_gym.rollout.agent import Agent, CannotFinish, CannotGoOn, Decision
from er_gym.rollout.events import EpisodeBegun, EventListener, Reply, StepDone, ignore_event
from er_gym.rollout.loop import transitions
from er_gym.rollout.processes import Terminated
from er_gym.rollout.records import ERROR, GAVE_UP, EpisodeRecord, StepRecord, record_episode
from er_gym.tasks.task import Task
from er_gym.tasks.verbs import END, INIT


class Playable(Protocol):
    """What :func:`play_episode` needs; ``EmbodiedEnv`` and ``RemoteEnv`` have it."""

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Begin an episode."""

    def step(self, action: Any) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Do an action."""

    @property
    def unwrapped(self) -> Any:
        """What has the :class:`~er_gym.envs.info.Details` of the step as ``details``."""


def episode_seed(seed: int, task_id: str) -> int:
    """The seed of one episode, in [0, 2**31), from the run's seed and the task's id.

    The seed is the same in every process and on every machine, whatever else the run plays.
    """
    return int.from_bytes(hashlib.sha256(f"{seed}/{task_id}".encode()).digest()[:4], "big") >> 1


def play_episode(
    env: Playable,
    agent: Agent,
    task: Task,
    seed: int,
    *,
    agent_name: str = "",
    max_steps: int | None = None,
    emit: EventListener = ignore_event,
) -> EpisodeRecord:
    """Play ``task`` from ``reset`` to its end.

    An exception in the agent or the environment does not leave this function. The record then holds
    the steps before it, and its ``error`` says what was raised and where. Do not use the
    environment again after that. An agent that raises
    :class:`~er_gym.rollout.agent.CannotFinish` ends the episode without success; that is no error.

    Args:
        env: an environment in any state; it is reset to the task.
        agent: an agent in any state; it is reset to the task.
        task: what to play.
        seed: passed to ``env.reset``.
        agent_name: how the record names the agent; its class name by default.
        max_steps: the step limit for the record of an episode that crashes in ``env.reset``; the
            task's own by default. An episode that begins records ``info["max_steps"]``.
        emit: called with the beginning of the episode, each reply of a model, and each step.

    Raises:
        CannotGoOn: the agent says that no further episode can be played. This episode has no
            record.
    """
    steps: list[StepRecord] = []
    info: Mapping[str, Any] = {}
    error = ""
    gave_up: CannotFinish | None = None
    start = time.perf_counter()
    try:
        obs, told = env.reset(seed=seed, options={"task": task})
        info = with_details(env, told)
        steps.append(_placed(info))
        agent.reset(task, obs, info)
        emit(_begun(task, info["max_steps"]))
        for each in transitions(env, agent, obs, info):
            info = each.info
            steps.append(_stepped(info, each.reward, each.decision))
            _emit_step(emit, task.id, len(steps) - 1, each.decision, steps[-1])
            if info["end_appended"]:
                steps.append(_appended(steps[-1]))
    except (CannotGoOn, Terminated):
        raise
    except CannotFinish as caught:
        gave_up = caught
    except (Exception, SystemExit) as caught:  # other people's code must not end the run
        error = error_with_location(caught)
    return record_episode(
        task,
        agent=agent_name or type(agent).__name__,
        seed=seed,
        max_steps=info.get("max_steps", max_steps),
        steps=steps,
        success=bool(info.get("success", False)) and not error and gave_up is None,
        goal_unmet=[str(condition) for condition in info.get("unmet", ())],
        end_reason="" if error else GAVE_UP if gave_up else str(info["end_reason"]),
        seconds=time.perf_counter() - start,
        error=error,
        cause=gave_up.cause if gave_up else "",
        gave_up=_encodable(" ".join(str(gave_up).split())) if gave_up else "",
        side_effects=None if error or gave_up else _side_effects(info),
    )


def error_with_location(error: BaseException) -> str:
    """The type of an exception, its message, and the file and line that raised it, in one line."""
    text = _encodable(" ".join(traceback.format_exception_only(error)[-1].split()))
    frames = traceback.extract_tb(error.__traceback__)
    return f"{text} ({frames[-1].filename}:{frames[-1].lineno})" if frames else text


def _encodable(text: str) -> str:
    """The text with lone surrogates escaped: models write them, but UTF-8 cannot hold them."""
    return text.encode("utf-8", "backslashreplace").decode()


def _side_effects(info: Mapping[str, Any]) -> list[str] | None:
    """Those that the environment tells; None for one that does not."""
    told = info.get("side_effects")
    return None if told is None else [*told]


def _begun(task: Task, max_steps: int) -> EpisodeBegun:
    return EpisodeBegun(
        task_id=task.id,
        task_type=task.type.name,
        scene=task.scene,
        instruction=task.instruction,
        max_steps=max_steps,
    )


def _emit_step(
    emit: EventListener, task_id: str, number: int, decision: Decision, step: StepRecord
) -> None:
    if decision.reply is not None:
        emit(Reply(task_id=task_id, step=number, **vars(decision.reply)))
    emit(
        StepDone(
            task_id=task_id,
            step=number,
            verb=step.verb,
            object_type=step.object_type,
            success=step.success,
            reward=step.reward,
            thought=step.thought,
            feedback=step.feedback,
        )
    )


def _placed(info: Mapping[str, Any]) -> StepRecord:
    return StepRecord(
        verb=INIT,
        success=True,
        feedback=info["feedback"],
        navigable=list(info["navigable"]),
        interactable=list(info["interactable"]),
    )


def _appended(last: StepRecord) -> StepRecord:
    """The ``end`` that the protocol appends. The last step's reward includes what it earned."""
    return StepRecord(
        verb=END,
        success=True,
        navigable=last.navigable,
        interactable=last.interactable,
        appended=True,
    )


def _stepped(info: Mapping[str, Any], reward: float, decision: Decision) -> StepRecord:
    return StepRecord(
        verb=info["verb"] or ERROR,
        object_type=info["object_type"],
        object_id=info["object_id"],
        success=bool(info["action_success"]) and bool(info["verb"]),
        feedback=_encodable(info["feedback"]),
        navigable=list(info["navigable"]),
        interactable=list(info["interactable"]),
        reward=reward,
        thought=_encodable(decision.thought),
        text=_encodable(info["action_text"]),
        by=decision.by,
        causes=list(decision.causes),
        fault=str(info.get("fault", "")),
    )
