from __future__ import annotations

from pathlib import Path

import pytest

from er_gym.tasks import GROUPS, TASK_TYPES, task_type
from er_gym.tasks.room_kinds import ROOM_KINDS, room_kind
from er_gym.thor import SCENE_NAMES


@pytest.mark.parametrize("row", TASK_TYPES, ids=lambda row: row.env_id)
def test_a_type_is_found_by_both_its_names_and_stands_in_the_readme(row, repository: Path) -> None:
    assert task_type(row.name) is task_type(row.env_id) is row
    assert row.group in GROUPS
    assert f"| `{row.env_id}` | {row.title} | {row.group} | {row.max_steps} |" in (
        repository / "README.md"
    ).read_text(encoding="utf-8")


def test_an_unknown_type_is_answered_with_those_there_are() -> None:
    with pytest.raises(
        ValueError, match="unknown task type 'dance'; choose one of: single_search,"
    ):
        task_type("dance")


def test_every_scene_shows_a_kind_of_room() -> None:
    kinds = [room_kind(scene) for scene in SCENE_NAMES]
    assert kinds == [kind for kind in ROOM_KINDS for _ in range(30)]


@pytest.mark.parametrize(
    ("kind", "scenes"),
    [
        ("kitchen", ("FloorPlan1", "FloorPlan20", "FloorPlan30_physics")),
        ("living room", ("FloorPlan201",)),
        ("bedroom", ("FloorPlan330",)),
        ("bathroom", ("FloorPlan410",)),
    ],
)
def test_kinds_of_room(kind: str, scenes: tuple[str, ...]) -> None:
    assert {room_kind(scene) for scene in scenes} == {kind}


@pytest.mark.parametrize("scene", ["FloorPlan0", "FloorPlan31", "FloorPlan101", "Kitchen1"])
def test_a_scene_without_a_kind(scene: str) -> None:
    with pytest.raises(ValueError, match="is not an iTHOR scene"):
        room_kind(scene)
