"""The printed files: arguments that each program's parser knows, data with the right turns learnt.

``trainer_arguments.json`` was taken down from the parsers themselves by ``take_down_arguments.py``.
"""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
import yaml
from click.testing import CliRunner

sys.path.append(str(Path(__file__).parents[2]))  # for the helpers beside the tests

from played_collection import make_collection

import agents.finetune.launchers.trl as trl_files
from agents.finetune.launchers import PROGRAMS, write_files
from agents.finetune.launchers.sources import open_source, released
from agents.finetune.models import model_names
from agents.finetune.settings import FinetuneSettings, load_settings
from benchmarks.cli.finetune import PRINTABLE, finetune
from er_gym.data.chat import Chat, ChatTurn
from er_gym.data.collection import Collection
from er_gym.data.sharegpt_files import open_sharegpt

KNOWN = json.loads(Path(__file__).with_name("trainer_arguments.json").read_text())
YAML = {"llama-factory": "train.yaml", "ms-swift": "train.yaml", "trl": "sft.yaml"}


@pytest.fixture(scope="module")
def collection(tmp_path_factory: pytest.TempPathFactory) -> Collection:
    """Two conversations: one with a turn that is not learnt and ``<|feedback|>``, one without."""
    folder = tmp_path_factory.mktemp("collection") / "played"
    return make_collection(folder, parts=["mixed"], width=128, height=72)


def settings_of(config: str, *overrides: str) -> FinetuneSettings:
    return load_settings(config, ["data.parts=[]", *overrides])


def printed(
    program: str, config: str, collection: Collection, out: Path, model: str = "qwen2-vl-7b"
) -> dict[str, Any]:
    write_files(program, settings_of(config), model, collection.path, out)
    read = yaml.safe_load((out / YAML[program]).read_text())
    assert isinstance(read, dict)
    return read


