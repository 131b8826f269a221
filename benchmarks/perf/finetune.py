"""Measures how much of the machine's rate of matrix multiplication goes into fine-tuning.

    er-gym collect --suite mini --out runs/data --limit 24
    python -m benchmarks.perf.finetune --data runs/data

A tiny language model learns the collection's conversations, without pictures, with the real
trainer. Its multiplications are counted: those of its layers, forward and backward, of attention,
and of the output embedding for the tokens that get loss. Padding does not count, and neither does
what is computed again with checkpointing. Beside it, the same machine multiplies matrices of the
same sizes. The two take turns, and the median of the rounds is printed, by the clock and by
processor time, which other programs on the machine disturb less; then where the time goes.
"""

from __future__ import annotations

import os
import statistics
import tempfile
from collections import defaultdict
from collections.abc import Callable
from functools import partial
from pathlib import Path

import click
import torch
import transformers
from torch.profiler import ProfilerActivity, profile

from agents.finetune.architecture import Architecture
from agents.finetune.batches import EpochSampler
from agents.finetune.memory import ModelDimensions, dimensions_of
from agents.finetune.new_model import make_model
from agents.finetune.samples import open_samples
from agents.finetune.settings import DataSettings, load_settings
from agents.finetune.tokens import EncodedChat, Encoder
from agents.finetune.train import train
from benchmarks.harness.measuring import timed
from benchmarks.harness.output import print_table
from er_gym.data.collection import Collection

WANTED = 0.6
PARTS = {
    "matrix products": ("mm", "addmm", "bmm", "matmul", "linear"),
    "attention": ("scaled_dot_product", "flash_attention"),
    "optimizer": ("Optimizer.step", "fused_adam", "clip", "norm", "foreach"),
    "batches": ("enumerate(DataLoader)",),
}
"""Parts of the time, and words in the names of what they consist of."""


def blind(collection: Collection, to: Path) -> Collection:
    """The same trajectories without pictures."""
    made = Collection.create(to, collection.manifest)
    made.write(
        each.model_copy(
            update={"turns": [turn.model_copy(update={"pictures": []}) for turn in each.turns]}
        )
        for each in collection.trajectories()
    )
    return made


