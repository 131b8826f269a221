"""LLaMA-Factory: ShareGPT messages with ``dataset_info.json``.

All turns of the assistant are learnt, and there is no flag for a turn. Trajectories in which some
turns are not learnt become one sample for each turn that is; LLaMA-Factory's ``mask_history`` then
learns the last turn of a sample alone. Since ``mask_history`` holds for a whole run, such samples
are a dataset of their own.
"""

from __future__ import annotations

import json

from er_gym.data.chat import trained_prefixes
from er_gym.data.exports.base import (
    ExportFormat,
    ExportJob,
    paths,
    plain_messages,
    row_files,
)
from er_gym.writing import write_atomic

_COLUMNS = {"messages": "messages", "images": "images"}
_TAGS = {
    "role_tag": "role",
    "content_tag": "content",
    "user_tag": "user",
    "assistant_tag": "assistant",
    "system_tag": "system",
}
FEEDBACK_TOKEN = "<|feedback|>"


def _write(job: ExportJob) -> None:
    has_token = False
    with row_files(lambda name: job.folder / f"{name}.jsonl") as add:
        for split, chat in job.chats():
            one_by_one = job.options.per_turn or not chat.trains_all
            name = f"{split}_turns" if one_by_one else split
            for sample in trained_prefixes(chat) if one_by_one else (chat,):
                messages = plain_messages(sample)
                has_token |= any(FEEDBACK_TOKEN in message["content"] for message in messages)
                add(name, {"messages": messages, "images": paths(sample), "id": chat.id})
                job.add(name, len(sample.pictures))
    info = {
        f"er_gym_{name}": {
            "file_name": f"{name}.jsonl",
            "formatting": "sharegpt",
            "columns": _COLUMNS,
            "tags": _TAGS,
        }
        for name in sorted(job.samples)
    }
    write_atomic(job.folder / "dataset_info.json", json.dumps(info, indent=2) + "\n")
    if has_token:
        token = f'"{FEEDBACK_TOKEN}": "begins a message that says why an action was not done"\n'
        write_atomic(job.folder / "special_tokens.yaml", token)


SHAREGPT = ExportFormat(
    name="sharegpt",
    about="LLaMA-Factory: ShareGPT messages, dataset_info.json",
    write=_write,
    usage="""\
Give this folder to LLaMA-Factory as `dataset_dir`, and the names in `dataset_info.json` as
`dataset`. Picture paths are relative to this folder.

- `er_gym_train`[[, `er_gym_validation`]]: whole trajectories; every turn of the assistant is
  learnt.
- `er_gym_train_turns`[[, `er_gym_validation_turns`]]: one sample for each turn that is to be
  learnt; train on these with `mask_history: true`, which learns the last turn of a sample alone.

`mask_history` holds for a whole run, so do not mix the two kinds: export with `--per-turn` to have
everything in the second. Set `cutoff_len` so that the longest sample fits, pictures included.
`special_tokens.yaml`, where it is there, can be given as `new_special_tokens_config`: then
`<|feedback|>` is one token.
""",
)
