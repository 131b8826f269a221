"""Files of strangers: whatever they say, only the output is written, and every error is a line."""

from __future__ import annotations

import copy
import json
import os
import shutil
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from PIL import Image

from benchmarks.checks.foreign_values import contents, mutations
from benchmarks.cli.data import data
from er_gym.data.collection import Collection
from er_gym.data.exports import EXPORTS, export
from er_gym.data.sharegpt_files import ShareGptError, open_sharegpt
from er_gym.data.sharegpt_import import LEFT_OUT, import_sharegpt
from er_gym.data.trajectory import Trajectory

END = "Let me double-check: it is in my hand. <DecisionMaking>end</DecisionMaking>"


def older() -> dict[str, Any]:
    return {
        "conversations": [
            {"from": "human", "value": "<image>Look."},
            {"from": "gpt", "value": END},
        ],
        "images": ["a.png"],
    }


def written(path: Path, samples: object) -> Path:
    path.write_text(json.dumps(samples), encoding="utf-8")
    return path


def picture(path: Path, colour: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.new("RGB", (32, 18), colour).save(path, "png")
    return path


def talk(name: str, image: Any, key: str = "images") -> dict[str, Any]:
    return {**older(), "id": name, "images": [], key: image}


@pytest.fixture
def home(tmp_path: Path) -> Path:
    """A user's folder with three pictures."""
    home = tmp_path / "home"
    for name, colour in (("a", "red"), ("b", "green"), ("c", "blue")):
        picture(home / f"{name}.png", colour)
    return home


def imported(file: Path, out: Path, **options: Any) -> list[Trajectory]:
    import_sharegpt(open_sharegpt(file, decisions=True, **options), out)
    return [*Collection.open(out).trajectories()]


@pytest.mark.parametrize(
    ("ids", "wanted"),
    [
        (["x", "x", "x-2"], ["x", "x-3", "x-2"]),
        (["x-2", "x", "x"], ["x-2", "x", "x-3"]),
        (["x", "x", "x"], ["x", "x-2", "x-3"]),
        (["t-00001", "", "t-00001"], ["t-00001", "t-00001-2", "t-00001-3"]),
        (["a/b", "a_b-c14cddc0", "a/b"], ["a/b", "a_b-c14cddc0-2", "a/b-2"]),
    ],
)
def test_no_picture_of_the_users_is_written_whatever_the_ids(
    ids: list[str], wanted: list[str], home: Path, tmp_path: Path
) -> None:
    talks = [talk(name, f"{at}.png") for name, at in zip(ids, "abc", strict=True)]
    file = written(home / "t.json", talks)
    before = contents(home)
    found = imported(file, tmp_path / "out")
    assert [each.id for each in found] == wanted
    for each, at in zip(found, "abc", strict=True):
        placed = tmp_path / "out" / each.turns[0].pictures[0].path
        assert placed.read_bytes() == (home / f"{at}.png").read_bytes()
    assert contents(home) == before


def test_links_of_a_hubs_cache_are_resolved_and_told(home: Path, tmp_path: Path) -> None:
    cache = tmp_path / "hub" / "snapshots" / "main"
    cache.mkdir(parents=True)
    (tmp_path / "hub" / "blobs").mkdir()
    (home / "a.png").rename(tmp_path / "hub" / "blobs" / "f00")
    (cache / "a.png").symlink_to("../../blobs/f00")
    (tmp_path / "hub" / "blobs" / "f01").write_text(json.dumps([older()]))
    (cache / "t.json").symlink_to("../../blobs/f01")
    out = tmp_path / "deep" / "er" / "out"
    result = CliRunner().invoke(data, ["import", str(cache / "t.json"), "--out", str(out)])
    assert result.exit_code == 0, result.output
    told = f"1 pictures lie outside {cache}, such as {(tmp_path / 'hub/blobs/f00').resolve()}"
    assert told in " ".join(result.output.split())
    (one,) = Collection.open(out).trajectories()
    placed = out / one.turns[0].pictures[0].path
    assert not placed.is_symlink()
    assert Image.open(placed).getpixel((0, 0)) == (255, 0, 0)
    # The same of an export, of a collection whose pictures are links.
    placed.rename(out / "b")
    placed.symlink_to(os.path.relpath(out / "b", placed.parent))
    summary = export(Collection.open(out), "ms-swift", tmp_path / "x" / "y" / "z")
    assert (summary.pictures, summary.linked, summary.outside.count) == (1, 1, 0)
    (exported,) = (tmp_path / "x").rglob("*.png")
    assert Image.open(exported).size == (32, 18)


def test_what_is_no_picture_is_not_carried_off(home: Path, tmp_path: Path) -> None:
    (tmp_path / "key").write_text("secret")
    (home / "a.png").unlink()
    (home / "a.png").symlink_to(tmp_path / "key")
    file = written(home / "t.json", [older()])
    with pytest.raises(
        ShareGptError, match=r"cannot be read \(first: item 0 .*no picture of a for"
    ):
        open_sharegpt(file)
    (home / "a.png").unlink()
    picture(home / "a.png", "red")
    imported(file, tmp_path / "out")
    (one,) = (tmp_path / "out").rglob("*.png")
    one.unlink()
    one.symlink_to(tmp_path / "key")
    for name in ("sharegpt", "trl", "verl"):
        with pytest.raises(ValueError, match="no picture of a format"):
            export(Collection.open(tmp_path / "out"), name, tmp_path / "again")
        assert not (tmp_path / "again").exists()


@pytest.mark.parametrize("field", ["id", "task_type", "scene", "kind", "object", "path"])
def test_no_name_leads_an_export_out_of_its_folder(field: str, home: Path, tmp_path: Path) -> None:
    """benchmarks.checks.foreign_files tries more names and formats."""
    outside = tmp_path / "outside"
    several = talk("x", ["a.png", "b.png", "c.png"])
    several["conversations"][0]["value"] = "<image><image><image>Look."
    top = tmp_path / "in"
    imported(written(home / "t.json", [several]), top / "out")
    (one,) = Collection.open(top / "out").trajectories()
    one = one.model_copy(update={"scene": "FloorPlan1"})
    kept = contents(home)
    for name in ("../../../outside", str(outside), "..\\x"):
        odd = with_name(one, field, name)
        Collection.open(top / "out").write([odd, one.model_copy(update={"id": "one"})])
        before = contents(tmp_path)
        for form in ("paper", "ms-swift"):
            out = top / "to"
            if field == "path":
                with pytest.raises(ValueError, match=r"\A[^\n]+outside the collection[^\n]+\Z"):
                    export(Collection.open(top / "out"), form, out)
            else:
                summary = export(Collection.open(top / "out"), form, out)
                left_out = field == "scene" and form == "paper"
                assert summary.pictures == len([*out.rglob("*.png")]) == (3 if left_out else 6)
                shutil.rmtree(out)
            assert contents(tmp_path) == before, (field, name, form)
    assert contents(home) == kept


def with_name(one: Trajectory, field: str, name: str) -> Trajectory:
    """A trajectory with a field that becomes a path."""
    turn = one.turns[0]
    if field == "object":
        turn = turn.model_copy(update={"object_id": f"Mug|{name}"})
    elif field == "path":
        shown = turn.pictures[0].model_copy(update={"path": name})
        turn = turn.model_copy(update={"pictures": [shown, *turn.pictures[1:]]})
    else:
        return one.model_copy(update={field: name})
    return one.model_copy(update={"turns": [turn, *one.turns[1:]]})


def test_two_conversations_of_one_id_are_printed_for_other_programs(
    home: Path, tmp_path: Path
) -> None:
    from agents.finetune.launchers.sources import SourceJob, open_source
    from agents.finetune.settings import DataSettings

    file = written(home / "t.json", [talk("x", "a.png"), talk("x", "b.png"), talk("x-2", "c.png")])
    before = contents(home)
    job = SourceJob.of(
        open_source(file, DataSettings()), tmp_path / "out", per_turn=False, copy=False
    )
    EXPORTS.get("ms-swift").write(job)
    rows = [
        json.loads(line) for line in (tmp_path / "out" / "train.jsonl").read_text().splitlines()
    ]
    shown = [(tmp_path / "out" / row["images"][0]).read_bytes() for row in rows]
    assert shown == [(home / f"{name}.png").read_bytes() for name in "abc"]
    assert contents(home) == before


@pytest.mark.parametrize(
    ("sample", "where"),
    [
        ({"image": "a.png"}, "a.png"),
        ({"image": ["a.png"], "images": []}, "a.png"),
        ({"image": "a.png", "images": ["a.png", "b.png"]}, "a.png"),
        ({"images": [{"path": "a.png", "bytes": None}]}, "a.png"),
        ({"images": ["shots\\one\\a.png"]}, "shots/one/a.png"),
        ({"images": ["one/a.png"]}, "shots/one/a.png"),
        ({"images": ["/home/else/data/shots/one/a.png"]}, "shots/one/a.png"),
        ({"images": ["C:\\data\\shots\\one\\a.png"]}, "shots/one/a.png"),
        ({"images": ["shots/one/a.png"]}, "../shots/one/a.png"),
        ({"images": ["shots/one/a.png"]}, "../../../shots/one/a.png"),
    ],
)
def test_sharegpt_files_of_elsewhere_are_read(
    sample: dict[str, Any], where: str, tmp_path: Path
) -> None:
    folder = tmp_path / "1" / "2" / "3" / "4"
    folder.mkdir(parents=True)
    expected = picture(folder / where, "red")
    told = {key: value for key, value in older().items() if key != "images"}
    (found,) = imported(written(folder / "t.json", [{**told, **sample}]), tmp_path / "out")
    placed = tmp_path / "out" / found.turns[0].pictures[0].path
    assert placed.read_bytes() == expected.read_bytes()


def test_messages_in_parts_and_speakers_by_other_names(home: Path, tmp_path: Path) -> None:
    look = [{"type": "image", "image": "a.png"}, {"type": "text", "text": "Look."}]
    said = [{"role": "human", "content": look}, {"role": "gpt", "content": END}]
    (found,) = imported(written(home / "t.json", [{"conversations": said}]), tmp_path / "out")
    assert found.turns[0].pictures[0].width == 32


def test_a_picture_never_takes_the_place_of_another(home: Path) -> None:
    """Only one beginning of paths is left out, for the whole file."""
    picture(home / "0.png", "red")
    file = written(home / "t.json", [talk("x", "/one/0.png"), talk("y", "/two/0.png")])
    opened = open_sharegpt(file, leave_out=True)
    assert [chat.id for chat in opened] == ["x"]
    assert opened.places.lines() == [f"pictures are looked up in {home} without '/one/'"]
    assert "'/two/0.png' is not in" in opened.report.first["missing picture"][0]


def test_the_cause_of_each_sample_that_is_left_out_is_named(home: Path, tmp_path: Path) -> None:
    (home / "bad.png").write_bytes(b"%!PS-Adobe-3.0 EPSF-3.0\n")
    bad: list[dict[str, Any]] = [talk("good", "a.png")]
    bad += [talk(f"gone-{number}", "gone.png") for number in range(4)]
    bad += [
        talk("eps", "bad.png"), talk("net", "https://x.example/a.png"),
        talk("url", "data:image/png;base64," + "a/b" * 9000),
        talk("other", "a.png", "pictures"), talk("bytes", [{"bytes": "aGk="}]),
    ]  # fmt: skip
    arguments = ["import", str(written(home / "t.json", bad)), "--leave-out"]
    result = CliRunner().invoke(data, [*arguments, "--out", str(tmp_path / "out")])
    assert result.exit_code == 0, result.output
    assert f"9 samples are left out; {tmp_path / 'out' / LEFT_OUT} names each" in result.output
    _, *lines = (tmp_path / "out" / LEFT_OUT).read_text().splitlines()
    told = {row["id"]: " ".join(row["why"].values()) for row in map(json.loads, lines)}
    assert len(told) == 9
    for name, words in {
        "gone-3": "'gone.png' is not in", "eps": "no picture of a format that er-gym reads",
        "net": "is an address, not a file", "url": "is a picture in the file itself",
        "bytes": "'images' is no list of paths",
        "other": "1 places, 0 pictures: nothing in 'images' or 'image'; the sample has 'pictures'",
    }.items():  # fmt: skip
        assert words in told[name]


def data_import(*words: object) -> tuple[int, str]:
    result = CliRunner().invoke(data, ["import", *map(str, words)])
    return result.exit_code, " ".join(result.output.split())


@pytest.mark.parametrize(
    ("item", "words"),
    [
        ('{"id": "\\ud800", "conversations": []}', "half a character"),
        ('{"id": 123456789012345678901234567890}', "a whole number of 30 digits"),
        ('{"a": 1e999}', "is too large"),
        ("{'a': 1}", "not JSON"),
        ("null", "null, not an object"),
        ("7", "a number, not an object"),
        ('"x"', "a text, not an object"),
        ("[1]", "a list, not an object"),
    ],
)
def test_one_item_that_cannot_be_read_does_not_spoil_the_others(
    item: str, words: str, home: Path, tmp_path: Path
) -> None:
    good = json.dumps(talk("good", "a.png"))
    for number, text in enumerate(
        (f"[{good}, {item}]", f"[{item}, {good}]", f"{good}\n{item}\n", f"{good}\n{item}\n{good}")
    ):
        (home / "t.json").write_text(text)
        out = tmp_path / str(number)
        code, told = data_import(home / "t.json", "--out", out)
        assert (code, out.exists()) == (2, False)
        assert f"1 are laid out otherwise (first: item {int(number != 1)} (line" in told
        assert words in told
        code, told = data_import(home / "t.json", "--out", out, "--leave-out")
        assert code == 0, told
        assert "1 samples are left out" in told
        assert words in (out / LEFT_OUT).read_text()
        assert next(Collection.open(out).trajectories()).id == "good"


def test_the_dataset_that_is_named_is_taken(home: Path, tmp_path: Path) -> None:
    both = {**talk("x", ["a.png"]), "thumbs": ["b.png"]}
    file = written(home / "train.json", [both])
    entry = {**INFO["mine"], "file_name": "train.json"}
    small = {**entry, "columns": {"messages": "conversations", "images": "thumbs"}}
    other = {**entry, "file_name": "other.json"}
    info = written(
        home / "dataset_info.json", {"full": entry, "small": small, "other": other, "odd": 3}
    )
    for name, picture_name in (("full", "a.png"), ("small", "b.png")):
        for place in (file, home, info):
            out = tmp_path / f"{name}-{place.name}"
            (one,) = imported(place, out, dataset=name)
            placed = out / one.turns[0].pictures[0].path
            assert placed.read_bytes() == (home / picture_name).read_bytes()
    for name in ("nope", "other"):
        code, told = data_import(file, "--dataset", name, "--out", tmp_path / "y")
        assert code == 2
        assert f"has the datasets full, small for train.json; there is no '{name}'" in told
    code, told = data_import(file, "--out", tmp_path / "y")
    assert code == 2
    assert "full, small for train.json, which name its parts differently; name one" in told
    written(info, {"full": entry, "again": dict(entry)})
    (one,) = imported(file, tmp_path / "z")
    info.unlink()
    code, told = data_import(file, "--dataset", "full", "--out", tmp_path / "y")
    assert code == 2
    assert "has no dataset_info.json beside it, so no dataset 'full'" in told


@pytest.mark.parametrize("form", ["png", "jpeg"])
def test_a_picture_that_is_cut_off_is_not_carried_off(
    form: str, home: Path, tmp_path: Path
) -> None:
    Image.effect_noise((64, 64), 90).convert("RGB").save(home / "cut", form)
    whole = (home / "cut").read_bytes()
    (home / "cut").write_bytes(whole[: len(whole) * 2 // 3])
    file = written(home / "t.json", [talk("x", "a.png"), talk("y", "cut"), talk("z", "a.png")])
    code, told = data_import(file, "--out", tmp_path / "out")
    assert (code, (tmp_path / "out").exists()) == (2, False)
    assert f"item 1 (line 1): {home / 'cut'}: a damaged picture: " in told
    code, told = data_import(file, "--out", tmp_path / "out", "--leave-out")
    assert code == 0, told
    assert [each.id for each in Collection.open(tmp_path / "out").trajectories()] == ["x", "z"]
    assert "a damaged picture" in (tmp_path / "out" / LEFT_OUT).read_text()


def test_each_picture_is_decoded_once(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[str] = []
    monkeypatch.setattr(
        "er_gym.data.sharegpt_report.check_picture", lambda picture: seen.append(picture.name)
    )
    file = written(home / "t.json", [talk("x", "a.png"), talk("y", "b.png"), talk("z", "a.png")])
    assert len(open_sharegpt(file, decode=True)) == 3
    assert seen == ["a.png", "b.png"]


def test_the_output_may_be_the_working_directory_or_a_link(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = written(home / "t.json", [talk("x", "a.png")])
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to("real")
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    made = os.stat(".").st_ino
    assert data_import(file, "--out", ".")[0] == 0
    assert os.stat(tmp_path / "here").st_ino == made  # it is still the shell's
    assert data_import(file, "--out", tmp_path / "link")[0] == 0
    for place in ("here", "link"):
        names = {each.name for each in (tmp_path / place).iterdir()}
        assert names == {"collection.json", "trajectories.jsonl", "pictures"}
    assert (tmp_path / "link").is_symlink()
    (tmp_path / "real2").mkdir()
    (tmp_path / "link2").symlink_to("real2")
    export(Collection.open(Path()), "trl", tmp_path / "link2")
    assert (tmp_path / "real2" / "README.md").is_file()


def test_an_output_that_cannot_be_is_told_before_anything_is_read(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "lost").symlink_to("nowhere")
    for name, words in (
        ("lost", "is there already and is no folder"),
        ("file/x", f"{tmp_path / 'file'} is no folder"),
        (".", "is not empty"),
    ):
        code, told = data_import(tmp_path / "none.json", "--out", tmp_path / name)
        assert code == 2
        assert words in told


@pytest.mark.parametrize(
    ("loss", "learnt"),
    [(True, True), (1, True), (None, True), (False, False), (0, False), ("no", None), ([], None)],
)
def test_a_loss_is_true_or_false(
    loss: object, learnt: bool | None, home: Path, tmp_path: Path
) -> None:
    one = talk("x", "a.png")
    one["conversations"][1]["loss"] = loss
    file = written(home / "t.json", [one])
    if learnt is None:
        with pytest.raises(ShareGptError, match=r"message 1 has the loss .*; give true or false"):
            open_sharegpt(file)
    else:
        (chat,) = open_sharegpt(file)
        assert chat.turns[-1].train is learnt


# -- every field of every file as every type -------------------------------------------------------

INFO = {
    "mine": {
        "file_name": "t.json",
        "formatting": "sharegpt",
        "columns": {"messages": "conversations", "images": "images", "system": "system"},
        "tags": {"role_tag": "from", "content_tag": "value", "user_tag": "human"},
    }
}
PARTS = {
    "messages": [
        {"role": "user", "content": [{"type": "image", "image": {"url": "a.png"}}]},
        {"role": "assistant", "content": [{"type": "text", "text": END}], "loss": True},
    ]
}


@pytest.mark.parametrize(
    "valid", [older(), talk("x", "a.png", "image"), PARTS, INFO], ids=["old", "id", "parts", "info"]
)
def test_every_field_may_be_anything(valid: Any, home: Path, tmp_path: Path) -> None:
    tried = read = 0
    before = contents(home)
    for changed in mutations(copy.deepcopy(valid)):
        tried += 1
        folder = tmp_path / "fuzz"
        folder.mkdir(exist_ok=True)
        if not (folder / "a.png").exists():
            picture(folder / "a.png", "red")
        if valid is INFO:
            written(folder / "dataset_info.json", changed)
            written(folder / "t.json", [older()])
            opening = folder
        else:
            opening = written(folder / "t.json", [changed, older()])
        out = tmp_path / "out" / str(tried)
        try:
            opened = open_sharegpt(opening, decisions=True, leave_out=tried % 2 == 0)
            import_sharegpt(opened, out)
            read += len([*Collection.open(out).trajectories()])
        except ValueError as error:  # the command tells these in one line
            told = str(error)
            assert ("\n" in told, len(told) > 1500, out.exists()) == (False,) * 3, told
    assert tried > 150
    assert read > 10
    assert contents(home) == before
    assert {each.name for each in tmp_path.iterdir()} <= {"home", "fuzz", "out"}
    assert not [*(tmp_path / "out").glob(".*")]


def test_a_dataset_info_of_another_shape_is_a_line(home: Path) -> None:
    written(home / "t.json", [older()])
    for table, words in (
        ({"columns": ["messages"]}, "the columns of the dataset 'mine' are ['messages']; give an"),
        ({"columns": {"images": {}}}, "columns.images of the dataset 'mine' is {}; give a name"),
        ({"tags": 3}, "the tags of the dataset 'mine' are 3; give an object"),
        ({"columns": None}, "1 places, 0 pictures: dataset_info.json names no column of pictures"),
    ):
        written(home / "dataset_info.json", {"mine": {**INFO["mine"], **table}})
        with pytest.raises(ShareGptError) as error:
            open_sharegpt(home)
        assert words in str(error.value)
    written(home / "t.json", [{"messages": [{"role": {}, "content": "x"}]}])
    (home / "dataset_info.json").unlink()
    with pytest.raises(ShareGptError, match=r"message 0 has the unknown role \{\}"):
        open_sharegpt(home / "t.json")
