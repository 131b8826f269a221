"""Statistics of a suite's tasks, and its card in Markdown."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from textwrap import fill

from er_gym.tables import Table
from er_gym.tasks import jsonl_format, verbs
from er_gym.tasks.difficulty import hidden_depth, length
from er_gym.tasks.room_kinds import HOUSE, ROOM_KINDS, room_kind
from er_gym.tasks.splits import wording
from er_gym.tasks.task import Task, type_of_id
from er_gym.tasks.types import BY_NAME, GROUPS
from er_gym.thor import OBJECT_TYPES
from er_gym.writing import MARKDOWN_MARK

_WIDTH = 100
_TIED = "\u00a0"
"""Keeps a name and its count on one line while text is wrapped; then replaced by a space."""
_LICENCE = (
    "Licence: Apache-2.0. The scene data that the tasks build on derive from ProcTHOR's "
    "ai2thor-object-metadata (Apache-2.0) and from ALFWorld (MIT); see NOTICE."
)


@dataclass(frozen=True)
class Summary:
    """Numbers of tasks by several properties, without entries of zero.

    Attributes:
        tasks: the number of all tasks.
        groups, types, room_kinds: in the order of their tables.
        scenes: in the order of their numbers.
        subjects: by :func:`subject_type`, the most frequent first.
        receptacles: by type of receptacle that the agent must visit, the most frequent first. A
            task with several types counts for each.
        lengths, depths: by number of key actions, and by number of those that open something;
            ascending.
        rearranged: the number of tasks with moved objects.
        layouts: the number of different arrangements of these tasks.
        wordings: ``seen``, ``unseen``, and ``other`` for instructions in no wording of er-gym.
    """

    tasks: int
    groups: Mapping[str, int]
    types: Mapping[str, int]
    room_kinds: Mapping[str, int]
    scenes: Mapping[str, int]
    subjects: Mapping[str, int]
    receptacles: Mapping[str, int]
    lengths: Mapping[int, int]
    depths: Mapping[int, int]
    rearranged: int
    layouts: int
    wordings: Mapping[str, int]


def subject_type(task: Task) -> str:
    """The type of the first object that a task handles; ``""`` if it handles none."""
    types = [
        *map(type_of_id, task.related_objects[:1]),
        *(
            action.actual_type
            for action in task.key_actions
            if action.verb in (verbs.PICKUP, verbs.TOGGLE)
        ),
    ]
    return next(filter(None, types), "")


def receptacle_types(task: Task) -> tuple[str, ...]:
    """The types of the receptacles to which key actions navigate, each once, in their order."""
    gone_to = (action.actual_type for action in task.key_actions if action.verb == verbs.NAVIGATE)
    return tuple(dict.fromkeys(name for name in gone_to if _is_receptacle(name)))


def _is_receptacle(object_type: str) -> bool:
    return object_type in OBJECT_TYPES and "receptacle" in OBJECT_TYPES[object_type].properties


def summarise(tasks: Iterable[Task]) -> Summary:
    """Count tasks by every property in which a suite should be balanced."""
    tasks = list(tasks)
    scenes = Counter(task.scene for task in tasks)
    lengths = Counter(length(task) for task in tasks)
    depths = Counter(hidden_depth(task) for task in tasks)
    rearranged = [task for task in tasks if task.arrangement.poses]
    return Summary(
        tasks=len(tasks),
        groups=_in_order(GROUPS, (task.type.group for task in tasks)),
        types=_in_order(BY_NAME, (task.type.name for task in tasks)),
        room_kinds=_in_order((*ROOM_KINDS, HOUSE), (room_kind(task.scene) for task in tasks)),
        scenes={scene: scenes[scene] for scene in sorted(scenes, key=_scene_order)},
        subjects=_by_frequency(filter(None, map(subject_type, tasks))),
        receptacles=_by_frequency(name for task in tasks for name in receptacle_types(task)),
        lengths={number: lengths[number] for number in sorted(lengths)},
        depths={number: depths[number] for number in sorted(depths)},
        rearranged=len(rearranged),
        wordings=_in_order(("seen", "unseen", "other"), (wording(t) or "other" for t in tasks)),
        layouts=len({(task.scene, task.arrangement.layout) for task in rearranged}),
    )


def _in_order(order: Iterable[str], names: Iterable[str]) -> dict[str, int]:
    counts = Counter(names)
    return {name: counts[name] for name in order if counts[name]}


def _by_frequency(names: Iterable[str]) -> dict[str, int]:
    return dict(sorted(Counter(names).items(), key=lambda item: (-item[1], item[0])))


def _scene_order(scene: str) -> tuple[int, str]:
    return int("".join(filter(str.isdigit, scene))), scene


def card(
    suite_name: str,
    description: str,
    tasks: Sequence[Task],
    made: Mapping[str, object],
    command: str,
) -> str:
    """A suite's card in Markdown; the same for the same arguments.

    Args:
        suite_name: the title.
        description: a sentence for people.
        tasks: the suite's tasks.
        made: the fields of the task file's header that say how it was made.
        command: the command that writes the task file.
    """
    summary = summarise(tasks)
    parts = [
        f"# {suite_name}",
        _prose(description),
        _prose(_size(summary)),
        _prose(_LICENCE),
        "## How it was made",
        f"```sh\n{command.strip()}\n```",
        _table(("Field", "Value"), [(name, _value(value)) for name, value in made.items()]),
        f"sha256 of the tasks (`er_gym.tasks.jsonl_format.digest`):\n"
        f"`{jsonl_format.digest(tasks)}`",
        *(_counts(summary) if tasks else ()),
    ]
    return MARKDOWN_MARK + "\n\n".join(part for part in parts if part) + "\n"


def _size(summary: Summary) -> str:
    size = f"{_number(summary.tasks, 'task')} in {_number(len(summary.scenes), 'scene')}."
    layouts = f"{summary.rearranged} of them, in {_number(summary.layouts, 'layout')}"
    return f"{size} Rearranged at the start: {layouts if summary.rearranged else 'none'}."


def _counts(summary: Summary) -> list[str]:
    return [
        "## Types",
        _types(summary),
        "## Wordings",
        _prose("Tasks by whether training has tasks in the wording of their instruction:"),
        _tally(summary.wordings),
        "## Scenes",
        _across("Room", summary.room_kinds),
        _scenes(summary),
        "## Objects",
        _prose("Tasks by the type of the first thing that they handle:"),
        _tally(summary.subjects) or "none",
        "## Receptacles",
        _prose("Tasks that go to a receptacle of a type, one task to several of them:"),
        _tally(summary.receptacles) or "none",
        "## Length",
        _prose("Tasks by the number of their key actions, the closing one included:"),
        _across("Key actions", summary.lengths),
        "## Hidden depth",
        _prose("Tasks by how many times something must be opened:"),
        _across("Opened", summary.depths),
    ]


def _types(summary: Summary) -> str:
    rows = []
    for name, count in summary.types.items():
        row = BY_NAME[name]
        group = f"{row.group} ({summary.groups[row.group]})"
        rows.append((group, row.title, f"`{name}`", str(count)))
    return _table(("Group", "Type", "In files", "Tasks"), rows, figures=1)


def _scenes(summary: Summary) -> str:
    """A list item for each kind of room."""
    lines = []
    for kind in summary.room_kinds:
        mine = {scene: n for scene, n in summary.scenes.items() if room_kind(scene) == kind}
        lines.append(f"- {kind} ({_number(len(mine), 'scene')}): {_listed(mine)}")
    return "\n".join(_prose(line, indent="  ") for line in lines)


def _tally(counts: Mapping[str, int]) -> str:
    return _prose(_listed(counts))


def _listed(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{name}{_TIED}{count}" for name, count in counts.items())


def _across(title: str, counts: Mapping[str, int] | Mapping[int, int]) -> str:
    """A table with one row."""
    head = (title, *map(str, counts))
    return _table(head, [("Tasks", *map(str, counts.values()))], figures=len(counts))


def _table(head: Sequence[str], rows: Sequence[Sequence[str]], figures: int = 0) -> str:
    """A Markdown table whose last ``figures`` columns hold numbers; "" without rows."""
    return Table("", tuple(head), tuple(map(tuple, rows)), len(head) - figures).markdown()


def _value(value: object) -> str:
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)


def _number(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def _prose(text: str, indent: str = "") -> str:
    wrapped = fill(
        text,
        _WIDTH,
        subsequent_indent=indent,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return wrapped.replace(_TIED, " ")
