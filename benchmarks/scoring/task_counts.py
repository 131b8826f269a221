"""Tables of task counts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from benchmarks.scoring.tables import print_tables
from benchmarks.terminal import stdout
from er_gym.tables import Table
from er_gym.tasks.room_kinds import HOUSE, ROOM_KINDS, room_kind
from er_gym.tasks.splits import split, wording
from er_gym.tasks.task import Task
from er_gym.tasks.types import BY_NAME


def print_counts(
    chosen: Sequence[Task], dropped: Mapping[str, int], by_scene: bool = False
) -> None:
    """Print the number of tasks of each type in each kind of room, and the reasons for dropped
    ones.

    Args:
        dropped: reason to how many tasks were not taken for it.
        by_scene: also count by scene, and by split.
    """
    kinds = [kind for kind in BY_NAME.values() if any(task.type is kind for task in chosen)]
    cells = Counter((task.type, room_kind(task.scene)) for task in chosen)
    rooms = [*ROOM_KINDS, *([HOUSE] if any(room == HOUSE for _, room in cells) else [])]
    rows = [
        (kind.group, kind.name, *(str(cells[kind, room]) for room in rooms),
         str(sum(cells[kind, room] for room in rooms)))
        for kind in kinds
    ]  # fmt: skip
    rows.append(
        ("", "all", *(str(sum(cells[kind, room] for kind in kinds)) for room in rooms),
         str(len(chosen)))
    )  # fmt: skip
    found = [Table("Tasks", ("Group", "Type", *rooms, "all"), tuple(rows), 2)]
    if by_scene:
        found += [_scene_table(chosen), _count_table("Splits", Counter(map(split, chosen)))]
        told = Counter(f"in {wording(task) or 'other'} wordings" for task in chosen)
        found.append(_count_table("Wordings", told))
    if dropped:
        found.append(_count_table("Dropped", dropped))
    print_tables(found, stdout())


def _scene_table(chosen: Sequence[Task]) -> Table:
    cells = Counter((task.scene, task.type) for task in chosen)
    scenes = sorted({task.scene for task in chosen}, key=lambda name: (len(name), name))
    kinds = list(BY_NAME.values())
    rows = tuple(
        (
            scene,
            *(str(cells[scene, kind]) for kind in kinds),
            str(sum(cells[scene, kind] for kind in kinds)),
        )
        for scene in scenes
    )
    names = tuple(kind.title for kind in kinds)
    return Table("Tasks by scene", ("Scene", *names, "all"), rows, 1)


def _count_table(title: str, counts: Mapping[str, int]) -> Table:

    rows = tuple((name, str(n)) for name, n in sorted(counts.items(), key=lambda item: -item[1]))
    return Table(title, (title, "Tasks"), rows, 1)
