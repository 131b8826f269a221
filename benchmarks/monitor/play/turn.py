"""What a person sees of an episode: the same as every agent, and no more."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from agents.vlm.chat import Picture
from agents.vlm.pictures import encode
from agents.vlm.settings import Pictures
from er_gym.envs.actions import Action
from er_gym.tasks import verbs
from er_gym.tasks.task import Task

AHEAD = "ahead"


@dataclass(frozen=True)
class Turn:
    """A moment at which somebody decides.

    Attributes:
        task_id, task_type, instruction: of the task.
        number: how many steps were taken; placing the agent is the first.
        max_steps: the step limit.
        feedback: on the last action; "" at the beginning.
        success: whether that action was done.
        pictures: what is seen, by direction: ahead, and after ``observe`` also right, behind, left.
        legal: the legal actions by verb, in the order of the verbs.
    """

    task_id: str
    task_type: str
    instruction: str
    number: int
    max_steps: int
    feedback: str
    success: bool
    pictures: Mapping[str, Picture]
    legal: Mapping[str, Sequence[Action]]

    @property
    def left(self) -> int:
        """How many steps are left."""
        return self.max_steps - self.number

    def named(self, text: str, words: Mapping[str, str]) -> Action | None:
        """The legal action that a person types: whole, or as much of it as means no other one.

        Args:
            text: such as ``open fridge`` or ``go to apple``, whatever the case.
            words: what the page calls each verb.

        Returns:
            None if no legal action, or more than one, is meant.
        """
        wanted = " ".join(text.casefold().split())
        names = {
            action: [
                f"{verb} {action.object_type}".strip().casefold()
                for verb in (action.verb, words.get(action.verb, ""))
                if verb
            ]
            for actions in self.legal.values()
            for action in actions
        }
        for fits in (str.__eq__, str.startswith):
            found = [
                one for one, every in names.items() if any(fits(each, wanted) for each in every)
            ]
            if wanted and len(found) == 1:
                return found[0]
        return None

    def allows(self, action: Action) -> bool:
        """Whether an action is legal."""
        return action in self.legal.get(action.verb, ())


def turn_of(
    task: Task, obs: Mapping[str, Any], info: Mapping[str, Any], settings: Pictures
) -> Turn:
    """What is shown after a reset or a step.

    Args:
        task: the episode's.
        obs, info: what the environment returned, ``info`` with details; ``obs`` has ``rgb``.
        settings: how vision-language agents are shown pictures.
    """
    seen = {**info["views"], AHEAD: obs["rgb"]}
    legal: dict[str, list[Action]] = {verb.name: [] for verb in verbs.table()}
    for action in info["legal"]:
        legal[action.verb].append(action)
    return Turn(
        task_id=task.id,
        task_type=task.type.name,
        instruction=task.instruction,
        number=info["steps"],
        max_steps=info["max_steps"],
        feedback=info["feedback"] if info["action_text"] else "",
        success=bool(info["action_success"]),
        pictures={name: encode(each, settings) for name, each in seen.items() if each is not None},
        legal={verb: tuple(actions) for verb, actions in legal.items() if actions},
    )
