"""Directories of models and adapters: old ones, broken ones, and what tells them apart."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from support import one_torch_thread

pytest.importorskip("torch", reason="needs the extra local")
pytest.importorskip("transformers", reason="needs the extra local")

import torch
from local_clients import (
    LONG,
    Clients,
    Models,
    at_once,
    conversations,
    edited,
    picture,
    same,
    settings,
    user,
)

from agents.vlm.clients.local import LocalClient
from er_gym.rollout.agent import CannotGoOn


@pytest.fixture(scope="module", autouse=True)
def one_thread() -> Iterator[None]:
    with one_torch_thread():
        yield


# -- what was saved years ago ----------------------------------------------------------------------


def as_of_2024(directory: Path) -> None:
    """Lay a checkpoint out as transformers 4 did, and as most that can be had still are."""
    from safetensors.torch import load_file, save_file

    config = json.loads((directory / "config.json").read_text())
    words = config.pop("text_config")
    rope = words.pop("rope_parameters")
    words["rope_theta"] = rope["rope_theta"]
    words["rope_scaling"] = {"type": "mrope", "mrope_section": rope["mrope_section"]}
    del words["dtype"]
    config |= words | {"model_type": config["model_type"], "torch_dtype": config.pop("dtype")}
    (directory / "config.json").write_text(json.dumps(config))

    file = directory / "model.safetensors"
    save_file({old_name(name): each for name, each in load_file(file).items()}, file)

    template = directory / "chat_template.jinja"
    (directory / "chat_template.json").write_text(
        json.dumps({"chat_template": template.read_text()})
    )
    template.unlink()


def old_name(name: str) -> str:
    """Of a weight; that of an adapter begins with what peft puts before it."""
    return name.replace("model.language_model.", "model.").replace("model.visual.", "visual.")


@pytest.mark.parametrize("family", ["qwen2_vl", "qwen2_5_vl"])
def test_a_checkpoint_of_2024_says_the_same(
    models: Models, tmp_path: Path, client: Clients, family: str
) -> None:
    old = edited(models, tmp_path / "old", as_of_2024, family)
    talks = conversations(family)
    new = client(family)
    assert "text_config" not in json.loads((old / "config.json").read_text())
    assert same([client(old).reply(t, 0) for t in talks], [new.reply(t, 0) for t in talks])


# -- what goes wrong -------------------------------------------------------------------------------


def without_a_weight(directory: Path) -> None:
    from safetensors.torch import load_file, save_file

    weights = load_file(directory / "model.safetensors")
    del weights["lm_head.weight"]
    save_file(weights, directory / "model.safetensors", {"format": "pt"})


def with_other_eyes(directory: Path) -> None:
    file = directory / "preprocessor_config.json"
    file.write_text(json.dumps({"image_processor_type": "CLIPImageProcessor"}))


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda d: (d / "config.json").unlink(), "cannot be loaded: "),
        (lambda d: (d / "model.safetensors").unlink(), "cannot be loaded: OSError"),
        (lambda d: (d / "model.safetensors").write_bytes(b"?" * 99), "cannot be loaded: "),
        (lambda d: (d / "tokenizer.json").unlink(), "cannot be loaded: "),
        (lambda d: (d / "preprocessor_config.json").unlink(), "cannot be loaded: "),
        (lambda d: (d / "chat_template.jinja").unlink(), "has no chat template"),
        (with_other_eyes, "does not process pictures as Qwen's models do (CLIPImageProcessorPil)"),
        (without_a_weight, "1 of its weights are missing, such as lm_head.weight"),
    ],
)
def test_a_broken_model(
    models: Models, tmp_path: Path, edit: Callable[[Path], object], message: str
) -> None:
    path = edited(models, tmp_path / "broken", edit)
    with pytest.raises(ValueError, match=re.escape(message)) as caught:
        LocalClient(str(path), settings())
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"decide": "tools"}, "decide: tools needs a server"),
        ({"local": {"dtype": "float33"}}, "cannot be loaded: "),
        ({"local": {"attention": "none at all"}}, "cannot be loaded: "),
        ({"local": {"device_map": "cuda:77"}}, "cannot be loaded: "),
        ({"local": {"adapter": "nowhere"}}, "local.adapter nowhere is not an adapter"),
    ],
)
def test_settings_that_do_not_fit(models: Models, changes: dict[str, Any], message: str) -> None:
    if "adapter" in changes.get("local", {}):
        pytest.importorskip("peft")
    with pytest.raises(ValueError, match=re.escape(message)) as caught:
        LocalClient(str(models("qwen2_5_vl")), settings(**changes))
    assert "\n" not in str(caught.value)


def test_a_model_without_vision_refuses_pictures(models: Models, client: Clients) -> None:
    with pytest.raises(ValueError, match="has no vision; set the agent's setting sees to text"):
        LocalClient(str(models("qwen2")), settings())
    for family in ("qwen2", "qwen2_5_vl"):
        with pytest.raises(CannotGoOn, match="without vision"):
            client(family, sees="text").reply([user(picture(56, 56))], 0)


@pytest.mark.parametrize("path", ["/nowhere/at/all", "./nowhere", "a/b/c"])
def test_a_directory_that_is_not_there(path: str) -> None:
    with pytest.raises(ValueError, match=f"there is no directory {path}; give one with a model"):
        LocalClient(path, settings())


# -- identity and adapters -------------------------------------------------------------------------


def test_identity(models: Models, client: Clients, tmp_path: Path) -> None:
    mine = client().identity
    assert json.loads(mine)["dtype"] == "torch.float32"
    assert client(local={"batch": 3, "wait": 1.0}).identity == mine
    others = [
        client(seed=1).identity,
        client(sampling={"max_tokens": 17}).identity,
        client(pictures={"max_pixels": 100_000}).identity,
        client(local={"dtype": "bfloat16"}).identity,
        client("qwen2_vl").identity,
    ]
    copy = edited(models, tmp_path / "copy", lambda directory: None)
    others.append(client(copy).identity)
    (copy / "generation_config.json").touch()
    others.append(client(copy).identity)
    assert len({mine, *others}) == 1 + len(others)


def adapter(base: Path, to: Path) -> Path:
    """A LoRA adapter that is not without effect."""
    import peft
    from transformers import AutoModelForImageTextToText

    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(0)
        model = AutoModelForImageTextToText.from_pretrained(base)
        config = peft.LoraConfig(
            r=4,
            target_modules=["q_proj", "v_proj"],
            init_lora_weights=False,
            task_type="CAUSAL_LM",
        )
        peft.get_peft_model(model, config).save_pretrained(to)
    return to


def test_an_adapter_changes_what_is_said(models: Models, client: Clients, tmp_path: Path) -> None:
    pytest.importorskip("peft", reason="adapters need peft")
    path = adapter(models("qwen2_5_vl"), tmp_path / "adapter")
    talks = conversations("qwen2_5_vl")
    plain = client(local={"batch": 1})
    tuned = client(local={"batch": 1, "adapter": str(path)})
    assert tuned.identity != plain.identity
    replies = [tuned.reply(talk, 0) for talk in talks]
    for talk, reply in zip(talks, replies, strict=True):
        assert plain.reply(talk, 0).text != reply.text
    together = client(local={"batch": 4, "wait": LONG, "adapter": str(path)})
    assert same(at_once(together, talks), replies)


def test_an_adapters_directory_is_a_model(models: Models, client: Clients, tmp_path: Path) -> None:
    pytest.importorskip("peft", reason="adapters need peft")
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "finetune.json").write_text("{}")
    path = adapter(models("qwen2_5_vl"), tmp_path / "run" / "model")
    talk = conversations("qwen2_5_vl")[2]
    said = [client(local={"adapter": str(path)}).reply(talk, 0)]
    assert same([client(path).reply(talk, 0)], said)
    assert same([client(tmp_path / "run").reply(talk, 0)], said)


def test_an_adapter_of_2024_says_the_same(models: Models, client: Clients, tmp_path: Path) -> None:
    pytest.importorskip("peft", reason="adapters need peft")
    from safetensors.torch import load_file, save_file

    path = adapter(models("qwen2_5_vl"), tmp_path / "adapter")
    talk = conversations("qwen2_5_vl")[2]
    said = [client(local={"adapter": str(path)}).reply(talk, 0)]
    file = path / "adapter_model.safetensors"
    weights = load_file(file)
    save_file({old_name(name): each for name, each in weights.items()}, file)
    assert set(load_file(file)).isdisjoint(weights)
    assert same([client(local={"adapter": str(path)}).reply(talk, 0)], said)


def test_an_adapter_that_does_not_fit(models: Models, tmp_path: Path) -> None:
    pytest.importorskip("peft", reason="adapters need peft")
    from safetensors.torch import load_file, save_file

    path = adapter(models("qwen2_5_vl"), tmp_path / "adapter")
    file = path / "adapter_model.safetensors"
    weights = load_file(file)
    name = next(iter(weights))
    cases = {
        "size": weights | {name: torch.zeros(4, 99)},
        "absent": {each: weight for each, weight in weights.items() if each != name},
    }
    for case, changed in cases.items():
        save_file(changed, file)
        with pytest.raises(ValueError, match="does not fit the model: ") as caught:
            LocalClient(str(models("qwen2_5_vl")), settings(local={"adapter": str(path)}))
        assert "\n" not in str(caught.value), case
    config = json.loads((path / "adapter_config.json").read_text())
    (path / "adapter_config.json").write_text(json.dumps(config | {"target_modules": ["no_proj"]}))
    with pytest.raises(ValueError, match=r"does not fit the model: .*no_proj"):
        LocalClient(str(models("qwen2_5_vl")), settings(local={"adapter": str(path)}))
