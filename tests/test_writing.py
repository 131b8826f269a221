"""Files are written completely or not at all, and replace only files that er-gym wrote."""

from __future__ import annotations

import gzip
import json
import os
import resource
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from PIL import Image

from er_gym import writing
from er_gym.locking import LOCK, Locked, exclusive_use
from er_gym.writing import (
    MARKDOWN_MARK,
    YAML_MARK,
    CannotWrite,
    ForeignFile,
    check_output,
    is_ours,
    kept,
    user_cache,
    whole_folder,
    write_atomic,
    write_output,
    write_picture,
)

ROOT = Path(__file__).resolve().parents[1]
TASKS = b'{"format": "er-gym/tasks/1", "tasks": 0}\n'


@contextmanager
def a_full_disk(room: int) -> Iterator[None]:
    """Files can grow to so many bytes and no further."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


OURS = {
    "tasks": TASKS,
    "packed tasks": gzip.compress(TASKS),
    "a report": json.dumps({"format": "er-gym/report/1"}, indent=2).encode(),
    "a card": MARKDOWN_MARK.encode() + b"# six\n",
    "a configuration": YAML_MARK.encode() + b"seed: 0\n",
    "nothing": b"",
}
THEIRS = {
    "notes": b"# er-gym\n\nWritten by er-gym's users\n",
    "JSON": b'{"tasks": 3, "format": "er-gym/tasks/1"}\n',
    "another format": b'{"format": "er-gymnastics/1"}',
    "packed notes": gzip.compress(b"notes"),
    "a torn packed file": gzip.compress(TASKS)[:4],
    "bytes": b"\xff\xfe\x00",
    "a blank": b"\n",
}


@pytest.mark.parametrize("content", OURS.values(), ids=OURS)
def test_what_is_ours_is_replaced(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "file"
    path.write_bytes(content)
    write_output(path, "new")
    assert path.read_text() == "new"


@pytest.mark.parametrize("content", THEIRS.values(), ids=THEIRS)
def test_what_is_theirs_is_replaced_with_force_only(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "file"
    path.write_bytes(content)
    with pytest.raises(ForeignFile, match=r"file is there already.*--force"):
        write_output(path, "new")
    assert path.read_bytes() == content
    write_output(path, content)  # what is there already
    write_output(path, "new", force=True)
    assert path.read_text() == "new"


@pytest.mark.parametrize("name", ["a.png", "a.jpg", "a.JPEG"])
def test_pictures_say_whose_they_are(tmp_path: Path, name: str) -> None:
    path, picture = tmp_path / name, Image.new("RGB", (9, 9), "red")
    picture.save(path)
    assert not is_ours(path)
    with pytest.raises(ForeignFile):
        write_picture(path, picture.rotate(1))
    write_picture(path, picture, force=True)
    assert is_ours(path)
    write_picture(path, Image.new("RGB", (5, 5)))
    assert Image.open(path).size == (5, 5)


def test_a_picture_that_its_kind_cannot_hold_is_a_line(tmp_path: Path) -> None:
    path = tmp_path / "a.jpg"
    with pytest.raises(ValueError, match=r"a\.jpg: a JPEG file cannot hold this picture"):
        write_picture(path, Image.new("I;16", (9, 9)))
    with pytest.raises(ValueError, match=r"'\.mug' is not a picture format"):
        write_picture(tmp_path / "a.mug", Image.new("RGB", (9, 9)))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("old", [None, TASKS])
def test_a_full_disk_harms_nothing(tmp_path: Path, old: bytes | None) -> None:
    path = tmp_path / "tasks.jsonl"
    if old is not None:
        path.write_bytes(old)
    with a_full_disk(1000), pytest.raises(CannotWrite, match=r"tasks\.jsonl: cannot be written"):
        write_output(path, TASKS * 100)
    assert [each.read_bytes() for each in tmp_path.iterdir()] == [old] * (old is not None)


def test_places_that_cannot_be_written_to(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").write_text("x")
    os.mkfifo(tmp_path / "pipe")
    for path, words in (
        (tmp_path / "folder", "a folder is there"),
        (tmp_path / "pipe", "a device or a pipe is there"),
        (Path("/dev/null"), "a device or a pipe is there"),
        (tmp_path / "no" / "x", f"no folder {tmp_path / 'no'}; make it first"),
        (tmp_path / "file" / "x", f"no folder {tmp_path / 'file'}; make it first"),
        (tmp_path / ("x" * 300), "name too long"),
    ):
        for attempt in (check_output, lambda path: write_output(path, b"new", force=True)):
            with pytest.raises(CannotWrite) as caught:
                attempt(path)
            assert words in str(caught.value)
            assert "\n" not in str(caught.value)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "folder", "pipe"]


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write to read-only files")
def test_read_only_files_and_folders(tmp_path: Path) -> None:
    path = tmp_path / "folder" / "tasks.jsonl"
    path.parent.mkdir()
    path.write_bytes(TASKS)
    for read_only in (path, path.parent):
        mode = read_only.stat().st_mode
        read_only.chmod(mode & 0o555)
        with pytest.raises(CannotWrite, match="read-only"):
            write_output(path, b"new")
        read_only.chmod(mode)
        assert path.read_bytes() == TASKS


def test_links_are_followed_and_permissions_kept(tmp_path: Path) -> None:
    path, link = tmp_path / "tasks.jsonl", tmp_path / "link.jsonl"
    path.write_bytes(TASKS)
    path.chmod(0o640)
    link.symlink_to(path.name)
    write_output(link, "new")
    assert link.is_symlink()
    assert path.read_text() == "new"
    assert path.stat().st_mode & 0o777 == 0o640


def test_the_longest_name_there_may_be(tmp_path: Path) -> None:
    path = tmp_path / ("ü" * 127)
    write_atomic(path, "x")
    assert [each.name for each in tmp_path.iterdir()] == [path.name]


# -- a folder has one user -------------------------------------------------------------------------

_HOLD = """
import sys, time
from pathlib import Path
from er_gym.locking import exclusive_use
with exclusive_use(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""


def test_another_process_is_refused_until_it_is_dead(tmp_path: Path) -> None:
    folder = tmp_path / "a" / "run"
    process = subprocess.Popen(
        [sys.executable, "-c", _HOLD, str(folder)],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        assert process.stdout.readline() == "held\n"
        with pytest.raises(Locked, match=rf"run is in use by process {process.pid};.*--out"):
            exclusive_use(folder).__enter__()
    finally:
        process.kill()
        process.communicate()
    assert (folder / LOCK).exists()
    with exclusive_use(folder):
        (folder / "kept").touch()
    assert [path.name for path in folder.iterdir()] == ["kept"]


def test_nothing_is_left_of_a_folder_that_was_made_for_nothing(tmp_path: Path) -> None:
    with exclusive_use(tmp_path / "a" / "b"), pytest.raises(Locked, match="in use by process"):
        exclusive_use(tmp_path / "a" / "b").__enter__()
    assert list(tmp_path.iterdir()) == []


def test_a_lock_of_somebody_elses_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / LOCK).write_text("my own lock\n")
    with pytest.raises(ForeignFile, match=r"run\.lock exists"):
        exclusive_use(tmp_path).__enter__()
    assert (tmp_path / LOCK).read_text() == "my own lock\n"


@pytest.mark.parametrize("copy", [True, False])
def test_a_file_is_never_placed_into_one_that_is_there(copy: bool, tmp_path: Path) -> None:
    mine, other, to = (tmp_path / name for name in ("mine", "other", "to"))
    mine.write_text("mine")
    other.write_text("other")
    to.hardlink_to(mine)
    (tmp_path / "link").symlink_to(mine)
    for place in (to, tmp_path / "link"):
        with pytest.raises(CannotWrite, match="cannot be written: a file is there already"):
            writing.place_file(other, place, copy=copy)
    assert mine.read_text() == "mine"
    (tmp_path / "deep").mkdir()
    (tmp_path / "relative").symlink_to("other")
    assert writing.place_file(tmp_path / "relative", tmp_path / "deep" / "x", copy=copy) != copy
    assert (tmp_path / "deep" / "x").read_text() == "other"


def test_drafts_of_others_are_not_written_into(tmp_path: Path) -> None:
    (tmp_path / "mine").write_text("mine")
    (tmp_path / "to").hardlink_to(tmp_path / "mine")
    with writing.replaced(tmp_path / "to") as file:
        file.write("new")
    assert (tmp_path / "to").read_text() == "new"
    (tmp_path / "also").hardlink_to(tmp_path / "mine")
    writing.write_new(tmp_path / "also", b"new")
    assert (tmp_path / "mine").read_text() == "mine"
    with pytest.raises(TypeError), writing.replaced(tmp_path / "to") as file:
        file.writelines(["half", 7])  # type: ignore[list-item]
    assert (tmp_path / "to").read_text() == "new"
    with pytest.raises(FileNotFoundError), writing.replaced(tmp_path / "to"):
        (tmp_path / "nowhere").read_text()  # the block's own error, not one of writing
    assert {each.name for each in tmp_path.iterdir()} == {"mine", "to", "also"}


def test_names_of_files_stay_in_their_folder(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "out").symlink_to(tmp_path)
    for name in ("a", "a/b.png", "./a", "a|+1.00", "out/x"):
        assert writing.inside(tmp_path / "in", name) == tmp_path / "in" / name
    assert writing.inside(tmp_path / "in", "a/b", links=False) == tmp_path.resolve() / "in/a/b"
    for name in (
        "",
        ".",
        "..",
        "../in/a",
        "a/../b",
        "/a",
        "\\a",
        "a\\..\\..\\b",
        "C:a",
        "a\0",
        "x" * 256,
    ):
        with pytest.raises(writing.OutsideFolder, match=r"\A[^\n]+\Z"):
            writing.inside(tmp_path / "in", name)
    with pytest.raises(writing.OutsideFolder, match="is a link that leads out of"):
        writing.inside(tmp_path / "in", "out/x", links=False)


@pytest.mark.parametrize("is_there", [False, True])
def test_a_folder_is_written_whole_or_not_at_all(is_there: bool, tmp_path: Path) -> None:
    out = tmp_path / "out"
    if is_there:
        out.mkdir()
    with pytest.raises(UnicodeEncodeError), whole_folder(out) as draft:
        (draft / "a").write_text("\ud800")  # the file is there, and empty
    assert [*tmp_path.rglob("*")] == ([out] if is_there else [])
    with whole_folder(out) as draft:
        (draft / "sub").mkdir()
        (draft / "sub" / "a").touch()
    assert [*tmp_path.rglob("*")] == [out, out / "sub", out / "sub" / "a"]
    with pytest.raises(ForeignFile, match="is not empty; choose another output"):
        whole_folder(out).__enter__()


def test_a_folder_with_the_stamp_is_replaced_whole_or_not_at_all(tmp_path: Path) -> None:
    out = tmp_path / "out"

    def write(*names: str) -> None:
        with whole_folder(out, "stamp") as draft:
            for name in names:
                (draft / name).write_text("".join(names))

    def content() -> dict[str, str]:
        return {each.name: each.read_text() for each in out.iterdir()}

    write("a", "stamp")
    write("stamp", "a", "b")
    assert content() == dict.fromkeys(("stamp", "a", "b"), "stampab")
    with pytest.raises(ForeignFile, match=r"out is not empty; .*would be lost: b"):
        write("a", "stamp")
    with pytest.raises(ForeignFile, match=r"out is not empty; choose another output"):
        whole_folder(out, "another stamp").__enter__()
    assert content() == dict.fromkeys(("stamp", "a", "b"), "stampab")
    assert [*tmp_path.iterdir()] == [out]


def test_a_folder_whose_draft_cannot_be_moved_is_as_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, rename = tmp_path / "out", Path.rename
    with whole_folder(out, "stamp") as draft:
        (draft / "stamp").touch()

    def full(self: Path, to: Path) -> Path:
        if self.suffix == ".draft":
            raise OSError(28, "No space left on device")
        return rename(self, to)

    monkeypatch.setattr(Path, "rename", full)
    with pytest.raises(OSError, match="No space"), whole_folder(out, "stamp") as draft:
        (draft / "stamp").write_text("new")
    assert [*tmp_path.rglob("*")] == [out, out / "stamp"]
    assert not (out / "stamp").read_text()


def test_a_folder_that_others_fill_meanwhile_is_theirs(tmp_path: Path) -> None:
    with (
        pytest.raises(ForeignFile, match="was empty and is no more"),
        whole_folder(tmp_path),
    ):
        (tmp_path / "theirs").touch()
    assert [each.name for each in tmp_path.iterdir()] == ["theirs"]


def test_what_is_kept_is_made_once_and_old_folders_go(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    made: list[bytes] = []

    def make() -> bytes:
        made.append(b"value")
        return made[-1]

    assert [kept("rooms", "k1", "a", make) for _ in range(3)] == [b"value"] * 3
    assert len(made) == 1
    path = user_cache() / "rooms-k1" / "a"
    path.write_bytes(path.read_bytes().replace(b"value", b"wrong"))
    assert kept("rooms", "k1", "a", make) == b"value"
    assert len(made) == 2

    other = user_cache() / "lines-k0"
    other.mkdir()
    for folder in (path.parent, other):
        os.utime(folder, (0, 0))
    kept("rooms", "k2", "a", make)
    assert sorted(each.name for each in user_cache().iterdir()) == ["lines-k0", "rooms-k2"]

    monkeypatch.setenv("XDG_CACHE_HOME", str(path.parents[1] / "rooms-k2" / "a"))  # a file
    assert kept("rooms", "k3", "a", make) == b"value"