def architecture(hidden: int, layers: int, words: int) -> Architecture:
    """A Qwen2 of this size."""
    return Architecture(
        family="qwen2",
        vocabulary=words,
        text={
            "hidden_size": hidden,
            "intermediate_size": 3 * hidden,
            "num_hidden_layers": layers,
            "num_attention_heads": max(1, hidden // 64),
            "num_key_value_heads": max(1, hidden // 128),
            "max_position_embeddings": 8_192,
            "tie_word_embeddings": True,
        },
    )


def work_of(model: ModelDimensions, chats: list[EncodedChat]) -> float:
    """Additions and multiplications of one pass over the conversations, forward and backward."""
    found = 0.0
    for chat in chats:
        layers = model.linear * chat.length
        attention = model.layers * model.attended * chat.length**2  # two products, half of it seen
        scores = model.hidden * model.vocabulary * chat.learnt_tokens
        found += 2 * 3 * (layers + attention + scores)
    return found


def products(model: ModelDimensions, rows: int) -> tuple[float, Callable[[], None]]:
    """All products of the model's layers for so many tokens, forward and backward, and nothing
    else; returns their work, too."""
    h, wide, q, k = model.hidden, model.intermediate, model.attended, model.keys
    sizes = [(h, q), (h, k), (h, k), (q, h), (h, wide), (h, wide), (wide, h)]
    inputs = {size: torch.randn(rows, size) for size in {h, wide, q, k}}
    weights = [torch.randn(out, into) for into, out in sizes]

    def multiply() -> None:
        for weight in weights:
            out, into = weight.shape
            torch.mm(inputs[into], weight.T)
            torch.mm(inputs[out], weight)
            torch.mm(inputs[out].T, inputs[into])

    work = sum(6.0 * rows * into * out for into, out in sizes)
    return work, multiply


def repeat(call: Callable[[], None], times: int) -> None:
    for _ in range(times):
        call()


def part_of(name: str) -> str:
    for part, words in PARTS.items():
        if any(word in name for word in words):
            return part
    return "the rest: norms, activations, loss, copies"


@click.command()
@click.option("--data", required=True, type=click.Path(path_type=Path, exists=True))
@click.option("--dialect", default="tags", show_default=True)
@click.option("--hidden", default=256, show_default=True)
@click.option("--layers", default=6, show_default=True)
@click.option("--words", default=2_000, show_default=True)
@click.option("--batch", default=4, show_default=True)
@click.option("--epochs", default=3, show_default=True)
@click.option("--rounds", default=3, show_default=True)
@click.option("--limit", type=int, help="The most conversations.  [default: all]")
@click.option("--threads", default=os.cpu_count() or 1, show_default=True)
def main(
    data: Path, dialect: str, hidden: int, layers: int, words: int, batch: int, epochs: int,
    rounds: int, limit: int | None, threads: int,
) -> None:  # fmt: skip
    """Measure, and print two tables."""
    torch.set_num_threads(threads)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        text = blind(Collection.open(data), folder / "data")
        samples = open_samples([text.path], DataSettings(dialect=dialect, limit=limit))
        texts = (turn.text for chat in samples.chats for turn in chat.turns)
        make_model(architecture(hidden, layers, words), texts, folder / "model")
        tokenizer = transformers.AutoTokenizer.from_pretrained(folder / "model")
        settings = load_settings("stage1", [
            "data.parts=[]", f"data.dialect={dialect}", f"data.limit={limit or 'null'}",
            f"training.batch={batch}",
            "training.checkpointing=false", "training.learning_rate=0.001",
            "training.log_every=1000", "training.save_every=100000",
        ])  # fmt: skip
        encoder = Encoder(tokenizer, tokenizer.chat_template, None, None, settings.data)
        chats = [encoder.encode(chat) for chat in samples.chats]
        model = dimensions_of(transformers.AutoConfig.from_pretrained(folder / "model").to_dict())
        work = work_of(model, chats)
        number = iter(range(1_000))

        def learn(passes: int) -> None:
            training = settings.training.model_copy(update={"epochs": float(passes)})
            train(
                settings.model_copy(update={"training": training}),
                folder / "model", [text.path], folder / f"run-{next(number)}",
            )  # fmt: skip

        rows = sum(chat.length for chat in chats) // len(chats) * batch
        product_work, multiply = products(model, rows)
        learn(1)
        multiply()

        def one_round() -> dict[str, float]:
            # What starting costs is the same for one pass and for more.
            short, long = timed(partial(learn, 1)), timed(partial(learn, 1 + epochs))
            times = max(1, int(work * (1 + epochs) / product_work / 4))
            alone = timed(partial(repeat, multiply, times))
            figures = {}
            for name in ("clock", "processor"):
                into = work * epochs / (getattr(long, name) - getattr(short, name))
                rate = product_work * times / getattr(alone, name)
                figures[f"{name}: training, GFLOP/s"] = into / 1e9
                figures[f"{name}: matrix products, GFLOP/s"] = rate / 1e9
                figures[f"{name}: share"] = into / rate
            return figures

        every = [one_round() for _ in range(rounds)]
        with profile(activities=[ProfilerActivity.CPU]) as seen:
            learn(epochs)
    order = list(EpochSampler([chat.length for chat in chats], batch, 0, buckets=True))
    batches = [
        [chats[i].length for i in order[at : at + batch]] for at in range(0, len(order), batch)
    ]
    filled = sum(map(sum, batches)) / sum(max(each) * len(each) for each in batches)
    click.echo(
        f"{model.parameters / 1e6:.1f} M parameters, {len(chats)} conversations of "
        f"{rows // batch:,} tokens on average, {batch} in a batch, of which {1 - filled:.0%} "
        f"is padding; {threads} threads"
    )
    table = []
    for name in every[0]:
        form = "{:.0%}" if name.endswith("share") else "{:.1f}"
        values = [figures[name] for figures in every]
        middle = form.format(statistics.median(values))
        table.append((name, middle, ", ".join(map(form.format, values))))
    print_table(f"wanted: a share of at least {WANTED:.0%}", ("what", "median", "rounds"), table)
    spent: defaultdict[str, float] = defaultdict(float)
    for event in seen.key_averages():
        spent[part_of(event.key)] += event.self_cpu_time_total
    shares = sorted(spent.items(), key=lambda each: -each[1])
    print_table(
        "where the time goes (the profiler's own included)",
        ("part", "share"),
        ((name, f"{value / sum(spent.values()):.0%}") for name, value in shares),
    )


if __name__ == "__main__":
    main()
