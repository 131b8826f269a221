"""Whole runs with tiny models: the loss, what is learnt, and going on after a kill."""

from __future__ import annotations

import json
import multiprocessing
import os
import shutil
import signal
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
import safetensors.torch
import torch
import transformers
import yaml
from click.testing import CliRunner
from test_tokens import by_hand

from agents.finetune import loop, run_files
from agents.finetune import train as training
from agents.finetune.model_files import open_model
from agents.finetune.run_files import FINETUNING, FinetuneManifest, RunFiles
from agents.finetune.samples import open_samples
from agents.finetune.settings import STAGES, FinetuneSettings, load_settings
from agents.finetune.tokens import FEEDBACK, Encoder
from agents.finetune.train import Result, train
from agents.vlm.clients.checkpoint import Checkpoint, load
from agents.vlm.settings import AgentSettings
from benchmarks.cli.errors import BadInput
from benchmarks.cli.main import cli
from er_gym.data.chat import Chat
from er_gym.data.collection import Collection

QUICK = (
    "data.parts=[]", "data.min_pixels=784", "data.max_pixels=4704", "training.batch=8",
    "training.checkpointing=false", "training.log_every=1", "training.learning_rate=0.01",
)  # fmt: skip
LORA = ("model.lora.rank=16", "model.lora.alpha=32")


@pytest.fixture
def settings(dialect: str) -> Callable[..., FinetuneSettings]:
    def make(*more: str, config: str = "stage1") -> FinetuneSettings:
        return load_settings(config, (*QUICK, f"data.dialect={dialect}", *more))

    return make


def weights(folder: Path) -> dict[str, torch.Tensor]:
    [file] = folder.glob("*.safetensors")
    found: dict[str, torch.Tensor] = safetensors.torch.load_file(file)
    return found


# -- the loss --------------------------------------------------------------------------------------


