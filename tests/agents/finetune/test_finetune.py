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

from agents.finetune import run_files
from agents.finetune import train as training
from agents.finetune.model_files import open_model
from agents.finetune.run_files import RunFiles
from agents.finetune.settings import FinetuneSettings, load_settings
from agents.finetune.tokens import FEEDBACK, Encoder
from agents.finetune.train import Result, train
from agents.vlm.clients.checkpoint import load
from agents.vlm.settings import AgentSettings
from benchmarks.cli.main import cli
from er_gym.data.chat import Chat
from er_gym.data.collection import Collection

QUICK = (
    "data.parts=[]", "data.min_pixels=784", "data.max_pixels=4704", "training.batch=8",
    "training.checkpointing=false", "training.log_every=1", "training.learning_rate=0.01",
)  # fmt: skip
LORA = ("model.lora.rank=8", "model.lora.alpha=16")


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
    made = settings("training.epochs=1", *extra)
    train(made, models(), played.path, tmp_path / "run")
    [first] = RunFiles(tmp_path / "run").metrics()

    files = open_model(models())
    tokenizer = files.tokenizer
    tokenizer.add_special_tokens(
        {"additional_special_tokens": [FEEDBACK]}, replace_additional_special_tokens=False
    )
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


def say_again(model: Any, encoder: Encoder, chats: Sequence[Chat], files: Any, folder: Path) -> int:
    """How many learnt turns the model says word for word."""
    from agents.finetune.batches import Collator
    from agents.finetune.settings import DataSettings

    token = getattr(files.config, "image_token_id", None)
    bounds = DataSettings(min_pixels=784, max_pixels=4_704)
    collate = Collator(folder, files.image_processor, token, bounds, 0)
    right = 0
    for chat in chats:
        batch = collate([encoder.encode(chat)])
        labels = batch.pop("labels")[0]
        batch.pop("tokens")
        with torch.no_grad():
            best = model(**batch).logits[0].argmax(dim=1)
        for place in range(1, len(labels)):
            right += bool(labels[place] != -100 and best[place - 1] != labels[place])
    return right


@pytest.mark.parametrize("kind", ["full", "lora"])
def test_eight_trajectories_are_learnt_by_heart(
    kind: str, models: Any, played: Collection, chats: tuple[Chat, ...], settings: Any,
    tmp_path: Path,
) -> None:  # fmt: skip
    more = LORA if kind == "lora" else ()
    made = settings("training.epochs=60", "training.log_every=20", *more)
    result = train(made, models(), played.path, tmp_path / "run")
    print(result)
    assert result.first_loss > 2 > 0.05 > result.loss


# -- going on after a kill -------------------------------------------------------------------------

DROPPING = (*LORA, "model.lora.dropout=0.2", "training.epochs=4", "training.batch=3",
            "training.save_every=3")  # fmt: skip


def killed(run: Callable[[], Result], place: str, at: int) -> None:
    """Run in another process, which kills itself when it comes to a place the n-th time."""

    def child() -> None:
        seen = iter(range(1, 1_000))

        def counted(call: Any) -> Any:
            def counting(*args: Any, **kwargs: Any) -> Any:
                if next(seen) == at:
                    os.kill(os.getpid(), signal.SIGKILL)
                return call(*args, **kwargs)

            return counting

        if place == "checkpoint":  # written, and not yet in its place
            training.move_into_place = counted(run_files.move_into_place)  # type: ignore[assignment]
        elif place == "update":
            training.mean_loss = counted(training.mean_loss)  # type: ignore[assignment]
        else:  # all is learnt, the result half written
            training.write_agent_files = counted(training.write_agent_files)  # type: ignore[assignment]
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
        return train(made, model, blind.path, run.path)

    train(made, model, blind.path, whole.path)
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


def test_full_fine_tuning_goes_on_too(
    models: Any, played: Collection, settings: Any, tmp_path: Path
) -> None:
    """With pictures: transformers' own checkpoints of Qwen2.5-VL would not be read again."""
    made = settings("training.epochs=2", "training.batch=4", "training.save_every=2")
    whole, run = RunFiles(tmp_path / "whole"), RunFiles(tmp_path / "killed")
    train(made, models(), played.path, whole.path)
    killed(lambda: train(made, models(), played.path, run.path), "update", 3)
    train(made, models(), played.path, run.path)
    curves = [[line["loss"] for line in each.metrics()] for each in (whole, run)]
    assert curves[0] == curves[1]
    one, other = weights(whole.model), weights(run.model)
    assert all(torch.equal(one[name], other[name]) for name in one)


# -- <|feedback|>, adapters and stages -------------------------------------------------------------


def test_adapters_carry_feedback_from_stage_to_stage(
    models: Any, blind: Collection, settings: Any, tmp_path: Path
) -> None:
    """LoRA on LoRA on a model without spare rows, and full on both; played models are the same."""
    more = ("training.epochs=3",)
    one = train(settings(*LORA, *more), models("qwen2"), blind.path, tmp_path / "1")
    second = settings(*LORA, *more, config="stage2")
    two = train(second, one.path, blind.path, tmp_path / "2")
    third = settings(*more, "training.log_every=100", config="stage3")
    three = train(third, two.path, blind.path, tmp_path / "3")
    assert one.first_loss > one.loss > two.first_loss > two.loss > three.first_loss > three.loss

    rows = {}
    for result, count in ((one, 1), (two, 2), (three, 3)):
        folder = result.path / "model"
        history = open_model(folder).history
        assert history.stages == ("imitation", "exploration", "reflection")[:count]
        local = {"dtype": "float32", "device_map": "cpu"}
        agent = AgentSettings.model_validate({"sees": "text", "local": local})
        checkpoint = load(str(folder), agent)
        token = checkpoint.tokenizer.convert_tokens_to_ids(FEEDBACK)
        assert checkpoint.tokenizer(FEEDBACK)["input_ids"] == [token]
        embedding = checkpoint.model.get_input_embeddings()
        rows[count] = embedding(torch.tensor([token]))
        told = yaml.safe_load((folder / "agent.yaml").read_text())
        assert told == {
            "prompts": {"dialect": second.data.dialect, "language": "en"},
            "sees": "text",
        }
    assert not torch.equal(rows[1], rows[2])
    assert not torch.equal(rows[2], rows[3])
    before = transformers.AutoModelForCausalLM.from_pretrained(models("qwen2"))
    fresh = before.get_input_embeddings().weight
    like = open_model(models("qwen2")).tokenizer("feedback: the last action failed")["input_ids"]
    assert not torch.equal(rows[1][0], fresh[like].mean(dim=0))
    assert torch.allclose(rows[1][0], fresh[like].mean(dim=0), atol=0.1)


