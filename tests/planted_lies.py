"""Lies and honest thoughts about real scenes: the templates of lie_wordings.py, filled."""

from __future__ import annotations

import itertools
import random
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from lie_wordings import HONEST_EN, HONEST_ZH, LIES_EN, LIES_ZH

from er_gym.data.knowledge import Knowledge
from er_gym.data.mentions import all_interchangeable, interchangeable, named_in
from er_gym.data.names_zh import NAMES_ZH
from er_gym.data.trajectory import SeenObject
from er_gym.envs.actions import Action
from er_gym.tasks import verbs
from er_gym.thor import OBJECT_TYPES


@dataclass(frozen=True)
class Planted:
    """A thought that was made to be checked.

    Attributes:
        sort: of lie; ``honest`` if it is none.
        text: the thought; ``knowledge``: what the agent knew.
    """

    sort: str
    text: str
    knowledge: Knowledge


_SIDES_EN = {
    "left": ("to my left", "on the left", "on my left-hand side"),
    "right": ("to my right", "on the right", "off to the right"),
    "ahead": ("straight ahead", "directly in front of me", "right ahead of me"),
    "behind": ("behind me", "right behind me"),
}
_SIDES_ZH = {
    "left": ("左边", "左侧"),
    "right": ("右边", "右手边"),
    "ahead": ("正前方",),
    "behind": ("身后",),
}
_STATES = {
    ("en", "open"): ("open", "closed"),
    ("en", "toggled"): ("switched on", "switched off"),
    ("zh", "open"): ("打开", "关闭"),
    ("zh", "toggled"): ("打开", "关闭"),
}
_ACTS_EN: Mapping[str, str] = {
    verbs.NAVIGATE: "go to the {}/walk over to the {}/head to the {}/navigate to the {}",
    verbs.OPEN: "open the {}/pull the {} open",
    verbs.CLOSE: "close the {}/shut the {}",
    verbs.PICKUP: "pick up the {}/take the {}/grab the {}",
    verbs.PUT: "put it in the {}/place it on the {}",
    verbs.TOGGLE: "switch on the {}/turn on the {}",
    verbs.OBSERVE: "look around",
    verbs.MOVE_FORWARD: "take a step forward",
    verbs.END: "end the task",
}
_ACTS_ZH: Mapping[str, str] = {
    verbs.NAVIGATE: "去{}那里/走到{}旁边/前往{}",
    verbs.OPEN: "打开{}/把{}打开",
    verbs.CLOSE: "关上{}/把{}关上",
    verbs.PICKUP: "拿起{}/把{}拿起来",
    verbs.PUT: "把它放到{}上/把东西放进{}",
    verbs.TOGGLE: "打开{}",
    verbs.OBSERVE: "环顾四周",
    verbs.MOVE_FORWARD: "向前走一步",
    verbs.END: "结束任务",
}


