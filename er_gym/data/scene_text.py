"""The objects that an agent perceives as a short text, for models without vision.

``see CounterTop ( Apple, Mug away ), Fridge closed``: objects in brackets lie in or on the object
before them. The words are a dialect's (:mod:`er_gym.data.dialects`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from pydantic import BaseModel, ConfigDict

from er_gym.data.recall import Recalled, lying_text, where_each_lies
from er_gym.data.trajectory import SeenObject, Turn
from er_gym.envs.actions import Action
from er_gym.envs.info import action_of, detail


@dataclass(frozen=True)
class Perceived:
    """What an agent perceives before it decides, as :class:`~er_gym.data.trajectory.Turn` has it.

    Attributes:
        view, views, held, navigable, interactable: see there.
        recalled: what it remembers of the episode up to here.
    """

    view: Sequence[SeenObject] = ()
    views: Mapping[str, Sequence[SeenObject]] = field(default_factory=dict)
    held: str = ""
    navigable: Sequence[str] = ()
    interactable: Sequence[str] = ()
    recalled: Recalled = field(default_factory=Recalled)

    @classmethod
    def at(
        cls, turn: Turn, last_turn: Turn | None = None, before: Perceived | None = None
    ) -> Perceived:
        """What was perceived at a turn of a trajectory.

        Args:
            turn: the turn.
            last_turn: the turn before it, and ``before``: what was perceived there; None at first.
        """
        now = cls(turn.view, turn.views, turn.held, turn.navigable, turn.interactable)
        if last_turn is None:
            return now._after(None, None, False)
        return now._after(before, last_turn.action, last_turn.success)

    @classmethod
    def of(cls, info: Mapping[str, Any], before: Perceived | None = None) -> Perceived:
        """What an environment with the observation ``objects`` says.

        Args:
            info: with details.
            before: what was perceived before the last action; None at first.
        """
        now = cls(
            [SeenObject.of(each) for each in detail(info, "object_views")],
            {
                direction: [SeenObject.of(each) for each in views]
                for direction, views in info["object_views_around"].items()
            },
            info["held"],
            list(info["navigable"]),
            list(info["interactable"]),
        )
        return now._after(before, action_of(info), bool(info["action_success"]))

    def _after(self, before: Perceived | None, action: Action | None, success: bool) -> Perceived:
        """The same, with what is remembered after an action; ``before`` is None at first."""
        done = Recalled()
        if before is not None:
            done = before.recalled.having_done(action, success, before.held)
        return replace(self, recalled=done.having_seen(self.view, self.views))

    @property
    def around(self) -> Sequence[SeenObject]:
        """The objects of all views around."""
        return [one for view in self.views.values() for one in view]


class SceneWords(BaseModel):
    """The words for what is perceived.

    Attributes:
        view: lists the objects in view, ``{things}``; ``around``: those seen by looking around, of
            which none is within reach; ``other``: the types, not listed otherwise, that the agent
            can navigate to from now on; ``""`` if they are not told.
        held: states the object in the hand, ``{things}``.
        same: used after an action that changed nothing of this. ``nothing``: used if no object is
            in view.
        away: not within reach. ``far``: not even close enough to navigate to. Objects without
            either are within reach.
        open, closed, on, off: states.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    view: str
    around: str
    other: str
    held: str
    same: str
    nothing: str
    away: str
    far: str
    open: str
    closed: str
    on: str
    off: str


class NamedWords(BaseModel):
    """The words for where the instruction's objects are; the line comes after the scene.

    A small model learns slowly to look a name up in a long list, and quickly to copy the last line
    about it.

    Attributes:
        told: lists them, ``{things}``.
        held, near, view, hidden: in the hand, within reach, in view, and not in view.
        seen: out of view, but seen before, or an object that the task says it can navigate to;
            ``""`` if that is told as ``hidden``.
        at: for an object in view, or seen, that lies or lay in or on another, ``{place}``.
        at_far: the same for a place that the agent cannot navigate to; ``""`` if it is told as
            ``at``.
        far: follows for an object in view, or seen, that the agent cannot navigate to; ``""`` if
            that is not told.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    told: str
    held: str
    near: str
    view: str
    hidden: str
    at: str
    at_far: str = ""
    seen: str = ""
    far: str = ""


class FrameWords(BaseModel):
    """The words for questions about a frame and their answers (:mod:`er_gym.data.frame_chat`).

    Attributes:
        look: asks for all that is in view. ``where``: asks for one type, ``{thing}``.
        found: answers that, ``{thing}`` as the scene tells it, and ``{side}``; ``unseen``: where
            none is in view, ``{thing}``.
        left, ahead, right: sides.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    look: str
    where: str
    found: str
    unseen: str
    left: str
    ahead: str
    right: str


