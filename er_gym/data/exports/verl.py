"""verl: Parquet with messages and pictures, for its multi-turn SFT dataset.

All turns of the assistant are learnt, and there is no flag for a turn. Turns that get no loss are
quoted in the user's messages instead (:func:`er_gym.data.chat.told_by_user`).
"""

from __future__ import annotations

from contextlib import ExitStack, closing

from er_gym.data.chat import told_by_user
from er_gym.data.exports.base import (
    SPLITS,
    ExportFormat,
    ExportJob,
    plain_messages,
)
from er_gym.data.exports.parquet import ParquetShards, load_pyarrow


def _write(job: ExportJob) -> None:
    pa = load_pyarrow()
    message = pa.struct([("role", pa.string()), ("content", pa.string())])
    picture = pa.struct([("bytes", pa.binary()), ("path", pa.string())])
    schema = pa.schema(
        [("messages", pa.list_(message)), ("images", pa.list_(picture)), ("id", pa.string())]
    )
    with ExitStack() as stack:
        shards = {
            split: stack.enter_context(closing(ParquetShards(job.folder, split, schema)))
            for split in SPLITS
        }
        for split, trajectory in job.trajectories():
            if not any(turn.train for turn in trajectory.turns):
                job.leave_out("no turn is to be learnt")
                continue
            job.take(trajectory)
            chat = told_by_user(job.dialect.chat(trajectory, job.options.language))
            images = job.embedded(chat)
            row = {"messages": plain_messages(chat), "images": images, "id": chat.id}
            shards[split].add(row, sum(len(each["bytes"]) for each in images))
            job.add(split, len(images))


VERL = ExportFormat(
    name="verl",
    about="verl: Parquet with messages and pictures",
    write=_write,
    usage="""\
`data.train_files` takes the files `train-*.parquet`[[, `data.val_files` the files
`validation-*.parquet`]]; `data.messages_key=messages`, `data.image_key=images`. The pictures are
inside the files. verl learns every turn of the assistant; turns that are not to be learnt are
therefore part of the user's messages here, as text. Raise `data.max_length`: a picture takes
hundreds of tokens.
""",
)