class _Scene:
    """What can be said about one turn, truly and falsely."""

    def __init__(self, knowledge: Knowledge, draw: random.Random) -> None:
        self.known, self.draw = knowledge, draw
        self.english = knowledge.language == "en"
        self.views = {"ahead": knowledge.view, **knowledge.views}
        self.types = sorted(knowledge.in_view)
        self.seen = all_interchangeable(
            {*knowledge.seen, *knowledge.in_view, knowledge.held} - {""}
        )
        self.named = all_interchangeable(named_in(knowledge.instruction))

    def name(self, object_type: str) -> str:
        """A name of a type that no other type bears: spelled, in words, or in Chinese."""
        words = re.findall(r"[A-Z]+(?![a-z])|[A-Z][a-z]+", object_type)
        if self.english:
            return self.draw.choice((object_type, " ".join(words).lower()))
        return self.draw.choice((object_type, NAMES_ZH[object_type][0]))

    def places(self, object_type: str) -> set[str]:
        wanted = interchangeable(object_type)
        return {
            each.side if view == "ahead" else view
            for view, things in self.views.items()
            for each in things
            if each.type in wanted
        }

    def side(self, direction: str) -> str:
        return self.draw.choice((_SIDES_EN if self.english else _SIDES_ZH)[direction])

    def act(self, action: Action) -> str:
        forms = (_ACTS_EN if self.english else _ACTS_ZH).get(action.verb)
        name = self.name(action.object_type) if action.object_type else ""
        return self.draw.choice(forms.split("/")).format(name) if forms else ""

    def pick(self, choices: Sequence[str]) -> str:
        return self.draw.choice(choices) if choices else ""

    def alone(self, attribute: str) -> list[SeenObject]:
        """Things of which all of the type share a state."""
        found = []
        for each in self.known.view:
            if each.open is not None and each.toggled is not None:
                continue  # Chinese has one word for both
            things = [
                getattr(other, attribute)
                for view in self.views.values()
                for other in view
                if other.type in interchangeable(each.type)
            ]
            if None not in things and len({*things}) == 1:
                found.append(each)
        return found

    def slots(self) -> dict[str, str]:
        """A value for each slot; those that the scene does not offer are left out."""
        known, draw = self.known, self.draw
        found: dict[str, str] = {"near": self.pick(self.types)}
        unknown = [
            each for each in OBJECT_TYPES if not interchangeable(each) & (self.seen | self.named)
        ]
        offered = {*known.navigable, *known.plan, known.subgoal.thing, known.subgoal.place}
        strange = [each for each in unknown if each not in offered and each not in _GENERAL]
        found["unseen"] = self.pick(strange)
        thing = known.subgoal.thing
        if thing and not interchangeable(thing) & self.seen:
            found["sought"] = thing
        opened = {each.action.object_type for each in known.actions if each.success}
        shut = {each.type for each in self.alone("open") if each.open is False}
        closed = sorted(shut - opened - _DOORS)
        found["closed"] = self.pick(closed)
        sided = [each for each in self.types if len(self.places(each)) == 1]
        one = self.pick(sided)
        if one:
            (place,) = self.places(one)
            wrong = [each for each in ("left", "right", "ahead", "behind") if each != place]
            found["thing"] = one
            found["side"], found["right_side"] = self.side(draw.choice(wrong)), self.side(place)
        gone = {each.object_type for each in (a.action for a in known.actions)} | {known.at}
        never = [each for each in self.types if not all_interchangeable([each]) & gone - {""}]
        far = [each for each in never if "openable" in OBJECT_TYPES[each].properties]
        found["unvisited"] = self.pick([each for each in far if each not in _DOORS])
        take = [each for each in self.types if "pickupable" in OBJECT_TYPES[each].properties]
        found["free"] = self.pick(
            [each for each in take if each not in interchangeable(known.held)]
        )
        found["held"] = known.held
        attribute = draw.choice(("open", "toggled"))
        stateful = self.alone(attribute)
        if stateful:
            each = draw.choice(stateful)
            words = _STATES[known.language, attribute]
            found["stateful"] = each.type
            is_so = getattr(each, attribute)
            found["so"], found["not_so"] = words[not is_so], words[is_so]
        found["do"] = self.act(known.decision)
        last = known.last.action if known.last else None
        found["did"] = self.act(last) if last else ""
        found["other"] = self.pick(self.types)
        return found

    def lying(self) -> list[tuple[str, str, list[str]]]:
        """Things that lie on something in view: the type, the holder, and what it is not on."""
        found = []
        for each in self.known.view:
            same = [
                other
                for view in self.views.values()
                for other in view
                if other.type in interchangeable(each.type)
            ]
            if (
                len(same) != 1
                or not each.on
                or "pickupable" not in OBJECT_TYPES[each.type].properties
            ):
                continue
            holders = [
                one
                for one in self.types
                if "receptacle" in OBJECT_TYPES[one].properties
                and "pickupable" not in OBJECT_TYPES[one].properties
                and one not in _DOORS
            ]
            simple = not any(other.on for other in self.known.view if other.type == each.on)
            if simple and each.on not in _PARTS:
                others = [one for one in holders if one not in all_interchangeable([each.on])]
                found.append((each.type, each.on, others))
        return found


