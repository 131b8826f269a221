"""Reward by key actions: each once, in any order unless the task's type is ordered."""

from __future__ import annotations

from dataclasses import dataclass, replace

from er_gym.envs.actions import STANDS_FOR, Action
from er_gym.tasks import verbs
from er_gym.tasks.task import KeyAction, Task, type_of_id


def same_type(one: str, other: str) -> bool:
    """Whether two type names mean the same thing to a task: a Sink and its SinkBasin do."""
    return STANDS_FOR.get(one, one) == STANDS_FOR.get(other, other)


@dataclass(frozen=True)
class Progress:
    """Which key actions are done; immutable, :meth:`after` gives the next."""

    done: tuple[KeyAction, ...]
    left: tuple[KeyAction, ...]
    ordered: bool
    named: frozenset[str] = frozenset()
    """Ids of the objects that the task singles out: to no other may their key actions be done."""

    @staticmethod
    def start(task: Task) -> Progress:
        """Nothing done yet."""
        return Progress((), task.key_actions, task.type.ordered, task.named)

    @property
    def only_end_left(self) -> bool:
        """Whether all that success asks for is done, but to say so."""
        return all(action.verb == verbs.END or not action.scored for action in self.left)

    def after(self, action: Action, object_id: str = "") -> tuple[Progress, float]:
        """The progress after an action that succeeded, and the reward it earns.

        Args:
            object_id: what it was done to.
        """
        for k, key in enumerate(self.left):
            right_one = key.object_id == object_id or key.object_id not in self.named
            if (
                right_one
                and key.verb == action.verb
                and same_type(key.actual_type, action.object_type)
            ):
                return (
                    replace(
                        self, done=(*self.done, key), left=(*self.left[:k], *self.left[k + 1 :])
                    ),
                    key.reward,
                )
            if self.ordered and key.scored:
                break
        return self, 0.0


def search_targets(task: Task) -> frozenset[str]:
    """The types that a search is for."""
    ids = task.related_objects or next(
        (key.related_objects[-1:] for key in task.key_actions if key.verb == verbs.END), ()
    )
    return frozenset(type_of_id(i) for i in ids)