@pytest.mark.parametrize("extra", [(), ("training.batch=3", "training.accumulation=3")])
def test_the_loss_is_the_cross_entropy_of_the_turns_that_are_learnt(
    extra: Sequence[str],
    models: Any, played: Collection, chats: tuple[Chat, ...], settings: Any, tmp_path: Path,
) -> None:  # fmt: skip
    """Each conversation by itself, unpadded, with mask and new token put together by hand."""
    made = settings("training.epochs=1", "model.dtype=float32", *extra)
    train(made, models(), [played.path], tmp_path / "run")
    [first] = RunFiles(tmp_path / "run").metrics()

    files = open_model(models())
    tokenizer = files.tokenizer
    tokenizer.add_tokens(FEEDBACK, special_tokens=True)
    image_token = files.config.image_token_id
    encoder = Encoder(tokenizer, files.template, files.image_processor, image_token, made.data)
    model = transformers.AutoModelForImageTextToText.from_pretrained(models())
    rows = model.get_input_embeddings().weight.shape[0]
    model.resize_token_embeddings(rows + 1, mean_resizing=False)
    like = tokenizer("feedback: the last action failed")["input_ids"]
    with torch.no_grad():
        for layer in (model.get_input_embeddings(), model.get_output_embeddings()):
            layer.weight[tokenizer.convert_tokens_to_ids(FEEDBACK)] = layer.weight[like].mean(0)
    total, count = 0.0, 0
    for chat in chats:
        short, learnt = by_hand(encoder, chat, chat.train)
        opened = [training_image(played.path / each.path) for each in chat.pictures]
        seen = files.image_processor(
            opened, size={"shortest_edge": 784, "longest_edge": 4704}, return_tensors="pt"
        )
        counts = iter((seen["image_grid_thw"].prod(dim=1) // 4).tolist())
        ids, wanted = [], []
        for token, flag in zip(short, learnt, strict=True):
            times = next(counts) if token == image_token else 1
            ids += [token] * times
            wanted += [flag] * times
        tokens = torch.tensor([ids])
        with torch.no_grad():
            scores = model(
                input_ids=tokens, attention_mask=torch.ones_like(tokens), **seen,
                mm_token_type_ids=tokens.eq(image_token).int(),
            ).logits[0]  # fmt: skip
        chances = scores.log_softmax(dim=1)
        for place, flag in enumerate(wanted):
            if flag:
                total -= chances[place - 1, ids[place]].item()
                count += 1
    assert first["loss"] == pytest.approx(total / count, abs=2e-5)


def training_image(path: Path) -> Any:
    from PIL import Image

    return Image.open(path).convert("RGB")


# -- what is learnt --------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["full", "lora"])
def test_trajectories_are_learnt_by_heart(
    kind: str, models: Any, played: Collection, blind: Collection, settings: Any, tmp_path: Path
) -> None:
    """In full with pictures, multiplied in bfloat16; and with LoRA without pictures."""
    family, data = ("qwen2_5_vl", played) if kind == "full" else ("qwen2", blind)
    more = LORA if kind == "lora" else ("model.dtype=bfloat16",)
    steps = ("data.limit=4", "training.epochs=32", "training.batch=2", "training.log_every=8")
    result = train(settings(*steps, *more), models(family), [data.path], tmp_path / "run")
    assert result.updates == 64
    assert result.first_loss > 2
    assert result.loss < 0.2
    before, after = weights(models(family)), weights(result.path / "model")
    if kind == "full":  # the eyes are as they were, and all else has learnt
        same = {
            name for name in before if torch.equal(before[name], after[name][: len(before[name])])
        }
        assert same == {name for name in before if "visual" in name}
        assert {weight.dtype for weight in after.values()} == {torch.float32}
        eyes = transformers.AutoImageProcessor.from_pretrained(result.path / "model", backend="pil")
        assert (eyes.size["shortest_edge"], eyes.size["longest_edge"]) == (784, 4704)
    else:
        assert {name.split(".")[-2] for name in after if "lora" in name} == {"lora_A", "lora_B"}


# -- going on after a kill -------------------------------------------------------------------------

DROPPING = (*LORA, "model.lora.dropout=0.2", "training.epochs=4", "training.batch=3",
            "training.save_every=3")  # fmt: skip


def killed(run: Callable[[], Result], place: str, at: int) -> None:
    """Run in another process, which kills itself when it comes to a place the n-th time."""

    def child() -> None:
        # PyTorch makes its threads anew after a fork. Where two threads ask for them first (as
        # transformers' loaders do), one may find none: "Invalid thread pool!".
        torch.set_num_threads(torch.get_num_threads())
        seen = iter(range(1, 1_000))

        def counted(call: Any) -> Any:
            def counting(*args: Any, **kwargs: Any) -> Any:
                if next(seen) == at:
                    os.kill(os.getpid(), signal.SIGKILL)
                return call(*args, **kwargs)

            return counting

        if place == "checkpoint":  # written, and not yet in its place
            loop.move_into_place = counted(run_files.move_into_place)  # type: ignore[assignment]
        elif place == "update":
            loop.mean_loss = counted(loop.mean_loss)  # type: ignore[assignment]
        else:  # all is learnt, the result half written
            loop.write_agent_files = counted(loop.write_agent_files)  # type: ignore[assignment]
        run()

    process = multiprocessing.get_context("fork").Process(target=child)
    process.start()
    process.join(120)
    assert process.exitcode == -signal.SIGKILL


def test_after_kills_it_goes_on_as_if_nothing_had_been(
    models: Any, blind: Collection, settings: Any, tmp_path: Path
) -> None:
    made, model = settings(*DROPPING), models("qwen2")
    whole, run = RunFiles(tmp_path / "whole"), RunFiles(tmp_path / "killed")

    def again() -> Result:
        return train(made, model, [blind.path], run.path)

    train(made, model, [blind.path], whole.path)
    assert [line["update"] for line in whole.metrics()] == list(range(1, 13))

    killed(again, "update", 2)  # before the first checkpoint
    assert run.last_checkpoint() is None
    killed(again, "checkpoint", 2)  # while the second is written
    assert run.last_checkpoint() == run.checkpoints / "checkpoint-3"
    assert [each.name for each in run.checkpoints.glob(".*")] == [".new.draft"]
    killed(again, "update", 5)  # update 8 of the run; checkpoint-6 is there
    assert [line["update"] for line in run.metrics()] == list(range(1, 8))
    killed(again, "result", 1)
    assert not run.finished
    result = again()

    same = ("update", "epoch", "loss", "learning_rate", "gradient_norm")
    curves = [[[line[name] for name in same] for line in each.metrics()] for each in (whole, run)]
    assert curves[0] == curves[1]
    one, other = weights(whole.model), weights(run.model)
    assert one.keys() == other.keys()
    assert all(torch.equal(one[name], other[name]) for name in one)
    assert result.new
    assert not list(run.path.rglob(".*draft*"))
    assert sorted(each.name for each in run.checkpoints.iterdir()) == [
        "checkpoint-12", "checkpoint-9",
    ]  # fmt: skip
    assert not again().new


@pytest.mark.parametrize("optimizer", ["adamw", "muon"])
def test_full_fine_tuning_goes_on_too(
    optimizer: str, models: Any, played: Collection, settings: Any, tmp_path: Path
) -> None:
    """With pictures: transformers' own checkpoints of Qwen2.5-VL would not be read again."""
    made = settings(
        "training.epochs=2",
        "training.batch=4",
        "training.save_every=2",
        f"training.optimizer={optimizer}",
    )
    whole, run = RunFiles(tmp_path / "whole"), RunFiles(tmp_path / "killed")
    train(made, models(), [played.path], whole.path)
    killed(lambda: train(made, models(), [played.path], run.path), "update", 3)
    train(made, models(), [played.path], run.path)
    curves = [[line["loss"] for line in each.metrics()] for each in (whole, run)]
    assert curves[0] == curves[1]
    one, other = weights(whole.model), weights(run.model)
    assert all(torch.equal(one[name], other[name]) for name in one)


# -- <|feedback|>, adapters and stages -------------------------------------------------------------


def test_adapters_carry_feedback_from_stage_to_stage(
    models: Any, blind: Collection, settings: Any, tmp_path: Path
) -> None:
    """LoRA on LoRA on a model without spare rows, and full on both. A stage begins with the very
    model that is played after the one before."""
    model, more = models("qwen2"), ("training.epochs=4", "training.learning_rate=0.002")
    fresh = transformers.AutoModelForCausalLM.from_pretrained(model).get_input_embeddings().weight
    like = open_model(model).tokenizer("feedback: the last action failed")["input_ids"]
    row, loss = fresh[like].mean(dim=0), 100.0
    stages = (("stage1", LORA), ("stage2", LORA), ("stage3", ()))
    for number, (config, how) in enumerate(stages, 1):
        made = settings(*more, *how, "data.parts=[]", "model.dtype=float32", config=config)
        result = train(made, model, [blind.path], tmp_path / config)
        assert number == 1 or result.first_loss == pytest.approx(loss, rel=1e-5)
        assert result.loss < result.first_loss
        model = result.path  # the next begins with this run

        folder = result.path / "model"
        assert open_model(folder).history.stages == STAGES[:number]
        told = yaml.safe_load((folder / "agent.yaml").read_text())
        prompts = {"dialect": made.data.dialect, "language": "en"}
        assert told == {"prompts": prompts, "sees": "text"}
        played = loaded(folder)
        [token] = played.tokenizer(FEEDBACK)["input_ids"]
        now = played.model.get_input_embeddings()(torch.tensor(token))
        assert 0 < (now - row).abs().max() < 0.2
        row, loss = now, loss_of(played, open_model(folder).template, blind, made)


def loaded(folder: Path) -> Checkpoint:
    """A model as the agent loads it."""
    local = {"dtype": "float32", "device_map": "cpu"}
    return load(str(folder), AgentSettings.model_validate({"sees": "text", "local": local}))


@torch.no_grad()
def loss_of(played: Checkpoint, template: str, data: Collection, made: FinetuneSettings) -> float:
    """The loss of a text-only model on all conversations, one by one."""
    encoder = Encoder(played.tokenizer, template, None, None, made.data)
    total, count = 0.0, 0
    for chat in open_samples([data.path], made.data).chats:
        encoded = encoder.encode(chat)
        ids = torch.tensor(encoded.ids[None].astype("int64"))
        chances = played.model(input_ids=ids).logits[0].log_softmax(dim=1)
        places = encoded.learnt.nonzero()[0]
        total -= chances[places - 1, ids[0, places]].sum().item()
        count += len(places)
    return total / count


def test_feedback_takes_a_row_that_is_free(
    models: Any, blind: Collection, settings: Any, tmp_path: Path
) -> None:
    model = models("qwen2", 5)
    before = weights(model)["model.embed_tokens.weight"]
    train(settings("training.epochs=1"), model, [blind.path], tmp_path / "run")
    files = open_model(tmp_path / "run")
    token = files.tokenizer.convert_tokens_to_ids(FEEDBACK)
    assert token == len(before) - 5
    assert weights(files.path)["model.embed_tokens.weight"].shape == before.shape


# -- bad input -------------------------------------------------------------------------------------


def test_bad_input_is_told_in_a_line(
    models: Any, played: Collection, dialect: str, tmp_path: Path
) -> None:
    def copy(name: str, without: str = "", **files: str) -> Path:
        shutil.copytree(models(), tmp_path / name)
        if without:
            (tmp_path / name / without).unlink()
        for file, text in files.items():
            (tmp_path / name / file.replace("__", ".")).write_text(text, encoding="utf-8")
        return tmp_path / name

    blind_model = copy("blind", "preprocessor_config.json")
    untold = copy("untold", "chat_template.jinja")
    spoken = copy("spoken", agent__yaml="prompts: {dialect: tags, language: en}\n")
    (tmp_path / "unfinished").mkdir()
    (tmp_path / "unfinished/finetune.json").write_text("{}")
    (tmp_path / "taken").mkdir()
    (tmp_path / "taken/letter.txt").write_text("Dear …")
    out = tmp_path / "out"

    for option, value, wanted in (
        ("--model", "nowhere", "nowhere is not a directory"),
        ("--model", tmp_path, "has no config.json"),
        ("--model", blind_model, "has no image processor that can be loaded"),
        ("--model", untold, "has no chat template"),
        ("--model", tmp_path / "unfinished", "is a fine-tuning run that is not finished"),
        ("--model", spoken, "was taught with dialect tags, and the data is in dialect"),
        ("--model", models("qwen2"), "no vision: give one that has, or a data.dialect without"),
        ("--data", "nowhere", "nowhere does not exist"),
        ("--data", models(), "holds neither a collection"),
        (
            "--set",
            "data.parts=[imitation]",
            "no trajectories of the part imitation; it has: mixed",
        ),
        ("--set", "data.kinds=[z]", "no trajectories of the kind z; it has: "),
        ("--set", "data.dialect=pirate", "there is no dialect 'pirate'"),
        ("--set", "data.max_length=100", "data.max_length 100, and 7 others are too long; set"),
        ("--set", "model.lora.targets=[elbow]", "model.lora does not fit the model"),
        ("--config", "stage2", "this stage comes after imitation, and"),
        ("--config", "stage9", "there is no fine-tuning run 'stage9'"),
        ("--out", tmp_path / "taken", "is not empty and holds no finetune.json"),
    ):
        given = {"--config": "stage1", "--model": models(), "--data": played.path, "--out": out}
        words = [f"{word}" for pair in (given | {option: value}).items() for word in pair]
        quick = [f"--set={each}" for each in (*QUICK, f"data.dialect={dialect}")]
        last = [option, str(value)] if option == "--set" else []
        result = CliRunner().invoke(cli, ["finetune", *quick, *words, *last], standalone_mode=False)
        assert isinstance(result.exception, BadInput), (value, result.output, result.exception)
        assert wanted in result.exception.message, (value, result.exception.message)
        assert "\n" not in result.exception.message
        assert not out.exists()


def test_memory_that_is_not_there_is_told_before_loading(
    models: Any, blind: Collection, settings: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("agents.finetune.machine.free_memory", lambda: 1 << 20)
    made = settings("training.epochs=1")
    with monkeypatch.context() as patch:
        patch.setattr(training, "load_network", None)
        with pytest.raises(ValueError, match=r"take about .* GiB .* 1 MiB of memory are free; set"):
            train(made, models("qwen2"), [blind.path], tmp_path / "run")
    assert not (tmp_path / "run").exists()
    train(made, models("qwen2"), [blind.path], tmp_path / "run", ignore_memory=True)
    with pytest.raises(
        ValueError, match=r"another fine-tuning run: its training.epochs is 1.0, th"
    ):
        train(settings("training.epochs=2"), models("qwen2"), [blind.path], tmp_path / "run")
    limited = settings("training.epochs=1", "data.limit=3")
    with pytest.raises(
        ValueError, match=r"its data.limit is not given, this one's 3 .*: data_digest\)"
    ):
        train(limited, models("qwen2"), [blind.path], tmp_path / "run")
    assert (
        json.loads((tmp_path / "run/finetune.json").read_text())["settings"]["data"]["limit"]
        is None
    )


def test_a_path_may_change_where_the_content_is_the_same() -> None:
    """And what a version before did not write, such as a setting that is None."""
    told = {
        "settings": {"data": {"limit": None}, "model": {}}, "model": "/m", "model_digest": "1",
        "data": ["/d"], "data_digest": "2", "er_gym": "0",
    }  # fmt: skip
    there = FinetuneManifest.model_validate(told)

    def same(**changes: Any) -> bool:
        here = FinetuneManifest.model_validate({**told, **changes})
        one, other = FINETUNING.compared(there, here)
        return one == other

    assert same(model="/elsewhere", data=["/x"], er_gym="1")
    assert same(settings={"data": {}, "model": {"new": None}})
    assert not same(settings={"data": {"limit": 3}, "model": {}})
    assert not same(model_digest="3")
    assert not same(data_digest="3")
