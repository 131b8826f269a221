"""ms-swift: messages with a flag ``loss`` for each turn of the assistant."""

from __future__ import annotations

from typing import Any

from er_gym.data.exports.base import ExportFormat, ExportJob, paths, row_files


def _write(job: ExportJob) -> None:
    with row_files(lambda name: job.folder / f"{name}.jsonl") as add:
        for split, chat in job.chats():
            messages: list[dict[str, Any]] = []
            for turn in chat.turns:
                message: dict[str, Any] = {"role": turn.role, "content": turn.text}
                if turn.role == "assistant":
                    message["loss"] = turn.train
                messages.append(message)
            add(split, {"messages": messages, "images": paths(chat), "id": chat.id})
            job.add(split, len(chat.pictures))


MS_SWIFT = ExportFormat(
    name="ms-swift",
    about="ms-swift: messages with a loss flag for each turn",
    write=_write,
    usage="""\
`--dataset train.jsonl[[ --val_dataset validation.jsonl]]`, with the environment variable
`ROOT_IMAGE_DIR` set to this folder, since picture paths are relative to it. `loss` says of each
turn of the assistant whether it is learnt; leave `--loss_scale` at its default, which heeds it.
""",
)
