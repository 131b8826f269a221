"""The directory of a collection: who may write into it, and what a full disk leaves."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import Any

import pytest

from er_gym.data.collection import Collection, CollectionError, CollectionManifest
from er_gym.writing import CannotWrite

SETTINGS: dict[str, Any] = {"language": "en", "recipe": {"parts": {"one": {"kinds": {"a": 1.0}}}}}


def manifest(**changes: Any) -> CollectionManifest:
    told = {"suite": "mini", "suite_digest": "0", "settings": SETTINGS, "seed": 0, "er_gym": "1"}
    return CollectionManifest.model_validate({**told, **changes})


def begun(path: Path) -> Collection:
    """A collection with an episode."""
    collection = Collection.create(path, manifest())
    episodes = collection.part_path("one") / "episodes"
    episodes.mkdir(parents=True)
    (episodes / "x.json").write_text("{}")
    return collection


OTHERS: dict[str, tuple[dict[str, Any], str]] = {
    "seed": ({"seed": 4}, "its seed is 0, this one's 4"),
    "version": ({"er_gym": "2"}, "its er_gym is '1', this one's '2'"),
    "setting": (
        {"settings": {**SETTINGS, "language": "zh"}},
        "its settings.language is 'en', this one's 'zh'",
    ),
    "more": (
        {"settings": {**SETTINGS, "expert": {"name": "m"}}},
        "its settings.expert is not given, this one's {'name': 'm'}",
    ),
    "less": (
        {"settings": {"language": "en"}},
        "its settings.recipe is {'parts': {'one': {'kinds': {'a': 1.0}}}}, this one's not given",
    ),
    "deep": (
        {"settings": {**SETTINGS, "recipe": {"parts": {"one": {"kinds": {"a": 0.5}}}}}},
        "its settings.recipe.parts.one.kinds.a is 1.0, this one's 0.5",
    ),
}


@pytest.mark.parametrize(("changes", "message"), OTHERS.values(), ids=OTHERS)
def test_the_first_difference_is_told(
    changes: dict[str, Any], message: str, tmp_path: Path
) -> None:
    begun(tmp_path / "x")
    assert Collection.create(tmp_path / "x", manifest()).manifest == manifest()
    with pytest.raises(CollectionError, match="holds another collection") as told:
        Collection.create(tmp_path / "x", manifest(**changes))
    assert message in str(told.value)
    assert Collection.open(tmp_path / "x").manifest == manifest()


def test_a_directory_without_an_episode_is_free_for_another(tmp_path: Path) -> None:
    Collection.create(tmp_path, manifest()).write(())
    assert Collection.create(tmp_path, manifest(seed=4)).manifest.seed == 4
    assert Collection.open(tmp_path).manifest.seed == 4
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(CollectionError, match="its seed is 4"):
        Collection.create(tmp_path, manifest())


def test_a_full_disk_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fsync(handle: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    collection = begun(tmp_path)
    file = tmp_path / "trajectories.jsonl"
    file.write_text("as it was")
    monkeypatch.setattr(os, "fsync", fsync)
    with pytest.raises(CannotWrite, match=r"trajectories\.jsonl: .*No space left on device"):
        collection.write(())
    assert file.read_text() == "as it was"
    assert {each.name for each in tmp_path.iterdir()} == {
        "collection.json",
        "parts",
        "trajectories.jsonl",
    }