def json_lines(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def misfits(arguments: Mapping[str, Any], known: Mapping[str, str]) -> list[str]:
    """Which arguments a parser would refuse."""
    types: dict[str, tuple[type, ...]] = {
        "int": (int,),
        "float": (int, float),
        "bool": (bool,),
        "dict": (dict,),
    }
    found = []
    for name, value in arguments.items():
        told = known.get(name)
        if told is None:
            found.append(f"{name} is unknown")
            continue
        inner = told.removeprefix("list of ")
        for each in value if isinstance(value, list) else [value]:
            if each is None or inner in ("str", "<lambda>"):
                continue
            fits = (
                isinstance(each, types[inner]) and (inner == "bool" or not isinstance(each, bool))
                if inner in types
                else str(each) in inner.split("|")
            )
            if not fits:
                found.append(f"{name} is {told}, not {each!r}")
    return found


@pytest.mark.parametrize("config", ["stage1", "stage3-lora"])
@pytest.mark.parametrize("program", YAML)
def test_the_parser_knows_every_argument(
    program: str, config: str, collection: Collection, tmp_path: Path
) -> None:
    arguments = printed(program, config, collection, tmp_path / "out", "qwen2.5-vl-3b")
    known = dict(KNOWN[program]["arguments"])
    if program == "ms-swift":
        assert set(arguments.pop("ENV")) == {"ROOT_IMAGE_DIR", "MIN_PIXELS", "MAX_PIXELS"}
    if program == "trl":
        tree = ast.parse((tmp_path / "out" / "train.py").read_text())
        own = next(node for node in tree.body if getattr(node, "name", "") == "RunArguments")
        assert isinstance(own, ast.ClassDef)
        known |= {each.target.id: "str" for each in own.body if isinstance(each, ast.AnnAssign)}  # type: ignore[union-attr]
    assert not misfits(arguments, known)
    assert misfits({"learning_rate": "1e-5", "image_resolution": 1}, known)


def test_the_values_are_the_papers(collection: Collection, tmp_path: Path) -> None:
    full = printed("llama-factory", "stage1", collection, tmp_path / "full")
    assert full == full | {
        "model_name_or_path": "Qwen/Qwen2-VL-7B-Instruct",
        "template": "qwen2_vl",
        "finetuning_type": "full",
        "freeze_vision_tower": True,
        "freeze_multi_modal_projector": True,
        "learning_rate": 1e-5,
        "num_train_epochs": 1.0,
        "per_device_train_batch_size": 1,
        "gradient_accumulation_steps": 1,
        "lr_scheduler_type": "cosine",
        "warmup_ratio": 0.1,
        "bf16": True,
        "cutoff_len": 32_768,
        "image_max_pixels": 180_000,
        "save_steps": 500,
        "logging_steps": 2,
        "deepspeed": "zero3.json",
    }
    zero = json.loads((tmp_path / "full" / "zero3.json").read_text())
    assert zero["zero_optimization"]["stage"] == 3
    lora = printed("ms-swift", "stage1-lora", collection, tmp_path / "lora", "qwen3-vl-4b")
    assert lora == lora | {
        "model": "Qwen/Qwen3-VL-4B-Instruct",
        "model_type": "qwen3_vl",
        "tuner_type": "lora",
        "lora_rank": 8,
        "lora_alpha": 16,
        "target_modules": ["all-linear"],
        "num_train_epochs": 3.0,
        "max_length": 16_384,
        "new_special_tokens": ["<|feedback|>"],
    }
    assert "deepspeed" not in lora
    assert lora["ENV"]["MAX_PIXELS"] == "262144"


def test_only_the_turns_to_learn_get_loss(collection: Collection, tmp_path: Path) -> None:
    trajectories = {each.id: each for each in collection.trajectories()}
    trained = {name: [turn.train for turn in each.turns] for name, each in trajectories.items()}
    assert not all(flag for flags in trained.values() for flag in flags)
    arguments = printed("llama-factory", "stage3", collection, tmp_path / "lf")
    assert arguments["mask_history"] is True
    assert arguments["dataset"] == "er_gym_train_turns"
    data = tmp_path / "lf" / "data"
    assert set(json.loads((data / "dataset_info.json").read_text())) == {"er_gym_train_turns"}
    samples = json_lines(data / "train_turns.jsonl")
    assert len(samples) == sum(flag for flags in trained.values() for flag in flags)
    for sample in samples:
        replies = sum(message["role"] == "assistant" for message in sample["messages"])
        assert trained[sample["id"]][replies - 1]
        assert all((data / path).is_file() for path in sample["images"])

    printed("ms-swift", "stage3", collection, tmp_path / "swift")
    for row in json_lines(tmp_path / "swift" / "data" / "train.jsonl"):
        flags = [each["loss"] for each in row["messages"] if each["role"] == "assistant"]
        assert flags == trained[row["id"]]
    printed("trl", "stage3", collection, tmp_path / "trl")
    for row in json_lines(tmp_path / "trl" / "data" / "train" / "metadata.jsonl"):
        assert row["train"] == trained[row["id"]]
    assert (tmp_path / "trl" / "train.py").read_text() == trl_files._SOURCE.read_text()


def test_the_released_mask_learns_what_follows_the_first_feedback() -> None:
    def chat(*users: str) -> Chat:
        turns = [
            turn
            for text in users
            for turn in (ChatTurn("user", (text,)), ChatTurn("assistant", ("ok",), True))
        ]
        return Chat("c", tuple(turns))

    assert released(chat("a", "b")).train == (True, True)
    assert released(chat("a", "<|feedback|>b", "c")).train == (False, True, True)


def test_our_own_trainer_on_many_gpus(collection: Collection, tmp_path: Path) -> None:
    out = tmp_path / "out"
    files = write_files(
        "deepspeed", settings_of("stage2"), "qwen2-vl-2b=/weights", collection.path, out, gpus=4
    )
    read = load_settings(str(out / "finetune.yaml"))
    assert read.training.deepspeed == "zero3.json"
    assert read.model_copy(update={"training": settings_of("stage2").training}) == settings_of(
        "stage2"
    )
    assert [each.turns for each in Collection.open(out / "data").trajectories()] == [
        each.turns for each in collection.trajectories()
    ]
    script = out / "train.sh"
    assert script in files
    assert "--nproc_per_node 4 -m benchmarks.cli finetune" in script.read_text()
    assert "--model /weights --data data" in script.read_text()
    subprocess.run(["bash", "-n", str(script)], check=True)


def test_data_of_others_prints_the_same(collection: Collection, tmp_path: Path) -> None:
    printed("ms-swift", "stage1", collection, tmp_path / "first")
    theirs = tmp_path / "first" / "data" / "train.jsonl"
    write_files("ms-swift", settings_of("stage1"), "qwen2-vl-7b", theirs, tmp_path / "again")
    again = json_lines(tmp_path / "again" / "data" / "train.jsonl")
    assert again == json_lines(theirs)
    chats = list(open_source(theirs, settings_of("stage1").data).chats())
    assert [chat.train for chat in chats] == [chat.train for chat in open_sharegpt(theirs)]


def test_the_readme_tells_the_memory_of_every_model(collection: Collection, tmp_path: Path) -> None:
    printed("llama-factory", "stage1-lora", collection, tmp_path / "out")
    text = (tmp_path / "out" / "README.md").read_text()
    rows = {line.split("|")[1].strip(): line for line in text.splitlines() if "|" in line}
    assert set(model_names()) <= set(rows)
    full = [float(cell) for cell in rows["qwen2-vl-7b"].split("|")[2:6]]
    assert full == sorted(full, reverse=True)
    assert 100 < full[0] < 200  # at least 16 bytes for each of 7.6 billion
    assert "becomes the token 151657" in text


@pytest.mark.parametrize(
    ("program", "model", "overrides", "words"),
    [
        ("axolotl", "qwen2-vl-7b", (), "there is no program 'axolotl'; choose of llama-factory"),
        ("trl", "qwen9", (), "there is no model 'qwen9'"),
        ("trl", "qwen2-vl-7b", ("data.max_length=300",), "more than data.max_length 300; set"),
        ("trl", "qwen2-vl-7b", ("data.parts=[corrections]",), "no trajectories of the part"),
        ("deepspeed", "qwen2-vl-7b", ("training.optimizer=muon",), "deepspeed cannot learn with t"),
        ("trl", "qwen2-vl-7b", ("data.mask=all",), "trl cannot learn with data.mask=all; set"),
    ],
)
def test_bad_input_is_told_in_one_line(
    program: str,
    model: str,
    overrides: tuple[str, ...],
    words: str,
    collection: Collection,
    tmp_path: Path,
) -> None:
    with pytest.raises(ValueError, match=r"\A[^\n]+\Z") as error:
        write_files(
            program, settings_of("stage1", *overrides), model, collection.path, tmp_path / "out"
        )
    assert words in str(error.value)
    assert not list(tmp_path.iterdir())


def test_the_command(collection: Collection, tmp_path: Path) -> None:
    assert tuple(PROGRAMS) == PRINTABLE
    given = ["--print", "trl", "--config", "stage1", "--set", "data.parts=[]", "--model"]
    rest = ["--data", str(collection.path), "--out", str(tmp_path / "out")]
    result = CliRunner().invoke(finetune, [*given, "qwen3-vl-2b", *rest])
    assert result.exit_code == 0, result.output
    names = [Path(line).name for line in result.output.splitlines()]
    assert names == ["README.md", "sft.yaml", "train.py", "train.sh", "zero3.json"]
    again = CliRunner().invoke(finetune, [*given, "qwen3-vl-2b", *rest])
    assert "is not empty; choose another output" in again.output
