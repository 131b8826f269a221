"""Failed episodes: where they leave the key actions."""

from __future__ import annotations

from dataclasses import dataclass

from er_gym.envs.actions import Action
from er_gym.rollout.records import ERROR, EpisodeRecord
from er_gym.tasks import verbs


@dataclass(frozen=True)
class Beginning:
    """The beginning of a failed episode.

    Attributes:
        actions: up to the first that left the key actions, that one included.
        problem: why there is none, ``""`` if there is.
    """

    actions: tuple[Action, ...] = ()
    problem: str = ""

    @property
    def first_wrong(self) -> int:
        """The index of the first wrong action."""
        return len(self.actions) - 1


def beginning_of(episode: EpisodeRecord) -> Beginning:
    """The actions of a failed episode up to its first wrong one.

    As in the paper (arXiv 2503.21696), an action is wrong that does no key action.
    """
    if episode.success:
        return Beginning(problem="the episode succeeded")
    if episode.error:
        return Beginning(problem="the episode crashed")
    actions: list[Action] = []
    for step in episode.steps[1:]:
        if step.appended or step.verb == verbs.END:
            return Beginning(problem="it ended too early, and nothing was wrong before")
        if step.verb == ERROR:
            return Beginning(problem="its first wrong reply names no action")
        actions.append(Action(step.verb, step.object_type))
        if step.reward <= 0:
            return Beginning(tuple(actions))
    return Beginning(problem="nothing was wrong before the steps ran out")
