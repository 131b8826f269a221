"""The tokens that get loss are those of the turns that are to be learnt, in every sample."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("trl", reason="needs the extra trl")

import trl
from PIL import Image
from tiny_qwen import _tokenizer
from transformers import Qwen2_5_VLProcessor
from transformers.models.qwen2_vl.image_processing_pil_qwen2_vl import Qwen2VLImageProcessorPil

from er_gym.data.collection import Collection
from er_gym.data.exports import ExportOptions, export
from er_gym.data.train_mask import train_mask

TEMPLATES = Path(trl.__file__).parent / "chat_templates"


class PictureProcessor(Qwen2_5_VLProcessor):
    """Qwen2.5-VL's own processor; without the part for videos, which needs torchvision."""

    def check_argument_for_proper_class(self, *_: Any) -> None:
        """A processor without videos is proper here."""


@pytest.fixture(scope="module")
def processor() -> PictureProcessor:
    return PictureProcessor(
        image_processor=Qwen2VLImageProcessorPil(patch_size=14),
        tokenizer=_tokenizer(),
        video_processor=None,
        chat_template=(TEMPLATES / "qwen2_5_vl.jinja").read_text(),  # Qwen2.5-VL's own
    )


def tokens(processor: PictureProcessor, said: list[dict[str, Any]], files: list[Path]) -> list[int]:
    """The tokens of a conversation, with those of its pictures."""
    whole = processor.apply_chat_template(said, tokenize=False)
    pictures = [Image.open(file) for file in files]
    return processor(text=[whole], images=pictures)["input_ids"][0]


def mask_of(processor: PictureProcessor, ids: Sequence[int], train: Sequence[bool]) -> list[bool]:
    encode = processor.tokenizer.encode
    return train_mask(ids, train, begin=encode("<|im_start|>assistant\n"), end=encode("<|im_end|>"))


def learnt(processor: PictureProcessor, ids: list[int], mask: list[bool]) -> list[str]:
    """The texts of the runs of tokens that get loss."""
    runs: list[list[int]] = []
    for place, (token, wanted) in enumerate(zip(ids, mask, strict=True)):
        if wanted and not (place and mask[place - 1]):
            runs.append([])
        if wanted:
            runs[-1].append(token)
    return [processor.tokenizer.decode(run) for run in runs]


def content(message: dict[str, Any]) -> str:
    if isinstance(message["content"], str):
        return message["content"]
    return "".join(part.get("text", "") for part in message["content"])


def as_blocks(message: dict[str, Any]) -> dict[str, Any]:
    """A message with ``<image>`` in its text as one of content blocks."""
    first, *rest = message["content"].split("<image>")
    blocks: list[dict[str, Any]] = [{"type": "text", "text": first}] if first else []
    for words in rest:
        blocks += [{"type": "image"}, *([{"type": "text", "text": words}] if words else [])]
    return {"role": message["role"], "content": blocks}


def samples(out: Path, format: str) -> list[tuple[list[dict[str, Any]], list[Path], list[bool]]]:
    """Messages in content blocks, picture files and flags of all samples of an export."""
    file = out / ("train.jsonl" if format == "ms-swift" else "train/metadata.jsonl")
    found = []
    for line in file.read_text(encoding="utf-8").splitlines():
        row = json.loads(line)
        if format == "ms-swift":
            flags = [each["loss"] for each in row["messages"] if each["role"] == "assistant"]
            said = [as_blocks(each) for each in row["messages"]]
            found.append((said, [out / each for each in row["images"]], flags))
            continue
        files = [out / "train" / each for each in row["images_file_names"]]
        if format == "trl":
            found.append((row["messages"], files, row["train"]))
        else:
            said = [*row["prompt"], *row["completion"]]
            turns = sum(each["role"] == "assistant" for each in said)
            found.append((said, files, [False] * (turns - 1) + [True]))
    return found


def test_loss_falls_on_the_turns_to_learn(
    collection: Collection, processor: PictureProcessor, tmp_path: Path
) -> None:
    checked = untrained = 0
    for format in ("trl", "ms-swift", "trl-turns"):
        for dialect in ("tags", "paper"):
            out = tmp_path / format / dialect
            export(collection, format, out, ExportOptions(dialect=dialect))
            for said, files, train in samples(out, format):
                ids = tokens(processor, said, files)
                mask = mask_of(processor, ids, train)
                replies = [content(each) for each in said if each["role"] == "assistant"]
                wanted = [text for text, flag in zip(replies, train, strict=True) if flag]
                assert learnt(processor, ids, mask) == [f"{text}<|im_end|>" for text in wanted]
                shown = ids.count(processor.image_token_id)
                assert shown == 3 * 5 * len(files)  # 128 x 72 pixels: 140 x 84, 28 a token
                checked += 1
                untrained += not all(train)
    assert checked >= 200
    assert untrained >= 100


def test_it_agrees_with_trls_own_mask_of_the_assistant(
    collection: Collection, processor: PictureProcessor, tmp_path: Path
) -> None:
    export(collection, "trl", tmp_path / "out")
    template = (TEMPLATES / "qwen2_5_vl_training.jinja").read_text()
    tokenizer = processor.tokenizer
    for said, _, train in samples(tmp_path / "out", "trl"):
        encoded = tokenizer.apply_chat_template(
            said, chat_template=template, tokenize=True, return_dict=True,
            return_assistant_tokens_mask=True,
        )  # fmt: skip
        mask = mask_of(processor, encoded["input_ids"], [True] * len(train))
        theirs = list(map(bool, encoded["assistant_masks"]))
        # Theirs has the line's end after <|im_end|> too.
        after = [not ours and before for ours, before in zip(mask[1:], mask, strict=False)]
        assert theirs == [ours or more for ours, more in zip(mask, [False, *after], strict=True)]


def test_what_does_not_fit_is_an_error() -> None:
    begin, end = [1, 2], [3]
    talk = [9, 1, 2, 7, 7, 3, 1, 5, 1, 2, 8, 3, 0, 0]
    assert train_mask(talk, [True, False], begin=begin, end=end) == (
        [False] * 3 + [True] * 3 + [False] * 8
    )
    assert sum(train_mask(talk, [False, True], begin=begin, end=end)) == 2
    for tokens, train, problem in (
        (talk, [True], "2 turns of the assistant, but there are 1 flags"),
        (talk[:6], [True, True], "1 turns"),
        (talk[:11], [True, True], "turn 1 of the assistant has no end"),
    ):
        with pytest.raises(ValueError, match=problem):
            train_mask(tokens, train, begin=begin, end=end)
    with pytest.raises(ValueError, match="at least one token"):
        train_mask(talk, [True], begin=[], end=end)
