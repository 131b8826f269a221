"""What the agent can know at a turn: writers compose thoughts from it, the critic checks them.

:func:`knowledge_at` reads it from the trajectory's turns alone, so that a thought can be written
and checked while the episode is played, and checked again from the records.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from er_gym.data.trajectory import Language, Purpose, SeenObject, Subgoal, ThoughtRecord, Turn
from er_gym.envs.actions import Action
from er_gym.tasks import verbs
from er_gym.tasks.equivalence import is_among, same_type

AROUND = frozenset({"right", "behind", "left"})
"""The directions of the pictures after ``observe``."""


@dataclass(frozen=True)
class Visit:
    """A place that the agent went to, to search it.

    Attributes:
        place: the object type.
        turn: the index of the turn that went there.
        opened: whether the agent opened it.
        found: whether the visit led to a key action.
    """

    place: str
    turn: int
    opened: bool = False
    found: bool = False


@dataclass(frozen=True)
class LastAction:
    """The action before this turn and its result.

    Attributes:
        action, success, feedback, fault: as :class:`~er_gym.data.trajectory.Turn` has them.
        earned: whether it did a key action.
        purpose: why it was taken.
    """

    action: Action
    purpose: Purpose
    success: bool
    earned: bool
    feedback: str = ""
    fault: str = ""


@dataclass(frozen=True)
class Knowledge:
    """What the agent knows at a turn, and what it decides there.

    Attributes:
        language: of the thoughts.
        instruction: the task.
        turn: the index of the turn, from 0.
        view: the objects in view, nearest first.
        views: after ``observe``, the objects in view in each direction; else empty.
        held: the type of the object in the hand, ``""`` for none.
        at: the type last navigated to, ``""`` at first.
        seen: every object type that is or was in view, with the place (the type last navigated to,
            ``""`` for the start) where it was in view last.
        lay: of those, on what each lay when it was in view last, or where the agent has put it
            since.
        rested: of those, all on which each was seen to lie or was put, in order; ``""`` for what
            was seen on nothing.
        sightings: every such type, with all places from which it was in view, in order.
        visits: the places searched for the present subgoal, in order.
        navigable, interactable: the object types that are legal targets now.
        last: the last action; None at the first turn.
        actions: every action before this turn, oldest first.
        decision: the action of this turn.
        purpose, subgoal, plan: see :class:`~er_gym.data.trajectory.Turn`.
        earlier: the thoughts of the turns before, oldest first, without this turn's.
    """

    language: Language
    instruction: str
    turn: int
    view: Sequence[SeenObject]
    held: str
    at: str
    decision: Action
    purpose: Purpose
    subgoal: Subgoal
    views: Mapping[str, Sequence[SeenObject]] = field(default_factory=dict)
    seen: Mapping[str, str] = field(default_factory=dict)
    lay: Mapping[str, str] = field(default_factory=dict)
    rested: Mapping[str, Sequence[str]] = field(default_factory=dict)
    sightings: Mapping[str, Sequence[str]] = field(default_factory=dict)
    visits: Sequence[Visit] = ()
    navigable: Sequence[str] = ()
    interactable: Sequence[str] = ()
    last: LastAction | None = None
    actions: Sequence[LastAction] = ()
    plan: Sequence[str] = ()
    earlier: Sequence[Sequence[ThoughtRecord]] = ()

    @property
    def in_view(self) -> frozenset[str]:
        """The object types in view now, those of the views after ``observe`` included."""
        around = (each.type for view in self.views.values() for each in view)
        return frozenset((*(each.type for each in self.view), *around))

    @property
    def sought(self) -> str:
        """The type that the agent looks for: the thing of its goal, or the place once it holds the
        thing; ``""`` for none."""
        goal = self.subgoal
        return goal.place if goal.thing and goal.thing == self.held else goal.thing

    def remembers(self, object_type: str) -> bool:
        """Whether a type is or was in view, or one that counts as the same."""
        return is_among(object_type, self.seen)

    def where(self, object_type: str) -> str:
        """On what a type lay when it was in view last, ``""`` if that is unknown."""
        return next((on for each, on in self.lay.items() if same_type(each, object_type)), "")


def knowledge_at(
    turns: Sequence[Turn], index: int, *, instruction: str, language: Language
) -> Knowledge:
    """The knowledge at a turn.

    Args:
        turns: the turns before it with their results, and the turn itself, whose thoughts and
            results are not read.
        index: of the turn.
        instruction, language: the trajectory's.
    """
    turn, before = turns[index], turns[:index]
    seen: dict[str, str] = {}
    lay: dict[str, str] = {}
    rested: dict[str, dict[str, None]] = {}
    sightings: dict[str, dict[str, None]] = {}
    for each in (*before, turn):
        around = (one for view in each.views.values() for one in view)
        for one in (*reversed(list(around)), *reversed(each.view)):  # the nearest is the last
            seen[one.type] = each.at
            sightings.setdefault(one.type, {})[each.at] = None
            if one.type != each.held:
                lay[one.type] = one.on
                rested.setdefault(one.type, {})[one.on] = None
        if each is not turn and each.success and each.verb == verbs.PUT and each.held:
            lay[each.held] = each.object_type
            rested.setdefault(each.held, {})[each.object_type] = None
    actions = [
        LastAction(
            action=each.action,
            purpose=each.purpose,
            success=each.success,
            earned=each.earned,
            feedback=each.feedback,
            fault=each.fault,
        )
        for each in before
    ]
    return Knowledge(
        language=language,
        instruction=instruction,
        turn=index,
        view=turn.view,
        views=turn.views,
        held=turn.held,
        at=turn.at,
        seen=seen,
        lay={kind: on for kind, on in lay.items() if on and kind != turn.held},
        rested={name: tuple(places) for name, places in rested.items()},
        sightings={name: tuple(places) for name, places in sightings.items()},
        visits=_visits(before, turn.subgoal),
        navigable=turn.navigable,
        interactable=turn.interactable,
        last=actions[-1] if actions else None,
        actions=actions,
        decision=turn.action,
        purpose=turn.purpose,
        subgoal=turn.subgoal,
        plan=turn.plan,
        earlier=[each.thoughts for each in before],
    )


def _visits(before: Sequence[Turn], subgoal: Subgoal) -> list[Visit]:
    """The places searched for a subgoal, in order."""
    visits: list[Visit] = []
    for index, turn in enumerate(before):
        if turn.subgoal != subgoal or not turn.success:
            continue
        if turn.verb == verbs.NAVIGATE and turn.purpose in ("search", "approach", "retry"):
            visits.append(Visit(turn.object_type, index, found=turn.earned))
        elif turn.verb == verbs.OPEN and visits and visits[-1].place == turn.object_type:
            here = visits[-1]
            visits[-1] = Visit(here.place, here.turn, opened=True, found=here.found or turn.earned)
    return visits
