"""A task as plain text."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from textwrap import fill

from er_gym.tasks import verbs
from er_gym.tasks.difficulty import Difficulty
from er_gym.tasks.goal import Condition
from er_gym.tasks.room_kinds import room_kind
from er_gym.tasks.task import KeyAction, Task, type_of_id
from er_gym.tasks.wordings.words import PLURAL, in_or_on_the, pronoun, with_article

_WIDTH = 100

_STATES: dict[tuple[str, bool | str], str] = {
    ("isToggled", True): "on",
    ("isToggled", False): "off",
    ("isOpen", True): "open",
    ("isOpen", False): "closed",
    ("isSliced", True): "sliced",
    ("isSliced", False): "whole",
    ("isCooked", True): "cooked",
    ("isCooked", False): "not cooked",
    ("isBroken", True): "broken",
    ("isBroken", False): "not broken",
    ("isDirty", True): "dirty",
    ("isDirty", False): "clean",
    ("isFilledWithLiquid", True): "filled",
    ("isFilledWithLiquid", False): "empty",
    ("isUsedUp", True): "used up",
    ("isUsedUp", False): "not used up",
    ("temperature", "Hot"): "hot",
    ("temperature", "Cold"): "cold",
    ("temperature", "RoomTemp"): "at room temperature",
}
"""Field of AI2-THOR's metadata and its value to a word that follows "is"."""


@dataclass(frozen=True)
class _Names:
    """Names for the objects of a task: the type, with coordinates if others have the same type.

    Attributes:
        shared: the types of which there are several objects.
    """

    shared: frozenset[str]

    @staticmethod
    def of(task: Task, scene_ids: Iterable[str]) -> _Names:
        ids = dict.fromkeys(
            [
                *scene_ids,
                *(action.object_id for action in task.key_actions),
                *(other for action in task.key_actions for other in action.related_objects),
                *(condition.object_id for condition in task.goal),
                *task.related_objects,
                *task.arrangement.dirty,
            ]
        )
        counts = Counter(type_of_id(object_id) for object_id in ids if object_id)
        return _Names(frozenset(name for name, count in counts.items() if count > 1))

    def the(self, object_id: str) -> str:
        """An object, by its id: "the Egg", "the Cabinet at +00.68|+02.02|-02.46"."""
        return f"the {type_of_id(object_id)}{self._place(object_id)}"

    def inside(self, object_id: str) -> str:
        """The place in or on an object: "in the Fridge"."""
        return f"{in_or_on_the(type_of_id(object_id))}{self._place(object_id)}"

    def _place(self, object_id: str) -> str:
        place = object_id.partition("|")[2]
        return f" at {place}" if place and type_of_id(object_id) in self.shared else ""


def describe(
    task: Task, difficulty: Difficulty | None = None, scene_ids: Iterable[str] = ()
) -> str:
    """A task in several lines of plain text: instruction, an expert's plan, criteria of success.

    Args:
        task: the task.
        difficulty: its difficulty, if it is to be printed.
        scene_ids: the ids of all objects of the scene. Coordinates are added to the name of an
            object if another of these, or of the task's objects, has the same type.
    """
    names = _Names.of(task, scene_ids)
    lines = [
        task.id,
        f"{task.type.title} ({task.type.group}), {_where(task)}",
        *_dirty(task, names),
        "",
        _wrapped(f'"{task.instruction}"'),
        "",
        "Plan",
        *(_wrapped(f"{n:4}. {step}", 6) for n, step in enumerate(_plan(task, names), 1)),
        "",
        "What counts in the end",
        *(_wrapped(f"  - {claim}", 4) for claim in _claims(task, names)),
        "",
        f"Reward {task.total_reward:g} in all, at most {task.max_steps} steps",
        *([_difficulty(difficulty)] if difficulty else []),
    ]
    return "\n".join(lines) + "\n"


def _where(task: Task) -> str:
    where = f"{room_kind(task.scene)} {task.scene}"
    if not task.arrangement.poses:
        return where
    return f"{where}, rearranged as {task.arrangement.layout or 'the task says'}"


def _dirty(task: Task, names: _Names) -> list[str]:
    made = _series(names.the(object_id) for object_id in task.arrangement.dirty)
    return [_wrapped(f"dirty when it begins: {made}")] if made else []


def _plan(task: Task, names: _Names) -> list[str]:
    steps, held, before = [], "", ""
    for action in task.key_actions:
        steps.append(_step(action, names, held, before))
        before = action.object_id
        if action.verb == verbs.PICKUP:
            held = _name(action)
        elif action.verb == verbs.PUT:
            held = ""
    return steps


def _step(action: KeyAction, names: _Names, held: str, before: str) -> str:
    name = _name(action)
    reasons = [other for other in action.related_objects if other != action.object_id]
    # {it} is a pronoun if the action before named the same object.
    plans = {verb.name: verb.in_plan for verb in verbs.table()} | {verbs.INIT: "begin"}
    template = plans.get(action.verb, "{verb} {the}")
    words = {
        "verb": action.verb,
        "the": names.the(name),
        "it": pronoun(type_of_id(name)) if name and name == before else names.the(name),
        "inside": names.inside(name),
        "held": names.the(held) if held else "what is held",
        "reason": f" (for {_series(map(names.the, reasons))})" if reasons else "",
    }
    return template.format_map(words)


def _name(action: KeyAction) -> str:
    """The object's id, or its type if the file states no id."""
    return action.object_id or action.object_type


def _claims(task: Task, names: _Names) -> list[str]:
    order = "in this order" if task.type.ordered else "in any order"
    done = f"all steps of the plan, except navigation, have been done {order}"
    return [done, *(_claim(condition, names) for condition in _goal(task))]


def _goal(task: Task) -> Sequence[Condition]:
    """The task's goal, with the implicit conditions of a search."""
    if not task.type.search:
        return task.goal
    last = next((key.related_objects[-1:] for key in task.key_actions if key.verb == verbs.END), ())
    wanted = dict.fromkeys(type_of_id(name) for name in task.related_objects or last)
    said = {condition.object_type for condition in task.goal if condition.in_reach}
    return (*(Condition(name, in_reach=True) for name in wanted if name not in said), *task.goal)


def _claim(condition: Condition, names: _Names) -> str:
    kind = condition.object_type
    subject = names.the(condition.object_id) if condition.object_id else with_article(kind)
    is_, lies = ("are", "lie") if kind in PLURAL else ("is", "lies")
    claims = [
        *([f"{is_} in the hand"] if condition.held else []),
        *([f"{is_} in sight and within reach"] if condition.in_reach else []),
        *([f"{lies} {in_or_on_the(condition.inside)}"] if condition.inside else []),
        *(
            f"{is_} {_STATES.get((name, value), f'such that {name} says {value}')}"
            for name, value in condition.state
        ),
    ]
    return f"{subject} {_series(claims) or f'{is_} there'}"


def _difficulty(figures: Difficulty) -> str:
    return (
        f"Difficulty: hidden depth {figures.hidden_depth}, distractors {figures.distractors}, "
        f"distance {figures.distance:.1f} m, length {figures.length}"
    )


def _series(words: Iterable[str]) -> str:
    """An enumeration: "a, b and c"."""
    *most, last = [*words] or [""]
    return f"{', '.join(most)} and {last}" if most else last


def _wrapped(text: str, indent: int = 0) -> str:
    return fill(
        text,
        _WIDTH,
        subsequent_indent=" " * indent,
        break_long_words=False,
        break_on_hyphens=False,
    )
