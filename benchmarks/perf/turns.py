"""Measures how fast a model in this process answers the turns of long conversations.

    python -m benchmarks.perf.turns MODEL [--conversations 8 --turns 12 --set local.batch=4]

The model answers the same conversations with ``local.reuse`` on and off, by turns, so that both see
the same machine. Where other programs keep the machine busy, compare the processor's seconds. What
the model says ends at ``--tokens``, so that models with random weights will do.
"""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from functools import partial
from pathlib import Path

import click
import numpy as np

from agents.factory import load_settings, settings_file
from agents.vlm.chat import Message, Picture
from agents.vlm.clients.local import LocalClient
from agents.vlm.pictures import encode
from agents.vlm.settings import AgentSettings
from benchmarks.cli.options import agent_config_option, overrides_option
from benchmarks.harness.measuring import Spent, in_turns, timed

_WORDS = "see CounterTop ( Apple, Mug away, Bread far ), Fridge closed, Cabinet open ( Plate ). "


@click.command()
@click.argument("model")
@click.option("--conversations", default=8, show_default=True)
@click.option("--turns", default=12, show_default=True)
@click.option("--tokens", default=32, show_default=True, help="Of each reply.")
@click.option("--size", type=(int, int), default=(308, 168), show_default=True, help="Pixels.")
@click.option("--rounds", default=3, show_default=True)
@agent_config_option
@overrides_option("local.batch=4")
def main(
    model: str,
    conversations: int,
    turns: int,
    tokens: int,
    size: tuple[int, int],
    rounds: int,
    agent_config: str | None,
    overrides: Sequence[str],
) -> None:
    """Measure, and print."""
    given = ("sampling.max_tokens=" + str(tokens), *overrides)
    settings = load_settings(agent_config, given, settings_file(f"hf:{model}"))
    replies: dict[bool, list[str]] = {}

    def answer(reuse: bool) -> Spent:
        local = settings.local.model_copy(update={"reuse": reuse})
        with closing(LocalClient(model, settings.model_copy(update={"local": local}))) as client:
            _played(client, settings, 1, 2, size)  # the first request is slower

            def play() -> None:
                replies[reuse] = _played(client, settings, conversations, turns, size)

            return timed(play)

    spent = in_turns({reuse: partial(answer, reuse) for reuse in (False, True)}, rounds)
    decisions = conversations * turns
    clock, processor = (
        {reuse: statistics.median(getattr(one, name) for one in spent[reuse]) for reuse in spent}
        for name in ("clock", "processor")
    )
    for reuse, found in spent.items():
        each = ", ".join(f"{one.clock:.1f}" for one in found)
        click.echo(
            f"reuse {'on ' if reuse else 'off'}: {decisions} replies in {clock[reuse]:.1f} s "
            f"({each}): {decisions / clock[reuse]:.2f} replies/s, {processor[reuse]:.1f} s of the "
            "processor"
        )
    alike = sum(one == other for one, other in zip(*replies.values(), strict=True))
    click.echo(
        f"{clock[False] / clock[True]:.2f} times as fast, "
        f"{processor[False] / processor[True]:.2f} times by the processor's seconds; "
        f"{alike} of {decisions} replies are the same; {Path(model).name}"
    )


def _played(
    client: LocalClient,
    settings: AgentSettings,
    conversations: int,
    turns: int,
    size: tuple[int, int],
) -> list[str]:
    """The replies of all conversations, each of which is played in a thread of its own."""

    def play(number: int) -> list[str]:
        talk: list[Message] = []
        for turn in range(turns):
            talk.append(_told(settings, number, turn, size))
            talk.append(Message("assistant", (client.reply(talk, number).text,)))
        return [str(message.parts[0]) for message in talk[1::2]]

    with ThreadPoolExecutor(conversations) as pool:
        return [reply for said in pool.map(play, range(conversations)) for reply in said]


def _told(settings: AgentSettings, number: int, turn: int, size: tuple[int, int]) -> Message:
    """What the user tells: words, and a picture if the agent sees any."""
    shown: list[Picture] = []
    if settings.sees == "pictures":
        random = np.random.default_rng((number, turn))
        pixels = random.integers(0, 256, (size[1], size[0], 3), dtype=np.uint8)
        shown = [encode(pixels, settings.pictures)]
    return Message("user", (*shown, f"{number} {turn} " + _WORDS * (1 + (number + turn) % 3)))


if __name__ == "__main__":
    main()
