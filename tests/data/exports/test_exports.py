"""Every format holds what the collection holds, in the form that its library publishes."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from agents.vlm.paper_prompts import read_prompts
from agents.vlm.prompt_set import IMAGE_MARK, LastAction, TurnContext
from agents.vlm.templates import directory_of, load_templates
from er_gym.data.chat import IMAGE
from er_gym.data.collection import Collection
from er_gym.data.exports import ExportError, ExportOptions, ExportSummary, export
from er_gym.data.exports.base import room
from er_gym.data.exports.export import EXPORTS, _readme
from er_gym.data.picture_folder import PicturesElsewhere
from er_gym.data.trajectory import Trajectory
from er_gym.tasks import verbs

CHATS = ("sharegpt", "ms-swift", "trl", "trl-turns", "verl", "hf")
OPTIONS = ExportOptions(dialect="paper", held_out=0.25)

Exported = Callable[..., tuple[Path, ExportSummary]]


@pytest.fixture(scope="module")
def exported(collection: Collection, tmp_path_factory: pytest.TempPathFactory) -> Exported:
    """The collection in a format, with a quarter of the rooms held out."""
    made: dict[str, tuple[Path, ExportSummary]] = {}

    def of(format: str) -> tuple[Path, ExportSummary]:
        if format in ("verl", "hf"):
            pytest.importorskip("pyarrow", reason="needs the extra data")
            pytest.importorskip("datasets", reason="needs the extra data")
        if format not in made:
            out = tmp_path_factory.mktemp("exports") / format
            made[format] = out, export(collection, format, out, OPTIONS)
        return made[format]

    return of


@pytest.fixture(scope="module")
def trajectories(collection: Collection) -> list[Trajectory]:
    return list(collection.trajectories())


def json_lines(path: Path) -> list[dict[str, Any]]:
    with path.open(encoding="utf-8") as file:
        return [json.loads(line) for line in file]


def rows(out: Path, format: str) -> dict[str, list[dict[str, Any]]]:
    """All rows of an export by the name of their file or split."""
    if format in ("verl", "hf"):
        import pyarrow.parquet as pq

        found: dict[str, list[dict[str, Any]]] = {}
        for file in sorted(out.rglob("*.parquet")):
            found.setdefault(file.name.rpartition("-")[0], []).extend(
                pq.read_table(file).to_pylist()
            )
        return found
    if format.startswith("trl"):
        return {file.parent.name: json_lines(file) for file in out.glob("*/metadata.jsonl")}
    return {file.stem: json_lines(file) for file in out.glob("*.jsonl")}


def messages(row: dict[str, Any]) -> list[dict[str, Any]]:
    return row["messages"] if "messages" in row else [*row["prompt"], *row["completion"]]


def text(message: dict[str, Any]) -> str:
    """A message's content with ``<image>`` for each picture."""
    content = message["content"]
    if isinstance(content, str):
        return content
    return "".join(IMAGE if part["type"] == "image" else part["text"] for part in content)


def pictures(row: dict[str, Any]) -> list[Any]:
    return row["images_file_names"] if "images_file_names" in row else row["images"]


def every_row(out: Path, format: str) -> Iterator[tuple[str, dict[str, Any]]]:
    for name, found in rows(out, format).items():
        yield from ((name, row) for row in found)


@pytest.mark.parametrize("format", CHATS)
def test_pictures_places_and_counts_agree(exported: Exported, format: str) -> None:
    out, summary = exported(format)
    shown, files = 0, set()
    for name, row in every_row(out, format):
        said = [text(message) for message in messages(row)]
        assert sum(each.count(IMAGE) for each in said) == len(pictures(row))
        assert not any(IMAGE in each for each in said[2::2])  # the assistant shows none
        shown += len(pictures(row))
        for picture in pictures(row):
            if isinstance(picture, str):
                file = out / (name if format.startswith("trl") else "") / picture
                assert file.read_bytes()[:3] == b"\xff\xd8\xff"
                files.add(file)
            else:
                assert picture["bytes"][:3] == b"\xff\xd8\xff"
    assert shown == summary.shown
    counts = {name: len(found) for name, found in rows(out, format).items()}
    assert counts == summary.samples
    if files:
        assert len(files) == summary.pictures == len(list(out.rglob("*.jpeg")))