def test_feedback_takes_a_row_that_is_free(
    models: Any, blind: Collection, settings: Any, tmp_path: Path
) -> None:
    model = models("qwen2", 5)
    before = weights(model)["model.embed_tokens.weight"]
    train(settings("training.epochs=1"), model, blind.path, tmp_path / "run")
    files = open_model(tmp_path / "run")
    token = files.tokenizer.convert_tokens_to_ids(FEEDBACK)
    assert token == len(before) - 5
    assert weights(files.path)["model.embed_tokens.weight"].shape == before.shape


# -- bad input -------------------------------------------------------------------------------------


def test_bad_input_is_told_in_a_line(
    models: Any, played: Collection, blind: Collection, dialect: str, tmp_path: Path
) -> None:
    def copy(name: str, without: str = "", **files: str) -> Path:
        shutil.copytree(models(), tmp_path / name)
        if without:
            (tmp_path / name / without).unlink()
        for file, text in files.items():
            (tmp_path / name / file.replace("__", ".")).write_text(text, encoding="utf-8")
        return tmp_path / name

    untold = copy("untold", "chat_template.jinja")
    spoken = copy("spoken", agent__yaml="prompts: {dialect: tags, language: en}\n")
    (tmp_path / "unfinished").mkdir()
    (tmp_path / "unfinished/finetune.json").write_text("{}")
    (tmp_path / "taken").mkdir()
    (tmp_path / "taken/letter.txt").write_text("Dear …")
    model, data, out = str(models()), str(played.path), str(tmp_path / "out")
    quick = tuple(word for each in QUICK for word in ("--set", each))
    ours = ("--set", f"data.dialect={dialect}")

    for name, given, wanted in (
        ("model", ["--model", "nowhere"], "nowhere is not a directory"),
        ("model", ["--model", str(tmp_path)], "has no config.json"),
        ("model", ["--model", str(copy("blind", "preprocessor_config.json"))], "has no image processor that can be loaded"),
        ("model", ["--model", str(untold)], "has no chat template"),
        ("model", ["--model", str(tmp_path / "unfinished")], "is a fine-tuning run that is not finished"),
        ("model", ["--model", str(spoken)], f"was taught with dialect tags, and the data is in dialect {dialect}"),
        ("data", ["--data", "nowhere"], "nowhere is not a collection"),
        ("data", ["--data", model], "is not a collection"),
        ("data", ["--set", "data.parts=[imitation]"], "has no trajectories of the part imitation; it has: played"),
        ("data", ["--set", "data.dialect=pirate"], "there is no dialect 'pirate'"),
        ("data", ["--set", "data.max_length=100"], "more than data.max_length 100, and 7 others are too long; set data.max_length="),
        ("stage", ["--config", "stage2"], "this stage comes after imitation, and"),
        ("config", ["--config", "stage9"], "there is no fine-tuning run 'stage9'"),
        ("out", ["--out", str(tmp_path / "taken")], "is not empty and holds no finetune.json"),
        ("memory", ["--set", "training.batch=8", "--set", "memory"], "is not an override"),
    ):  # fmt: skip
        base = {"--config": "stage1", "--model": model, "--data": data, "--out": out}
        base.update({} if given[0] == "--set" else {given[0]: given[1]})
        more = given if given[0] == "--set" else []
        words = [word for pair in base.items() for word in pair]
        result = CliRunner().invoke(cli, ["finetune", *words, *quick, *ours, *more])
        assert result.exit_code == 2, (name, given, result.output)
        assert wanted in result.output, (name, given, result.output)
        assert not (tmp_path / "out").exists()


def test_memory_that_is_not_there_is_told_before_loading(
    models: Any, blind: Collection, settings: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("agents.finetune.machine.free_memory", lambda: 1 << 20)
    made = settings("training.epochs=1")
    with monkeypatch.context() as patch:
        patch.setattr(training, "_load", None)
        with pytest.raises(ValueError, match=r"take about .* GiB .* 1 MiB of memory are free; set"):
            train(made, models("qwen2"), blind.path, tmp_path / "run")
    assert not (tmp_path / "run").exists()
    train(made, models("qwen2"), blind.path, tmp_path / "run", ignore_memory=True)
    with pytest.raises(ValueError, match=r"holds another run \(training.epochs was 1.0, now 2.0\)"):
        train(settings("training.epochs=2"), models("qwen2"), blind.path, tmp_path / "run")
    limited = settings("training.epochs=1", "data.limit=3")
    with pytest.raises(ValueError, match=r"data.limit was None, now 3, the data was .* other cont"):
        train(limited, models("qwen2"), blind.path, tmp_path / "run")
    assert (
        json.loads((tmp_path / "run/finetune.json").read_text())["settings"]["data"]["limit"]
        is None
    )
