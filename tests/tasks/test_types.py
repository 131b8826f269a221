from __future__ import annotations

from pathlib import Path

import pytest

from er_gym.tasks import GROUPS, TASK_TYPES, task_type
from er_gym.tasks import types as types_module
from er_gym.tasks.room_kinds import ROOM_KINDS, room_kind
from er_gym.tasks.types import (
    TaskType,
    canonical_names,
    shares_by_name,
    short_name,
    types_named,
)
from er_gym.thor import SCENE_NAMES
from tests.support import in_one_test

LONG = "long-range tasks with dependency relationships"


@pytest.mark.parametrize("row", TASK_TYPES, ids=lambda row: row.env_id)
def test_a_type_is_found_by_both_its_names_and_stands_in_the_readme(row, repository: Path) -> None:
    assert task_type(row.name) is task_type(row.env_id) is row
    assert row.group in GROUPS
    shown = f"| `{row.env_id}` | `{row.name}` | {row.title} | {row.group} | {row.max_steps} |"
    assert shown in (repository / "README.md").read_text(encoding="utf-8")


def test_an_unknown_type_is_answered_with_those_there_are() -> None:
    with pytest.raises(
        ValueError, match="unknown task type 'dance'; choose one of: single_search,"
    ):
        task_type("dance")


def _spellings(name: str) -> set[str]:
    """A name as people type it."""
    joined = {name.replace(" ", mark).replace("_", mark).replace("-", mark) for mark in ("_", "-")}
    spaced = name.replace("_", " ").replace("-", " ")
    return {name, name.lower(), name.upper(), f" {name} ", spaced, spaced.replace(" ", "")} | joined


@in_one_test("row", TASK_TYPES)
def test_each_name_of_a_type_is_taken_however_it_is_spelled(row: TaskType) -> None:
    bare = row.env_id.removeprefix("ER-").removesuffix("-v0")
    names = [row.name, row.title, row.env_id, bare, f"ER-{bare}", f"{bare}-v0", short_name(row)]
    for name in names:
        for spelled in _spellings(name):
            assert types_named([spelled]) == (row,), spelled
            assert task_type(spelled) is row, spelled


def test_the_papers_words_and_plurals() -> None:
    assert canonical_names(["long-range tasks with dependency relationships"]) == (LONG,)
    assert canonical_names(["Long-Range Tasks With Dependencies", "LongRange"]) == (LONG,)
    assert canonical_names(["Exposed-to-Enclosed Object Transfers"]) == (
        "pickup_and_put_in_closerep",
    )


@in_one_test("group", GROUPS)
def test_a_group_stands_for_its_types_in_the_tables_order(group: str) -> None:
    rows = tuple(row for row in TASK_TYPES if row.group == group)
    assert (
        types_named([group]) == types_named([group.upper()]) == types_named([f"{group}s"]) == rows
    )
    assert types_named([group, rows[-1].name]) == rows
    with pytest.raises(ValueError, match=f"'{group}' names a group of {len(rows)} types; give one"):
        task_type(group)


def test_no_two_types_share_a_name() -> None:
    several = {key for key, rows in types_module._by_key().items() if len(rows) > 1}
    groups = (*GROUPS, "Manipulation", "Transportation")
    assert several == {key for name in groups for key in types_module._keys(name)}


def test_a_number_of_a_group_is_dealt_out_to_its_types() -> None:
    assert shares_by_name({"Composite": 5, "single search": 2}) == {
        "ordered_pickup_two_object_and_put": 3, LONG: 2, "single_search": 2
    }  # fmt: skip
    with pytest.raises(ValueError, match=r"'LongRange' names .* which has a number already"):
        shares_by_name({"Composite": 5, "LongRange": 1})


@in_one_test("case", [("singel_search", "single_search"), ("long rang", LONG), ("serch", "Search"),
                      ("Exposed Object Serch", "single_search")])  # fmt: skip
def test_an_unknown_name_is_answered_with_the_nearest_and_all(case: tuple[str, str]) -> None:
    given, near = case
    with pytest.raises(ValueError, match="unknown") as raised:
        types_named([given])
    said = str(raised.value)
    assert said.startswith(f"unknown task type {given!r} (did you mean ")
    assert near in said.split("?)")[0]
    assert all(row.name in said for row in TASK_TYPES)
    assert all(group in said for group in GROUPS)


@in_one_test("given", [None, 5, "", " ", "-", ["single_search"], "x" * 10_000])
def test_what_is_no_name_is_refused_in_one_line(given: object) -> None:
    with pytest.raises(ValueError, match=r"unknown task type [^\n]{1,700}$"):
        types_named([given])  # type: ignore[list-item]


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
