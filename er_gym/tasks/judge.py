"""The one judge: which key actions an episode has done, and whether the episode is a success.

The environment asks the judge at every step. The corrected scorer asks it again, from the record of
an episode (:func:`replay`). Only the paper's scorer has other rules. The judge's rules are:

1. **Steps.** A step counts if it was legal and the simulator did it. ``init``, the placing of the
   agent, and replies that name no known action never count.
2. **Key actions.** A step does one remaining key action of its verb and type, and earns its
   reward. Each key action can be done once.
3. **Types.** A key action's type is read from its object id, where it has one. A Sink and its
   SinkBasin are one type for key actions and search targets, and so are a Bathtub and its
   BathtubBasin (:mod:`er_gym.tasks.equivalence`). In a goal, what lies in the basin is in the
   whole, too, but what lies on the rim is not in the basin.
4. **Instances.** Any object of the type counts, unless the task's goal names an object by its id.
   A key action on a named object must be done to that object. If a step fits several key actions,
   it does one on a named object first.
5. **Order.** The key actions of an ordered task type count only in the order of the task: a step
   out of turn earns nothing, and the same key action can still be done in its turn. Navigations are
   free: one that the task lists before the next scored key action may be done or left out. In all
   other task types the order does not matter.
6. **Success** is decided by the first ``end`` that counts, and by nothing else. That ``end`` is a
   success if the following three conditions hold. Only then is its own key action done, if the
   task lists one.

   - All key actions are done, apart from navigations, ``observe`` and ``move forward``.
   - In a search, the agent can interact with an object of each target type
     (:func:`search_targets`) when it says ``end``. The way there and the listed navigations do not
     matter.
   - The task's goal holds (:mod:`er_gym.tasks.goal`), if it has one.

7. **After ``end``** nothing counts, whether ``end`` was a success or not.
8. **The step limit** ends an episode without success, even if only ``end`` was missing. An ``end``
   that is itself the last step within the limit counts. The paper's protocol appends an ``end``
   when it cuts an episode off, and that ``end`` is judged like any other. A fourth repetition in a
   row and a crash do not count as an ``end``.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from er_gym.tasks import verbs
from er_gym.tasks.equivalence import is_among, same_type
from er_gym.tasks.task import KeyAction, Task, type_of_id


@dataclass(frozen=True)
class Criteria:
    """The criteria for an episode, except the goal's conditions on the final state.

    Attributes:
        key_actions: in the order of the task.
        ordered: whether they count only in that order.
        named: ids of the objects that the task names.
        targets: the types to search for; empty if the task is not a search.
    """

    key_actions: tuple[KeyAction, ...]
    ordered: bool = False
    named: frozenset[str] = frozenset()
    targets: frozenset[str] = frozenset()

    @staticmethod
    def of(task: Task) -> Criteria:
        """The criteria of a task."""
        return Criteria(task.key_actions, task.type.ordered, task.named, search_targets(task))


def search_targets(task: Task) -> frozenset[str]:
    """The types to search for; empty if the task is not a search.

    They are the types of the task's related objects, or of the last related object of its ``end``.
    """
    if not task.type.search:
        return frozenset()
    ids = task.related_objects or next(
        (key.related_objects[-1:] for key in task.key_actions if key.verb == verbs.END), ()
    )
    return frozenset(type_of_id(i) for i in ids)


@dataclass(frozen=True)
class Progress:
    """How far an episode has come. It is immutable: :meth:`after` gives the next.

    Attributes:
        criteria: the criteria of the task.
        done: the key actions done, in the order in which they were done.
        left: the key actions not done yet, in the order of the task.
        ended: whether the agent has said ``end``.
        success: whether that ``end`` was a success.
    """

    criteria: Criteria
    done: tuple[KeyAction, ...]
    left: tuple[KeyAction, ...]
    ended: bool = False
    success: bool = False

    @staticmethod
    def start(criteria: Criteria) -> Progress:
        """The progress before the first step."""
        return Progress(criteria, (), criteria.key_actions)

    @property
    def numbers_done(self) -> list[int]:
        """The places of the key actions done, among those of the task."""
        found: list[int] = []
        for key in self.done:  # a task may have the same one twice
            numbers = (k for k, other in enumerate(self.criteria.key_actions) if other == key)
            found.append(next(k for k in numbers if k not in found))
        return found

    @staticmethod
    def at(criteria: Criteria, numbers_done: Sequence[int], ended: bool, success: bool) -> Progress:
        """The progress of an episode in which some key actions are done, see
        :attr:`numbers_done`."""
        keys = criteria.key_actions
        left = tuple(key for k, key in enumerate(keys) if k not in numbers_done)
        return Progress(criteria, tuple(keys[k] for k in numbers_done), left, ended, success)

    @property
    def only_end_left(self) -> bool:
        """Whether all key actions that success requires are done, except ``end``."""
        return all(key.verb == verbs.END or not key.scored for key in self.left)

    def after(
        self,
        verb: str,
        object_type: str = "",
        object_id: str = "",
        *,
        in_reach: Collection[str] = (),
        goal_holds: bool = True,
    ) -> tuple[Progress, float]:
        """The progress after a step that counts, and the reward that the step earns.

        Args:
            verb: canonical.
            object_type: as the agent named it.
            object_id: the id of the object to which it was done.
            in_reach: the types of which the agent can interact with an object; used for ``end``.
            goal_holds: whether the task's goal, if any, holds; used for ``end``.
        """
        if self.ended or verb == verbs.INIT:
            return self, 0.0
        if verb == verbs.END:
            return self._after_end(in_reach, goal_holds)
        if not any(key.verb == verb for key in self.left):  # as for most steps
            return self, 0.0
        fitting = [
            k
            for k in self._in_turn()
            if self.left[k].verb == verb
            and same_type(self.left[k].actual_type, object_type)
            and (self.left[k].object_id == object_id or not self._is_named(k))
        ]
        if not fitting:
            return self, 0.0
        k = next((k for k in fitting if self._is_named(k)), fitting[0])
        key, left = self.left[k], (*self.left[:k], *self.left[k + 1 :])
        return replace(self, done=(*self.done, key), left=left), key.reward

    def _after_end(self, in_reach: Collection[str], goal_holds: bool) -> tuple[Progress, float]:
        found = all(is_among(target, in_reach) for target in self.criteria.targets)
        if not (self.only_end_left and found and goal_holds):
            return replace(self, ended=True), 0.0
        ends = tuple(key for key in self.left if key.verb == verbs.END)
        left = tuple(key for key in self.left if key.verb != verbs.END)
        after = replace(self, done=(*self.done, *ends), left=left, ended=True, success=True)
        return after, sum(key.reward for key in ends)

    def _is_named(self, k: int) -> bool:
        return self.left[k].object_id in self.criteria.named

    def _in_turn(self) -> Iterable[int]:
        """The indices in ``left`` of the key actions that may be done next."""
        if not self.criteria.ordered:
            return range(len(self.left))
        scored = (k for k, key in enumerate(self.left) if key.scored)
        return range(next(scored, len(self.left) - 1) + 1)


class RecordedStep(Protocol):
    """The fields of a recorded step that the judge reads."""

    @property
    def verb(self) -> str:
        """The verb."""

    @property
    def object_type(self) -> str:
        """The object type as the agent named it, ``""`` for none."""

    @property
    def object_id(self) -> str:
        """The id of the object to which the verb was done, ``""`` for none."""

    @property
    def success(self) -> bool:
        """Whether the step was legal and the simulator did it."""

    @property
    def interactable(self) -> Collection[str]:
        """The types of which the agent could interact with an object after the step."""


def replay(criteria: Criteria, steps: Iterable[RecordedStep], *, goal_holds: bool) -> Progress:
    """Judge an episode from its record.

    Args:
        criteria: the criteria of its task.
        steps: all steps, in order.
        goal_holds: whether the task's goal held when the agent said ``end``.
    """
    *_, last = (
        Progress.start(criteria),
        *progress_by_step(criteria, steps, goal_holds=goal_holds),
    )
    return last


def progress_by_step(
    criteria: Criteria, steps: Iterable[RecordedStep], *, goal_holds: bool
) -> Iterator[Progress]:
    """The progress after each recorded step; the arguments are those of :func:`replay`."""
    progress = Progress.start(criteria)
    for step in steps:
        if step.success:
            progress, _ = progress.after(
                verbs.canonical_verb(step.verb),
                step.object_type,
                step.object_id,
                in_reach=step.interactable,
                goal_holds=goal_holds,
            )
        yield progress
