"""Model directories made of GGUF files: their weights, their tokenizer, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch
import transformers
from click.testing import CliRunner

from agents.finetune.gguf_model import model_of_gguf
from agents.finetune.model_files import open_model
from benchmarks.cli.new_model import new_model

gguf = pytest.importorskip("gguf", reason="needs the extra gguf")

WIDE, HIDDEN, HEADS, KEYS = 16, 24, 2, 1
TEMPLATE = "{% for message in messages %}{{ message.role }}: {{ message.content }}<end>{% endfor %}"
LETTERS = [chr(code) for code in range(33, 127)] + ["Ġ", "Ċ"]


def write_gguf(file: Path, template: str = TEMPLATE) -> dict[str, np.ndarray]:
    """Write a llama of one layer with a tokenizer of single letters; return its tensors."""
    writer = gguf.GGUFWriter(file, "llama")
    writer.add_context_length(64)
    writer.add_embedding_length(WIDE)
    writer.add_block_count(1)
    writer.add_feed_forward_length(HIDDEN)
    writer.add_head_count(HEADS)
    writer.add_head_count_kv(KEYS)
    writer.add_layer_norm_rms_eps(1e-5)
    writer.add_rope_dimension_count(WIDE // HEADS)
    tokens = ["<end>", *LETTERS, "ab"]
    writer.add_tokenizer_model("gpt2")
    writer.add_token_list(tokens)
    writer.add_token_types([3, *[1] * (len(tokens) - 1)])
    writer.add_token_merges(["a b"])
    writer.add_bos_token_id(0)
    writer.add_eos_token_id(0)
    if template:
        writer.add_chat_template(template)
    random = np.random.default_rng(0)
    key = WIDE // HEADS * KEYS
    shapes = {
        "token_embd.weight": (len(tokens), WIDE), "output_norm.weight": (WIDE,),
        "blk.0.attn_norm.weight": (WIDE,), "blk.0.ffn_norm.weight": (WIDE,),
        "blk.0.attn_q.weight": (WIDE, WIDE), "blk.0.attn_k.weight": (key, WIDE),
        "blk.0.attn_v.weight": (key, WIDE), "blk.0.attn_output.weight": (WIDE, WIDE),
        "blk.0.ffn_gate.weight": (HIDDEN, WIDE), "blk.0.ffn_up.weight": (HIDDEN, WIDE),
        "blk.0.ffn_down.weight": (WIDE, HIDDEN),
    }  # fmt: skip
    tensors = {name: random.normal(size=shape).astype(np.float32) for name, shape in shapes.items()}
    for name, values in tensors.items():
        writer.add_tensor(name, values)
    writer.write_header_to_file()
    writer.write_kv_data_to_file()
    writer.write_tensors_to_file()
    writer.close()
    return tensors


def weights_of(directory: Path) -> dict[str, torch.Tensor]:
    return dict(transformers.AutoModelForCausalLM.from_pretrained(directory).state_dict())


def test_the_model_of_the_file_can_be_fine_tuned(tmp_path: Path) -> None:
    file = tmp_path / "tiny.gguf"
    tensors = write_gguf(file)
    out = model_of_gguf(file, tmp_path / "model")
    weights = weights_of(out)
    for theirs, ours in {
        "token_embd": "model.embed_tokens",
        "blk.0.attn_v": "model.layers.0.self_attn.v_proj",
        "blk.0.ffn_down": "model.layers.0.mlp.down_proj",
        "output_norm": "model.norm",
    }.items():
        np.testing.assert_array_equal(weights[f"{ours}.weight"], tensors[f"{theirs}.weight"])
    files = open_model(out)
    assert files.template == TEMPLATE
    assert files.tokenizer.tokenize("abc a") == ["ab", "c", "Ġ", "a"]
    assert files.tokenizer.pad_token_id is not None
    assert getattr(files.config, "quantization_config", None) is None
    before = (out / "model.safetensors").stat().st_mtime_ns
    model_of_gguf(file, out)  # the same again
    assert (out / "model.safetensors").stat().st_mtime_ns == before


def test_random_weights_share_all_but_the_weights(tmp_path: Path) -> None:
    file = tmp_path / "tiny.gguf"
    write_gguf(file)
    own = weights_of(model_of_gguf(file, tmp_path / "own"))
    one, same, other = (
        weights_of(model_of_gguf(file, tmp_path / f"random-{n}", seed))
        for n, seed in enumerate((1, 1, 2))
    )
    name = "model.layers.0.mlp.up_proj.weight"
    assert {key: value.shape for key, value in own.items()} == {
        key: value.shape for key, value in one.items()
    }
    assert torch.equal(one[name], same[name])
    assert not torch.equal(one[name], other[name])
    assert not torch.equal(one[name], own[name])
    assert (tmp_path / "own/tokenizer.json").read_bytes() == (
        tmp_path / "random-0/tokenizer.json"
    ).read_bytes()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--from-gguf", "text.gguf"], "text.gguf is no GGUF file; give one, such as"),
        (["--from-gguf", "broken.gguf"], "transformers cannot load broken.gguf: "),
        (["--from-gguf", "bare.gguf"], "bare.gguf has no chat template, so it cannot hold"),
        (["tiny-text", "--from-gguf", "bare.gguf"], "--from-gguf takes no ARCHITECTURE"),
        (["tiny-text"], "give an ARCHITECTURE and --data"),
        (["tiny-text", "--data", "x", "--random-weights"], "--random-weights is for --from-gguf"),
    ],
)
def test_what_is_refused(
    arguments: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("text.gguf").write_text("a model")
    Path("broken.gguf").write_bytes(b"GGUF\x03\0\0\0" + bytes(16))
    if "bare.gguf" in arguments:
        write_gguf(Path("bare.gguf"), template="")
    result = CliRunner().invoke(new_model, [*arguments, "--out", "model"])
    assert result.exit_code == 2, result.output
    assert message in " ".join(result.output.split())
    assert not Path("model").exists()
