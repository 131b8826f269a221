"""Another agent takes over a failed episode: it knows what was seen, and does the rest."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence

from agents.expert.course import Intent
from agents.expert.legs import legs_of
from agents.expert.memory import Remembering
from agents.expert.replayed_intents import replayed_intent
from agents.expert.successors import Successor
from er_gym.envs.actions import Action
from er_gym.tasks.task import KeyAction, Task


class TakeoverCourse(Remembering):
    """Repeats the beginning of a failed episode, then lets another agent finish the task.
    :class:`~agents.expert.course.Course`.

    Args:
        task: the task.
        beginning: the actions, the wrong one last.
        successor: takes over.
    """

    def __init__(self, task: Task, beginning: Sequence[Action], successor: Successor) -> None:
        super().__init__()
        self._task, self._beginning, self._successor = task, beginning, successor
        self._legs = legs_of(task)

    def intents(self) -> Iterator[Intent]:
        """See :class:`~agents.expert.course.Course`."""
        successor = self._successor
        successor.begin(self._task, self.view)
        for action in self._beginning:
            successor.watch(action, self.view)
            yield replayed_intent(action, self.view, self._legs, train=False)
        successor.take_over(self._done())
        refused: Action | None = None
        while True:
            action = successor.act(self.view)
            yield replayed_intent(
                action,
                self.view,
                self._legs,
                train=True,
                again=action == refused,
                memory=self._memory,
            )
            refused = None if self.view.success else action

    def _done(self) -> Iterator[KeyAction]:
        """The key actions that are done. Of equal ones, any."""
        left = Counter(self.view.left)
        for key in self._task.key_actions:
            if left[key]:
                left[key] -= 1
            else:
                yield key
