"""Gives the importers and exporters files that strangers may have written.

    python -m benchmarks.checks.foreign_files [WORD …]

ShareGPT files in which each field in turn is everything that JSON can hold, ids that are the same
as files, links, files that are named as pictures and are none, paths of other machines, and
collections whose fields lead out of every folder, in each export format that needs no further
library. Whatever happens: an error is one line, nothing outside the output has changed, nothing is
left behind, and what was read is shown with its own picture. Prints the failures; the exit code is
1 if there is one. Takes a minute.
"""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import cycle
from pathlib import Path
from typing import Any, NamedTuple

from PIL import Image

from benchmarks.checks.foreign_values import NAMES, PICTURES, contents, mutations
from benchmarks.checks.misuse.tries import require
from benchmarks.harness.tally import Tally, has_words, run_check, tally
from er_gym.data.collection import Collection
from er_gym.data.exports import export
from er_gym.data.pictures import open_picture
from er_gym.data.sharegpt_files import open_sharegpt
from er_gym.data.sharegpt_import import import_sharegpt
from er_gym.data.trajectory import Trajectory

_LONGEST = 1_500
"""Characters of an error."""
_END = "It is done. <DecisionMaking>end</DecisionMaking>"
_COLOURS = {"a": (255, 0, 0), "b": (0, 255, 0), "c": (0, 0, 255)}
_FORMATS = ("paper", "sharegpt", "ms-swift", "trl", "trl-turns")
_FIELDS = (
    "id", "task_id", "task_type", "scene", "kind", "mode", "part", "actor", "end_reason",
    "object_id", "object_type", "path", "direction",
)  # fmt: skip
"""Of a trajectory, its turn and its picture."""
_OF_TURN, _OF_PICTURE = ("object_id", "object_type"), ("path", "direction")
_INFO = {
    "mine": {
        "file_name": "t.json", "formatting": "sharegpt",
        "columns": {"messages": "conversations", "images": "images", "system": "system"},
        "tags": {"role_tag": "from", "content_tag": "value", "user_tag": "human"},
    }
}  # fmt: skip
_PARTS = {
    "id": "x",
    "messages": [
        {"role": "user", "content": [{"type": "image", "image": {"url": "a.png"}}]},
        {"role": "assistant", "content": [{"type": "text", "text": _END}], "loss": True},
    ],
}


class _Try(NamedTuple):
    """Something that is tried in a folder: its name, and its function."""

    name: str
    do: Callable[[Path], None]


def check(words: Sequence[str] = ()) -> Tally:
    """Try all whose names hold the words, and print the failures."""
    every = (*_fields(), *_ids(), *_links(), *_pictures(), *_elsewhere(), *_exports())
    chosen = (each for each in every if has_words(each.name, words))
    return tally("foreign files", ((f"{each.name:.200}", _problems(each)) for each in chosen))


def _problems(each: _Try) -> Iterator[str]:
    """What is wrong after a try: in ``home`` are the user's files, in ``to`` is what was made."""
    with tempfile.TemporaryDirectory() as directory:
        top = Path(directory)
        for name in ("home", "to"):
            (top / name).mkdir()
        for name, colour in _COLOURS.items():
            Image.new("RGB", (32, 18), colour).save(top / "home" / f"{name}.png")
        try:
            each.do(top)
        except ValueError as error:  # what the commands tell in one line
            if "\n" in str(error) or len(str(error)) > _LONGEST:
                yield f"its error has several lines, or is too long: {str(error)[:200]!r}"
        except Exception as error:  # any other would be a traceback
            yield f"{type(error).__name__}: {str(error)[:300]}"
        left = sorted(each.name for each in top.iterdir() if each.name not in ("home", "to"))
        left += [str(each.relative_to(top)) for each in (top / "to").glob(".*")]
        if left or Path("/tmp/er-gym-outside").exists():
            yield f"left {left[:3]}"


def _kept(top: Path, do: Callable[[], object]) -> None:
    """Do something that may change nothing in the user's folder."""
    before = contents(top / "home")
    try:
        do()
    finally:
        require(contents(top / "home") == before, "a file of the user's has changed")


