"""Folders that commands go on with: whose they are, what is refused, what is removed again."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import pytest
from pydantic import BaseModel

from er_gym.data.collection import COLLECTION
from er_gym.data.frames import FRAME_SET
from er_gym.locking import LOCK
from er_gym.resumable import KINDS, FolderConflict, FolderKind
from er_gym.rollout.run_directory import RUN


class Cake(BaseModel):
    format: Literal["er-gym/cake/1"] = "er-gym/cake/1"
    flour: str = "rye"
    oven: dict[str, Any] = {}
    cook: str = "me"


def kind(**changes: Any) -> FolderKind[Cake]:
    told = {
        "noun": "cake",
        "command": "er-gym bake",
        "manifest": "cake.json",
        "model": Cake,
        "parts": ("slices", "crumbs.txt"),
        "holds_something": lambda path: (path / "slices").is_dir(),
    }
    return FolderKind(**{**told, **changes})


CAKE = kind()


def content(folder: Path) -> dict[str, str]:
    return {
        str(path.relative_to(folder)): path.read_text() if path.is_file() else ""
        for path in folder.rglob("*")
    }


@pytest.fixture
def baked(tmp_path: Path) -> Path:
    """A folder in which something has been made."""
    folder = tmp_path / "baked"
    assert CAKE.begin(folder, Cake(oven={"heat": 200}))
    (folder / "slices").mkdir()
    return folder


def test_it_begins_once_and_goes_on(baked: Path) -> None:
    before = content(baked)
    assert before == {"cake.json": Cake(oven={"heat": 200}).model_dump_json(indent=2) + "\n",
                      "slices": ""}  # fmt: skip
    assert not CAKE.begin(baked, Cake(oven={"heat": 200}))
    with CAKE.locked(baked, Cake(oven={"heat": 200})) as begins:
        assert not begins
    assert content(baked) == before
    assert CAKE.read(baked) == Cake(oven={"heat": 200})


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"flour": "oat"}, "its flour is 'rye', this one's 'oat'; choose another --out, or repeat"),
        ({"oven": {"heat": 9}}, "its oven.heat is 200, this one's 9; choose"),
        ({"oven": {}}, "its oven.heat is 200, this one's not given; choose"),
        (
            {"oven": {"heat": 200, "fan": None}},
            "its oven.fan is not given, this one's None; choose",
        ),
        (
            {"flour": "oat", "oven": {str(each): each for each in range(7)}, "cook": "you"},
            "this one's 'oat' (further differences: oven.heat, oven.0, oven.1, oven.2, oven.3 and "
            "4 more); choose",
        ),
    ],
)
def test_what_differs_is_told_and_nothing_changed(
    baked: Path, changes: dict[str, Any], told: str
) -> None:
    before = content(baked)
    for attempt in (CAKE.check, CAKE.begin, lambda *given: CAKE.locked(*given).__enter__()):
        with pytest.raises(FolderConflict) as caught:
            attempt(baked, Cake.model_validate({"oven": {"heat": 200}, **changes}))
        assert f"{baked} holds another cake: its " in str(caught.value)
        assert told in str(caught.value)
        assert "\n" not in str(caught.value)
    assert content(baked) == before


def test_what_may_differ_is_up_to_the_kind(baked: Path) -> None:
    free = kind(compared=lambda *both: [each.model_dump(exclude={"cook"}) for each in both])
    assert not free.begin(baked, Cake(oven={"heat": 200}, cook="you"))
    assert CAKE.read(baked).cook == "me"
    with pytest.raises(FolderConflict, match="its flour is"):
        free.check(baked, Cake(flour="oat", oven={"heat": 200}))


def test_where_nothing_has_been_made_another_may_begin(baked: Path) -> None:
    (baked / "slices").rmdir()
    (baked / "crumbs.txt").write_text("of the first")
    (baked / "notes.txt").write_text("mine")
    assert CAKE.begin(baked, Cake(flour="oat"))
    assert CAKE.read(baked).flour == "oat"
    assert content(baked).keys() == {"cake.json", "notes.txt"}


def test_a_manifest_of_somebody_elses_is_left_alone(baked: Path) -> None:
    (baked / "slices").rmdir()
    (baked / "cake.json").write_text('{"flour": "rye"}')
    with pytest.raises(FolderConflict, match=r"cake\.json exists, and er-gym did not write it"):
        CAKE.begin(baked, Cake())
    assert content(baked) == {"cake.json": '{"flour": "rye"}'}


@pytest.mark.parametrize(
    ("name", "told", "told_if_shared"),
    [
        ("notes.txt", "is not empty and holds no cake.json; choose another --out", ""),
        ("run.json", "is a run (it holds run.json); choose another --out", "is a run (it holds"),
        ("export.json", "is an export (it holds export.json)", "is an export (it holds"),
        ("crumbs.txt", "holds crumbs.txt but no cake.json that says which cake it is",
         "holds crumbs.txt but no cake.json"),
        (LOCK, "", ""),
    ],
)  # fmt: skip
def test_where_it_may_begin(tmp_path: Path, name: str, told: str, told_if_shared: str) -> None:
    (tmp_path / name).write_text("something")
    for made, words in ((CAKE, told), (kind(shared=True), told_if_shared)):
        if words:
            with pytest.raises(FolderConflict) as caught:
                made.begin(tmp_path, Cake())
            assert words in str(caught.value)
        else:
            assert made.check(tmp_path, Cake())
    assert content(tmp_path) == {name: "something"}


def test_a_manifest_that_cannot_be_read_is_one_line(baked: Path, tmp_path: Path) -> None:
    class OtherError(FolderConflict):
        pass

    made = kind(error=OtherError)
    for text, words in (
        ("{", "the file: Invalid JSON"),
        ('{"format": "er-gym/cake/2"}', "format: Input should be 'er-gym/cake/1'"),
    ):
        (baked / "cake.json").write_text(text)
        with pytest.raises(OtherError, match=rf"\A.*is no cake: .*cake\.json: {words}.*\Z"):
            made.read(baked)
        with pytest.raises(OtherError, match="is no cake"):
            made.begin(baked, Cake())
        assert (baked / "cake.json").read_text() == text
    with pytest.raises(OtherError, match=r"x/cake\.json: no such file; give the --out .*bake"):
        made.read(tmp_path / "x")


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_what_began_for_nothing_is_removed(tmp_path: Path, error: type[BaseException]) -> None:
    folder = tmp_path / "a" / "cake"

    def fail_after(make: Callable[[], object], *, begins: bool) -> None:
        with CAKE.locked(folder, Cake()) as began:
            assert began is begins
            make()
            raise error

    with pytest.raises(error):
        fail_after(lambda: (folder / "crumbs.txt").write_text("few"), begins=True)
    assert not [*tmp_path.iterdir()]
    for make, begins in (((folder / "slices").mkdir, True), (lambda: None, False)):
        with pytest.raises(error):
            fail_after(make, begins=begins)
        assert content(folder).keys() == {"cake.json", "slices"}


def test_every_kind_is_known_to_the_others() -> None:
    for each in (RUN, COLLECTION, FRAME_SET):
        assert KINDS[each.manifest].endswith(f" {each.noun}")


def test_training_is_known_to_the_others() -> None:
    pytest.importorskip("sb3_contrib", reason="needs the extra rl")
    from agents.rl.train import TRAINING

    assert {*TRAINING.parts} & KINDS.keys() == {"model.npz"}


def test_fine_tuning_is_known_to_the_others() -> None:
    pytest.importorskip("peft", reason="needs the extra finetune")
    from agents.finetune.run_files import FINETUNING

    assert KINDS[FINETUNING.manifest].endswith(f" {FINETUNING.noun}")