_GENERAL = {
    "Floor",
    "Window",
    "RoomDecor",
    "TableTopDecor",
    *(t for t in OBJECT_TYPES if "Sliced" in t),
}
"""Types of which a lie would not be plain."""
_DOORS = {"ShowerCurtain", "ShowerDoor", "Blinds", "Book", "Toilet", "Laptop", "Curtains", "Box"}
"""They open, but nobody would look for things in them."""
_PARTS = {"Drawer", "Shelf", "SinkBasin", "Sink", "Cabinet", "StoveBurner", "BathtubBasin"}
_NAMES = {"near", "unseen", "sought", "closed", "thing", "unvisited", "free", "held", "stateful"}
_NAMES |= {"other", "holder"}


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def fill(template: str, sort: str, scene: _Scene) -> str | None:
    """A template with the scene's values; None if it does not offer them."""
    values = scene.slots()
    if "holder" in template or sort == "support":
        lying = scene.lying()
        if not lying:
            return None
        values["thing"], values["holder"], others = scene.draw.choice(lying)
        values["other"] = scene.pick(others)
        (place, *more) = scene.places(values["thing"])
        values["right_side"] = "" if more else scene.side(place)
    if sort == "state":
        values["thing"] = values.get("stateful", "")
    if sort == "honest" and "closed" in template and values.get("sought") == values["closed"]:
        return None
    if "{did}" in template and _is_vague(scene, sort):
        return None
    if sort == "decision":
        values["act"] = _other_act(scene)
    values["Side"], values["Right_side"] = (
        _capital(values.get(each, "")) for each in ("side", "right_side")
    )
    if not scene.english:
        values["Side"], values["Right_side"] = (
            f"我的{values[each]}" if values[each] else "" for each in ("Side", "Right_side")
        )
    wanted = re.findall(r"{(\w+)}", template)
    if not all(values.get(each) for each in wanted):
        return None
    names = [values[each] for each in wanted if each in _NAMES]
    if any(interchangeable(a) & interchangeable(b) for a, b in itertools.combinations(names, 2)):
        return None
    shown = {each: scene.name(values[each]) if each in _NAMES else values[each] for each in wanted}
    return _capital(template.format(**shown))


def _is_vague(scene: _Scene, sort: str) -> bool:
    last = scene.known.last
    return last is None or (sort == "failed" and last.action.verb == verbs.END)


def _other_act(scene: _Scene) -> str:
    """An action that is not the decision, and no step towards it."""
    known = scene.known
    types = [
        each
        for each in scene.types
        if each not in all_interchangeable([known.decision.object_type or "Floor"])
    ]
    lies_on = {
        each.type
        for view in scene.views.values()
        for each in view
        if each.on in interchangeable(known.decision.object_type or "Floor")
    }
    act = scene.draw.choice((verbs.NAVIGATE, verbs.OPEN, verbs.PICKUP))
    takes = [
        each
        for each in types
        if each not in lies_on
        and (act == verbs.NAVIGATE or verbs.verb_named(act).takes(each))
        and known.seen.get(each) not in interchangeable(known.decision.object_type or "Floor")
    ]
    return scene.act(Action(act, scene.pick(takes))) if takes else ""


def _fits(sort: str, known: Knowledge) -> bool:
    """Whether the sort is a lie at that turn."""
    last = known.last
    return {
        "holding": True,
        "empty hand": bool(known.held),
        "succeeded": last is not None and not last.success,
        "failed": last is not None and all(each.success for each in known.actions[-4:]),
        "decision": known.decision.verb not in (verbs.END,),
    }.get(sort, True)


def planted(knowledges: Sequence[Knowledge], per_template: int = 2) -> list[Planted]:
    """Lies of every sort: each template in up to ``per_template`` situations."""
    return [*_filled(knowledges, {"en": LIES_EN, "zh": LIES_ZH}, per_template)]


def honest(knowledges: Sequence[Knowledge], per_template: int = 6) -> list[Planted]:
    """Honest thoughts in free wording."""
    tables = {"en": {"honest": HONEST_EN}, "zh": {"honest": HONEST_ZH}}
    return [*_filled(knowledges, tables, per_template)]


def _filled(
    knowledges: Sequence[Knowledge],
    tables: Mapping[str, Mapping[str, Sequence[str]]],
    per_template: int,
) -> Iterator[Planted]:
    draw = random.Random(7)
    for language, sorts in tables.items():
        there = [each for each in knowledges if each.language == language]
        for sort, templates in sorts.items():
            fixed = not any("{" in each for each in templates)
            for template in templates:
                made = 0
                for known in draw.sample(there, len(there)):
                    if not _fits(sort, known):
                        continue
                    text = fill(template, sort, _Scene(known, draw))
                    if text is None:
                        continue
                    yield Planted(sort, text, known)
                    made += 1
                    if made == (1 if fixed else per_template):
                        break