def _talk(name: str, image: Any = "a.png", key: str = "images") -> dict[str, Any]:
    said = [{"from": "human", "value": "<image>Look."}, {"from": "gpt", "value": _END}]
    return {"id": name, "conversations": said, key: image}


def _import(top: Path, samples: object, **options: Any) -> list[Trajectory]:
    file = top / "home" / "t.json"
    file.write_text(json.dumps(samples))
    found: list[Trajectory] = []

    def do() -> None:
        import_sharegpt(open_sharegpt(file, decisions=True, **options), top / "to" / "x")
        found.extend(Collection.open(top / "to" / "x").trajectories())

    _kept(top, do)
    return found


def _shown(top: Path, found: Sequence[Trajectory], colours: str) -> None:
    """Each trajectory must show the picture of its colour."""
    require(len(found) == len(colours), f"{len(found)} of {len(colours)} are there")
    for each, name in zip(found, colours, strict=True):
        picture = open_picture(top / "to" / "x" / each.turns[0].pictures[0].path)
        require(picture.getpixel((0, 0)) == _COLOURS[name], f"{each.id} shows another picture")


# -- imports ---------------------------------------------------------------------------------------


def _fields() -> Iterator[_Try]:
    def one(changed: Any, valid: dict[str, Any], top: Path) -> None:
        found = _import(top, [changed, {**valid, "id": "good"}], leave_out=True)
        require(any(each.id.startswith("good") for each in found), "the good sample is lost")

    def info(changed: Any, top: Path) -> None:
        (top / "home" / "t.json").write_text(json.dumps([_talk("good")]))
        (top / "home" / "dataset_info.json").write_text(json.dumps(changed))
        opened = open_sharegpt(top / "home", decisions=True)
        _kept(top, partial(import_sharegpt, opened, top / "to" / "x"))

    for valid in (_talk("x"), _talk("x", "a.png", "image"), _PARTS):
        for changed in mutations(valid):
            yield _Try(f"a sample {changed!r:.100}", partial(one, changed, valid))
    for changed in mutations(_INFO):
        yield _Try(f"dataset_info {changed!r:.100}", partial(info, changed))


def _ids() -> Iterator[_Try]:
    def ids(names: Sequence[str], top: Path) -> None:
        talks = [_talk(name, f"{at}.png") for name, at in zip(names, "abc", strict=True)]
        found = _import(top, talks)
        require(len({each.id for each in found}) == len(names), "two have one id")
        _shown(top, found, "abc")

    for names in (
        ("x", "x", "x-2"), ("x-2", "x", "x"), ("x", "x-2", "x"), ("x", "x", "x"), ("", "", ""),
        ("t-00001", "", "t-00001"), ("a/b", "a_b-c14cddc0", "a/b"), ("A", "a", "A"),
        ("x", "x-2", "x-2"), ("", "t-00000", "t-00000-2"),
        *((name, name, f"{name}-2") for name in NAMES),
    ):  # fmt: skip
        yield _Try(f"ids {names!r:.100}", partial(ids, names))


def _links() -> Iterator[_Try]:
    def link(to: str, top: Path) -> None:
        (top / "home" / "deep").mkdir()
        (top / "home" / "deep" / "key").write_text("secret")
        (top / "home" / "deep" / "blob").write_bytes((top / "home" / "b.png").read_bytes())
        (top / "home" / "loop").symlink_to("loop")
        os.mkfifo(top / "home" / "pipe")
        (top / "home" / "l.png").symlink_to(to.replace("TOP", str(top)))
        found = _import(top, [_talk("x", "l.png"), _talk("y")], leave_out=True)
        if to.endswith(("blob", "b.png")):
            _shown(top, found, "ba")
        else:
            _shown(top, found, "a")

    for to in (
        "b.png", "./b.png", "deep/blob", "deep/../b.png", "TOP/home/deep/blob", "deep/key", "loop",
        "nowhere", "/dev/zero", "/dev/stdin", "/etc/passwd", "pipe", "deep", "..",
    ):  # fmt: skip
        yield _Try(f"a link to {to}", partial(link, to))


