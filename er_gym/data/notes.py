"""Notes: thoughts as a short memory, made from what a trajectory records of each turn.

``goal pickup Apple to Fridge; Apple unseen; looked Sink > Drawer 2; navigate to Drawer 2 in a row;
next CounterTop`` states the goal, where the object is, the places searched (two drawers), how often
the last action was repeated, and the place to search next. The words are a dialect's
(:mod:`er_gym.data.dialects`). A small model can learn such notes, but not to write prose.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import takewhile

from pydantic import BaseModel, ConfigDict

from er_gym.data.knowledge import Knowledge, LastAction, knowledge_at
from er_gym.data.recall import lying_text
from er_gym.data.trajectory import ThoughtKind, Trajectory, Turn
from er_gym.tasks import verbs

_MOST_PLACES = 4
"""How many places a note plans to search at most."""


class NoteWords(BaseModel):
    """The words of notes.

    Attributes:
        goal: the goal, with ``{verb}`` and ``{thing}``; ``to``: the destination, ``{place}``.
        held, near, view, seen, unseen: where the wanted object ``{thing}`` is: in the hand, within
            reach, in view, seen before, never seen.
        far: follows for a thing in view or seen before that the agent cannot navigate to; ``""``
            where notes do not tell that.
        at: for a thing in view or seen before that lies or lay in or on another, ``{place}``;
            ``""`` where notes do not tell that. ``at_far``: the same for a place that the agent
            cannot navigate to; ``""`` if it is told as ``at``.
        looked: the places searched for it, ``{places}``; ``""`` where notes do not tell them;
            ``times``: how a place is named that was searched more than once, with ``{place}`` and
            ``{count}``.
        again: that the last ``{count}`` actions, two or more, were all ``{action}``; ``""`` where
            notes do not count that.
        next: the places to search next, ``{places}``.
        failed: the action that failed just before, ``{action}``.
        separator: stands between the parts.
        places_separator: stands between places. One that stands in no other list is better: a
            small model that writes a list goes on with another that has the same words.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    goal: str
    to: str
    held: str
    near: str
    view: str
    seen: str
    unseen: str
    far: str = ""
    at: str = ""
    at_far: str = ""
    looked: str
    times: str
    again: str = ""
    next: str
    failed: str
    separator: str = "; "
    places_separator: str = ", "


def note(words: NoteWords, trajectory: Trajectory, index: int) -> tuple[ThoughtKind, str]:
    """The note of a turn, and the kind of thought that it is: a reflection after a failure, a
    verification before ``end``, otherwise a plan.

    Args:
        words: the dialect's.
        trajectory: the trajectory.
        index: of the turn.
    """
    known = knowledge_at(
        trajectory.turns,
        index,
        instruction=trajectory.instruction,
        language=trajectory.language,
    )
    parts: list[str] = []
    kind: ThoughtKind = "verification" if known.decision.verb == verbs.END else "planning"
    if known.last is not None and not known.last.success:
        kind = "reflection"
        parts.append(words.failed.replace("{action}", str(known.last.action)))
    subgoal = known.subgoal
    if subgoal.thing:
        goal = words.goal.replace("{verb}", subgoal.verb).replace("{thing}", subgoal.thing)
        if subgoal.place:
            goal += words.to.replace("{place}", subgoal.place)
        wanted = subgoal.thing
        if subgoal.place and known.held == subgoal.thing:
            wanted = subgoal.place
        how_far = _how_far(known, wanted)
        told = getattr(words, how_far).replace("{thing}", wanted)
        if how_far in ("view", "seen"):
            told += words.far if wanted not in known.navigable else ""
            place = known.lay.get(wanted, "")
            told += lying_text(words.at, words.at_far, place, known.navigable)
        parts += [goal, told]
    looked = [
        place
        if count == 1
        else words.times.replace("{place}", place).replace("{count}", str(count))
        for place, count in _looked(trajectory.turns[:index], known).items()
    ]
    if looked and words.looked:
        parts.append(words.looked.replace("{places}", words.places_separator.join(looked)))
    count = _in_a_row(known.actions)
    if words.again and count > 1:
        again = words.again.replace("{action}", str(known.actions[-1].action))
        parts.append(again.replace("{count}", str(count)))
    if plan := [*dict.fromkeys(known.plan)][:_MOST_PLACES]:
        parts.append(words.next.replace("{places}", words.places_separator.join(plan)))
    return kind, words.separator.join(parts)


def _looked(before: Sequence[Turn], known: Knowledge) -> Counter[str]:
    """How often the agent went to each place in search of what it wants, in the order of the first
    times. A place where it was refused to go counts: a model that is small goes where it has not
    looked, and would otherwise try the same place again."""
    turns = {visit.turn: visit.place for visit in known.visits}
    for number, turn in enumerate(before):
        refused = turn.verb == verbs.NAVIGATE and not (turn.success or turn.fault)
        if refused and turn.subgoal == known.subgoal:
            turns.setdefault(number, turn.object_type)
    return Counter(turns[number] for number in sorted(turns))


def _in_a_row(actions: Sequence[LastAction]) -> int:
    """How many of the last actions were the same, done or not. The environment counts them, too: it
    ends the episode at the fourth."""
    return sum(1 for _ in takewhile(lambda each: each.action == actions[-1].action, actions[::-1]))


def _how_far(known: Knowledge, wanted: str) -> str:
    """The name of the words that say how far the agent is from what it wants now."""
    if known.held == wanted:
        return "held"
    if wanted in known.interactable:
        return "near"
    if wanted in known.in_view:
        return "view"
    return "seen" if wanted in known.seen else "unseen"