@dataclass(frozen=True)
class _Thing:
    """All objects in view that are told alike."""

    type: str
    holder: str
    states: tuple[str, ...]


def scene_text(words: SceneWords, now: Perceived, before: Perceived | None, *, stayed: bool) -> str:
    """What an agent perceives, in lines.

    Objects with the same description are listed once. After an action on the spot, only new or
    changed objects are listed; after any other action all objects in view, unless nothing has
    changed.

    Args:
        words: the dialect's.
        now: what it perceives.
        before: what it perceived before its last action; None at first.
        stayed: whether its last action was done on the spot.

    Returns:
        the text; ``""`` if nothing has changed.
    """
    seen = _things(words, now.view, now)
    known = [] if before is None else _things(words, before.view, before)
    told = [each for each in seen if each not in known] if stayed else seen
    lines: list[str] = []
    if seen != known or before is None:
        if told:
            lines.append(words.view.replace("{things}", _listed(words, told)))
        elif not seen:
            lines.append(words.view.replace("{things}", words.nothing))
    elsewhere = replace(now, interactable=now.navigable)  # nothing there is within reach
    ahead = {(each.type, each.holder) for each in seen}
    around = [
        each
        for each in _things(words, now.around, elsewhere)
        if (each.type, each.holder) not in ahead
    ]
    if around:
        lines.append(words.around.replace("{things}", _listed(words, around)))
    shown = {each.type for each in (*told, *around)}
    before_known = set() if before is None else {*before.navigable}
    others = [each for each in now.navigable if each not in before_known | shown]
    if others and words.other:
        lines.append(words.other.replace("{things}", ", ".join(others)))
    if now.held and (lines or before is None or now.held != before.held):
        lines.append(words.held.replace("{things}", now.held))
    return "\n".join(lines)


def named_text(words: NamedWords, named: Sequence[str], now: Perceived) -> str:
    """Where objects of some types are, in one line; ``""`` if no type is given."""
    in_view = where_each_lies(now.view, now.views)
    lay = {**now.recalled.lay, **in_view}

    def how_far(name: str) -> str:
        if name == now.held:
            return words.held
        if name in now.interactable:
            return words.near
        seen = name in lay or name in now.navigable
        if name not in in_view and not (words.seen and seen):
            return words.hidden
        told = words.view if name in in_view else words.seen
        if name not in now.navigable:
            told += words.far
        return told + lying_text(words.at, words.at_far, lay.get(name, ""), now.navigable)

    told = ", ".join(f"{name} {how_far(name)}" for name in named)
    return words.told.replace("{things}", told) if told else ""


def thing_text(words: SceneWords, one: SeenObject, perceived: Perceived) -> str:
    """One object as :func:`scene_text` tells it, with what it lies in or on."""
    return _listed(words, _things(words, [one], perceived))


def _things(words: SceneWords, objects: Iterable[SeenObject], perceived: Perceived) -> list[_Thing]:
    """The objects, nearest first, those that are told alike only once."""
    near, walkable = {*perceived.interactable}, {*perceived.navigable}

    def thing(each: SeenObject) -> _Thing:
        states = []
        if each.type not in near:
            states.append(words.away if each.type in walkable else words.far)
        if each.open is not None:
            states.append(words.open if each.open else words.closed)
        if each.toggled is not None:
            states.append(words.on if each.toggled else words.off)
        return _Thing(each.type, each.on, tuple(states))

    return [*dict.fromkeys(thing(each) for each in objects)]


def _listed(words: SceneWords, told: Sequence[_Thing]) -> str:
    """The things, each with those in or on it in brackets behind it. A thing that holds others but
    is not itself told is named without its states."""
    types = {each.type for each in told}
    holders = {each.holder: None for each in told if each.holder}
    all_told = [*told, *(_Thing(each, "", ()) for each in holders if each not in types)]
    holds: dict[str, _Thing] = {}  # which of the things of a type has the others in or on it
    for each in sorted(all_told, key=lambda each: words.open not in each.states):
        if each.type in holders:
            holds.setdefault(each.type, each)
    left = dict.fromkeys(all_told)

    def text(one: _Thing) -> str:
        left.pop(one)
        said = " ".join((one.type, *one.states))
        if holds.get(one.type) is not one:
            return said
        inside = [text(each) for each in all_told if each in left and each.holder == one.type]
        # With a space before each name it is the same token everywhere.
        return f"{said} ( {', '.join(inside)} )" if inside else said

    said = [text(each) for each in all_told if each in left and not each.holder]
    while left:  # types that lie on one another
        said.append(text(next(iter(left))))
    return ", ".join(said)