def _pictures() -> Iterator[_Try]:
    def imported(data: bytes, top: Path) -> None:
        (top / "home" / "l.png").write_bytes(data)
        _shown(top, _import(top, [_talk("x", "l.png"), _talk("y")], leave_out=True), "a")

    def exported(data: bytes, form: str, top: Path) -> None:
        (one,) = _import(top, [_talk("x")])
        where = top / "to" / "x"
        Collection.open(where).write([one.model_copy(update={"scene": "FloorPlan1"})])
        file = where / one.turns[0].pictures[0].path
        file.unlink()
        file.write_bytes(data)
        try:
            export(Collection.open(where), form, top / "to" / "y")
        except ValueError:
            require(not (top / "to" / "y").exists(), "an output was left")
            raise
        raise AssertionError("it was exported")

    for name, data in PICTURES.items():
        yield _Try(f"a picture that is {name}", partial(imported, data))
        for form in _FORMATS:
            yield _Try(f"a picture that is {name} to {form}", partial(exported, data, form))


def _elsewhere() -> Iterator[_Try]:
    def read(path: str, where: str, top: Path) -> None:
        place = top / "home" / where
        place.parent.mkdir(parents=True, exist_ok=True)
        (top / "home" / "b.png").rename(place)
        _shown(top, _import(top, [_talk("x", path), _talk("y")], leave_out=True), "ba")

    def unread(path: Any, top: Path) -> None:
        _shown(top, _import(top, [_talk("y"), _talk("x", path)], leave_out=True), "a")
        text = (top / "to" / "x" / "left_out.jsonl").read_text()
        require('"item": 1' in text, "what was left out is not named")

    for path, where in (
        ("b.png", "b.png"), ("shots\\b.png", "shots/b.png"), ("shots/b.png", "shots/b.png"),
        (".\\shots\\b.png", "shots/b.png"), ("./shots/b.png", "shots/b.png"),
    ):  # fmt: skip
        yield _Try(f"the path {path}", partial(read, path, where))
    others: tuple[Any, ...] = (
        *NAMES, "https://x.example/a.png", "file:///etc/passwd", "data:image/png;base64,AA", 7,
        {"bytes": "AA"}, {}, [[]], ["a.png", "b.png"], "/etc/passwd", "\\\\server\\a.png",
    )  # fmt: skip
    for told in others:
        yield _Try(f"no path {told!r:.60}", partial(unread, told))


# -- exports ---------------------------------------------------------------------------------------


def _exports() -> Iterator[_Try]:
    def do(field: str, name: str, form: str, top: Path) -> None:
        talk = _talk("x", ["a.png", "b.png", "c.png"])
        talk["conversations"][0]["value"] = "<image><image><image>Look."
        (one,) = _import(top, [talk])
        one = one.model_copy(update={"scene": "FloorPlan1"})
        where = top / "to" / "x"
        Collection.open(where).write([_with(one, field, name), _with(one, "id", "one")])
        before = contents(top)
        try:
            export(Collection.open(where), form, top / "to" / "deep" / "y")
        finally:
            shutil.rmtree(top / "to" / "deep", ignore_errors=True)
            require(contents(top) == before, "something outside the output has changed")

    others = cycle(_FORMATS[1:])
    for field in _FIELDS:
        for name in NAMES:
            for form in (_FORMATS[0], next(others)):
                yield _Try(f"{field} {name!r:.40} to {form}", partial(do, field, name, form))


def _with(one: Trajectory, field: str, name: str) -> Trajectory:
    turn = one.turns[0]
    if field in _OF_PICTURE:
        shown = turn.pictures[0].model_copy(update={field: name})
        turn = turn.model_copy(update={"pictures": [shown, *turn.pictures[1:]]})
    elif field in _OF_TURN:
        turn = turn.model_copy(update={field: name})
    else:
        return one.model_copy(update={field: name})
    return one.model_copy(update={"turns": [turn, turn]})


if __name__ == "__main__":
    run_check(check, __doc__)
