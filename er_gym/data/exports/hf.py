"""A Hugging Face dataset: Parquet with the features of ``datasets``, and a dataset card."""

from __future__ import annotations

from contextlib import ExitStack, closing
from typing import Any

from er_gym.data.exports.base import SPLITS, ExportFormat, ExportJob, needs
from er_gym.data.exports.parquet import ParquetShards, load_pyarrow
from er_gym.data.exports.trl import content_blocks
from er_gym.data.trajectory import Trajectory


def _schema() -> Any:
    """The columns as an Arrow schema, in which ``datasets`` finds its features."""
    load_pyarrow()
    try:
        from datasets import Features, Image, List, Value
    except ImportError as error:
        raise needs("datasets", "data", error) from error
    text = Value("string")
    features = Features(
        {
            "id": text,
            "messages": List({"role": text, "content": List({"type": text, "text": text})}),
            "images": List(Image()),
            "train": List(Value("bool")),
            "actions": List(text),
            "thought_kinds": List(List(text)),
            "succeeded": List(Value("bool")),
            "rewards": List(Value("float64")),
            **dict.fromkeys(_ABOUT, text),
            "success": Value("bool"),
        }
    )
    return features.arrow_schema


_ABOUT = ("task_id", "task_type", "scene", "instruction", "part", "kind", "language", "actor")
"""The fields of a trajectory that are columns as they are."""


def _about(trajectory: Trajectory) -> dict[str, Any]:
    return {
        "actions": [str(turn.action) for turn in trajectory.turns],
        "thought_kinds": [[each.kind for each in turn.thoughts] for turn in trajectory.turns],
        "succeeded": [turn.success for turn in trajectory.turns],
        "rewards": [turn.reward for turn in trajectory.turns],
        **{name: getattr(trajectory, name) for name in _ABOUT},
        "success": trajectory.success,
    }


def _write(job: ExportJob) -> None:
    schema = _schema()
    with ExitStack() as stack:
        shards = {
            split: stack.enter_context(closing(ParquetShards(job.folder / "data", split, schema)))
            for split in SPLITS
        }
        for split, trajectory in job.trajectories():
            job.take(trajectory)
            chat = job.dialect.chat(trajectory, job.options.language)
            images = job.embedded(chat)
            row = {
                "id": chat.id,
                "messages": [content_blocks(turn) for turn in chat.turns],
                "images": images,
                "train": list(chat.train),
                **_about(trajectory),
            }
            shards[split].add(row, sum(len(each["bytes"]) for each in images))
            job.add(split, len(images))


HF = ExportFormat(
    name="hf",
    about="Hugging Face: a dataset with pictures and a card",
    write=_write,
    card="""\
---
task_categories:
- image-text-to-text
- robotics
tags:
- embodied-reasoning
- ai2-thor
configs:
- config_name: default
  data_files:
{data_files}
---
""",
    usage="""\
```python
from datasets import load_dataset

dataset = load_dataset("THIS FOLDER")  # train[[, validation]]
```

A row is a trajectory:

- `messages`, of content blocks, and `images`, which they show in order;
- `train`: for each turn of the assistant, whether it is to be learnt;
- `actions`, `thought_kinds`, `succeeded`, `rewards`: for each turn, what was done, which kinds of
  thoughts were thought, whether it worked and what it earned;
- `task_id`, `task_type`, `scene`, `instruction`, `part`, `kind`, `language`, `actor`, `success`.
""",
)
