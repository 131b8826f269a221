"""TRL: messages of content blocks with a column of pictures, for ``SFTTrainer``.

Each split is a folder that ``datasets`` reads as an ``imagefolder``: ``metadata.jsonl`` and the
pictures, which it makes the column ``images``.
"""

from __future__ import annotations

from typing import Any

from er_gym.data.chat import ChatTurn, trained_prefixes
from er_gym.data.exports.base import SPLITS, ExportFormat, ExportJob, paths, row_files

_FOLDERS = {split: split for split in SPLITS}
_PATHS = "images_file_names"
"""The column of the paths of pictures; ``datasets`` makes it the column ``images``."""


def content_blocks(turn: ChatTurn) -> dict[str, Any]:
    """A message whose content is a list of blocks, as chat templates of vision models take it."""
    blocks = [
        {"type": "text", "text": part} if isinstance(part, str) else {"type": "image"}
        for part in turn.parts
    ]
    return {"role": turn.role, "content": blocks}


def _write(job: ExportJob) -> None:
    with row_files(lambda name: job.folder / name / "metadata.jsonl") as add:
        for split, chat in job.chats(_FOLDERS):
            messages = [content_blocks(turn) for turn in chat.turns]
            row = {"messages": messages, "train": list(chat.train), _PATHS: paths(chat)}
            add(split, {"id": chat.id, **row})
            job.add(split, len(chat.pictures))


def _write_turns(job: ExportJob) -> None:
    with row_files(lambda name: job.folder / name / "metadata.jsonl") as add:
        for split, chat in job.chats(_FOLDERS):
            for sample in trained_prefixes(chat):
                *prompt, completion = [content_blocks(turn) for turn in sample.turns]
                row = {"prompt": prompt, "completion": [completion], _PATHS: paths(sample)}
                add(split, {"id": chat.id, **row})
                job.add(split, len(sample.pictures))


_LOAD = """\
```python
from datasets import load_dataset

dataset = load_dataset("imagefolder", data_dir="THIS FOLDER")  # train[[, validation]]
```

"""

TRL = ExportFormat(
    name="trl",
    about="TRL: content blocks and pictures, a row for each trajectory",
    write=_write,
    usage=_LOAD
    + """\
The columns are `messages`, `images`, `train` and `id`. `train` says of each turn of the assistant
whether it is learnt. `SFTTrainer` does not know it: `assistant_only_loss=True` learns all turns of
the assistant. Where some are not to be learnt, make the labels of a batch with
`er_gym.data.train_mask.train_mask`, or use the format `trl-turns`. Set `max_length=None`: a picture
takes hundreds of tokens.
""",
)
TRL_TURNS = ExportFormat(
    name="trl-turns",
    about="TRL: prompt and completion, a row for each turn that is learnt",
    write=_write_turns,
    usage=_LOAD
    + """\
The columns are `prompt`, `completion`, `images` and `id`. `SFTTrainer` learns the completion alone.
Set `max_length=None`: a picture takes hundreds of tokens.
""",
)