@pytest.mark.parametrize("format", CHATS)
def test_system_then_user_and_assistant_in_turn(exported: Exported, format: str) -> None:
    out, _ = exported(format)
    for _, row in every_row(out, format):
        roles = [message["role"] for message in messages(row)]
        assert roles[0] == "system"
        assert roles[1:] == ["user", "assistant"] * (len(roles) // 2)


@pytest.mark.parametrize("format", CHATS)
def test_rooms_are_in_one_split_only(
    exported: Exported, trajectories: list[Trajectory], format: str
) -> None:
    out, summary = exported(format)
    of = {each.id: room(each.scene) for each in trajectories}
    found: dict[str, set[str]] = {"train": set(), "validation": set()}
    for name, row in every_row(out, format):
        found[name.removesuffix("_turns")].add(of[row["id"]])
    assert found["train"].isdisjoint(found["validation"])
    assert found["train"] | found["validation"] == set(of.values())
    assert len(found["validation"]) == round(len(set(of.values())) / 4)
    held_out = json.loads((out / "export.json").read_text())["held_out"]
    assert set(held_out) == found["validation"]
    assert summary.trajectories == len(trajectories)
    assert summary.turns == sum(each.actions for each in trajectories)


def test_sharegpt_is_what_llama_factory_reads(
    exported: Exported, trajectories: list[Trajectory]
) -> None:
    out, _ = exported("sharegpt")
    info = json.loads((out / "dataset_info.json").read_text())
    found = rows(out, "sharegpt")
    assert set(info) == {f"er_gym_{name}" for name in found}
    for entry in info.values():
        assert entry["formatting"] == "sharegpt"
        assert (out / entry["file_name"]).is_file()
        row = json_lines(out / entry["file_name"])[0]
        assert set(entry["columns"].values()) <= set(row)
        tags = entry["tags"]
        assert {each[tags["role_tag"]] for each in row["messages"]} == {
            tags["system_tag"],
            tags["user_tag"],
            tags["assistant_tag"],
        }
    by_id = {each.id: each for each in trajectories}
    for name, row in every_row(out, "sharegpt"):
        whole = all(turn.train for turn in by_id[row["id"]].turns)
        assert name.endswith("_turns") != whole
    # Each turn that is learnt is the last of exactly one sample, or in a whole one.
    for each in trajectories:
        lasts = [
            len(row["messages"]) // 2 - 1
            for name, row in every_row(out, "sharegpt")
            if row["id"] == each.id and name.endswith("_turns")
        ]
        learnt = [index for index, turn in enumerate(each.turns) if turn.train]
        assert lasts == ([] if len(learnt) == each.actions else learnt)
    assert '"<|feedback|>":' in (out / "special_tokens.yaml").read_text()


def test_sharegpt_per_turn_has_one_kind_of_samples(collection: Collection, tmp_path: Path) -> None:
    summary = export(collection, "sharegpt", tmp_path / "out", ExportOptions(per_turn=True))
    assert summary.samples == {"train_turns": summary.trained_turns}


def test_ms_swift_flags_each_turn_of_the_assistant(
    exported: Exported, trajectories: list[Trajectory]
) -> None:
    out, _ = exported("ms-swift")
    by_id = {each.id: each for each in trajectories}
    for _, row in every_row(out, "ms-swift"):
        flags = [each["loss"] for each in row["messages"] if each["role"] == "assistant"]
        assert flags == [turn.train for turn in by_id[row["id"]].turns]
        assert all("loss" not in each for each in row["messages"] if each["role"] != "assistant")


def test_verl_keeps_only_turns_to_learn_as_the_assistants(
    exported: Exported, trajectories: list[Trajectory]
) -> None:
    out, _ = exported("verl")
    by_id = {each.id: each for each in trajectories}
    for _, row in every_row(out, "verl"):
        replies = [text(each) for each in row["messages"] if each["role"] == "assistant"]
        actions = [str(turn.action) for turn in by_id[row["id"]].turns if turn.train]
        assert [each.partition("<DecisionMaking>")[2] for each in replies] == [
            f"{action}</DecisionMaking>" for action in actions
        ]


@pytest.mark.parametrize("format", ["trl", "trl-turns", "hf"])
def test_datasets_loads_pictures_and_messages(
    exported: Exported, format: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    datasets = pytest.importorskip("datasets", reason="needs the extra data")
    out, summary = exported(format)
    arguments = (str(out),) if format == "hf" else ("imagefolder",)
    more = {} if format == "hf" else {"data_dir": str(out)}
    loaded = datasets.load_dataset(*arguments, **more, cache_dir=str(tmp_path))
    assert {name: len(split) for name, split in loaded.items()} == summary.samples
    for split in loaded.values():
        for row in split:
            assert all(picture.size == (128, 72) for picture in row["images"])
            blocks = [part for message in messages(row) for part in message["content"]]
            assert [part["type"] for part in blocks].count("image") == len(row["images"])
    if format == "hf":
        row = loaded["train"][0]
        assert len(row["actions"]) == len(row["train"]) == len(row["rewards"])
        assert loaded["train"].features["images"].feature == datasets.Image()
        assert (out / "README.md").read_text().startswith("---\n")


def test_the_readme_speaks_of_the_splits_that_there_are(
    collection: Collection, tmp_path: Path
) -> None:
    export(collection, "trl", tmp_path / "all", ExportOptions(dialect="paper"))
    told = (tmp_path / "all" / "README.md").read_text()
    assert told.count("validation") == 1
    assert "There is no split `validation`" in told
    for row in EXPORTS.own.values():
        for samples in ({"train": 3}, {"train": 3, "validation": 2}):
            summary = ExportSummary(row.name, 5, {}, samples, 9, 9, 9, 9, 9, PicturesElsewhere())
            text = _readme(row, summary, OPTIONS, collection)
            assert "[[" not in text
            assert "]]" not in text
            loading = text.partition("## How to load it")[2]
            assert ("validation" in loading) == ("validation" in samples), row.name


def test_prompts_are_read_off_what_is_written(
    collection: Collection, tmp_path: Path, trajectories: list[Trajectory]
) -> None:
    out = tmp_path / "out"
    export(
        collection, "sharegpt", out, ExportOptions(dialect="paper", language="en", per_turn=True)
    )
    fallback = load_templates(directory_of("default", "en"))
    prompts = read_prompts(out / "train_turns.jsonl", fallback)
    by_id = {each.id: each for each in trajectories}
    checked = set()
    for _, row in every_row(out, "sharegpt"):
        turns = by_id[row["id"]].turns
        said = [each["content"] for each in row["messages"]]
        assert prompts.system(decide="tags", sees="pictures") == said[0]
        turn = TurnContext(task=by_id[row["id"]].instruction, decide="tags", sees="pictures")
        assert prompts.first(turn).replace(IMAGE_MARK, IMAGE) == said[1]
        for place, last in enumerate(turns[: len(said) // 2 - 1]):
            if last.verb in (verbs.OBSERVE, *verbs.OBJECT_VERBS):
                told = LastAction(
                    action=str(last.action),
                    success=last.success,
                    feedback=last.feedback,
                    pictures=len(turns[place + 1].pictures),
                )
                asked = prompts.next(turn, told).replace(IMAGE_MARK, IMAGE)
                assert asked == said[2 * place + 3]
                checked.add((last.verb, last.success))
    assert len(checked) > 5
    assert prompts.after_observe == 3


def test_the_same_bytes_again_and_links_or_copies(
    collection: Collection, exported: Exported, tmp_path: Path
) -> None:
    out, summary = exported("ms-swift")
    again = export(
        collection, "ms-swift", tmp_path / "again", ExportOptions("paper", held_out=0.25, copy=True)
    )
    assert summary.linked == summary.pictures == again.pictures
    assert again.linked == 0
    for file in (each for each in out.rglob("*") if each.is_file()):
        other = tmp_path / "again" / file.relative_to(out)
        if file.name not in ("export.json",):
            assert other.read_bytes() == file.read_bytes()
        if file.suffix == ".jpeg":
            assert os.stat(file).st_nlink > 1
            assert os.stat(other).st_nlink == 1


def test_nothing_is_left_where_an_export_fails(
    collection: Collection, trajectories: list[Trajectory], tmp_path: Path
) -> None:
    broken = trajectories[-1].model_copy(deep=True)
    broken.turns[0].pictures[0] = broken.turns[0].pictures[0].model_copy(update={"path": "../no"})
    other = Collection.create(tmp_path / "other", collection.manifest)
    (other.path / "parts").symlink_to(collection.path / "parts")
    other.write([*trajectories[:3], broken])
    for format in ("sharegpt", "ms-swift", "trl", "trl-turns", "paper"):
        with pytest.raises(ExportError, match=r"outside the collection: '../no'"):
            export(other, format, tmp_path / "out")
        assert sorted(path.name for path in tmp_path.iterdir()) == ["other"]


def test_what_cannot_be_exported_is_said_in_one_line(
    collection: Collection, trajectories: list[Trajectory], tmp_path: Path
) -> None:
    full = tmp_path / "full"
    full.mkdir()
    (full / "mine.txt").write_text("mine")
    file = tmp_path / "file"
    file.write_text("mine")
    empty = Collection.create(tmp_path / "empty", collection.manifest)
    empty.write([])
    silent = Collection.create(tmp_path / "silent", collection.manifest)
    off = [turn.model_copy(update={"train": False}) for turn in trajectories[0].turns]
    silent.write([trajectories[0].model_copy(update={"turns": off})])
    one = Collection.create(tmp_path / "one", collection.manifest)
    one.write(trajectories[:1])
    out = tmp_path / "out"
    cases: list[tuple[Collection, str, Path, ExportOptions, str]] = [
        (collection, "csv", out, ExportOptions(), "choose one of: sharegpt, ms-swift, trl"),
        (collection, "trl", full, ExportOptions(), "is not empty"),
        (collection, "trl", file, ExportOptions(), "is no folder"),
        (collection, "trl", out, ExportOptions(dialect="x"), "choose one of: paper, sight, tags"),
        (collection, "trl", out, ExportOptions(held_out=("Attic",)), "no room 'Attic'"),
        (collection, "trl", out, ExportOptions(held_out=1.5), "give 0 to less than 1"),
        (collection, "trl", out, ExportOptions(held_out=float("nan")), "give 0 to less than 1"),
        (empty, "trl", out, ExportOptions(), "has no trajectories"),
        (silent, "trl", out, ExportOptions(), "no turn is to be learnt: 1"),
        (one, "trl", out, ExportOptions(held_out=0.5), "none would be left"),
    ]
    for given, format, to, options, problem in cases:
        with pytest.raises(ValueError, match=problem) as raised:
            export(given, format, to, options)
        assert "\n" not in str(raised.value)
        assert not out.exists()
    assert (full / "mine.txt").read_text() == file.read_text() == "mine"


def test_progress_and_named_rooms(
    collection: Collection, trajectories: list[Trajectory], tmp_path: Path
) -> None:
    told: list[tuple[int, int]] = []
    out = tmp_path / "out"
    out.mkdir()  # an empty folder will do
    options = ExportOptions(held_out=(trajectories[0].scene, "evaluation"))
    summary = export(collection, "trl", out, options, lambda *done: told.append(done))
    count = len(trajectories)
    assert told == [(number, count) for number in range(1, count + 1)]
    assert summary.samples == {"train": count - 1, "validation": 1}


def test_a_format_of_another_package(collection: Collection, tmp_path: Path) -> None:
    summary = export(collection, "er_gym.data.exports.ms_swift:MS_SWIFT", tmp_path / "out")
    assert summary.format == "ms-swift"
