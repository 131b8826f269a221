"""Helpers: clients of a real, tiny Qwen in this process, and what is said to them."""

from __future__ import annotations

import io
import shutil
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pytest
from PIL import Image

from agents.vlm.chat import Message, Picture, Reply
from agents.vlm.clients.local import LocalClient
from agents.vlm.settings import AgentSettings

LONG = 60.0  # seconds; only broken code waits so long
PATCH = {"qwen2_vl": 14, "qwen2_5_vl": 14, "qwen3_vl": 16}  # pixels a side; a token is 2 by 2
EYES = tuple(PATCH)

Conversation: TypeAlias = tuple[Message, ...]
Models: TypeAlias = Callable[[str], Path]
Clients: TypeAlias = Callable[..., LocalClient]


def settings(family: str | Path = "qwen2_5_vl", /, **changes: Any) -> AgentSettings:
    given: dict[str, Any] = {
        "sees": "text" if family == "qwen2" else "pictures",
        "sampling": {"max_tokens": 16},
        **changes,
    }
    given["local"] = {"dtype": "float32", "device_map": "cpu", **changes.get("local", {})}
    return AgentSettings.model_validate(given)


def picture(width: int, height: int, seed: int = 0) -> Picture:
    pixels = np.random.default_rng(seed).integers(0, 256, (height, width, 3), dtype=np.uint8)
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "png")
    return Picture(file.getvalue(), "image/png", width, height)


def user(*parts: str | Picture) -> Message:
    return Message("user", parts)


def conversations(family: str) -> list[Conversation]:
    """Four that differ in length and in pictures, which a family without vision is not shown."""
    system = Message("system", ("Find it.",))
    talks: list[Conversation] = [
        (system, user("You see: ", picture(300, 300, 1), " What now?")),
        (user("Hello"),),
        (
            system,
            user("First", picture(120, 90, 2), "then", picture(56, 84, 3)),
            Message("assistant", ("open Fridge",)),
            user(picture(200, 100, 4), "That is all."),
        ),
        (user("Well, well. " * 9),),
    ]
    if family in EYES:
        return talks
    return [
        tuple(
            Message(turn.role, tuple(part for part in turn.parts if isinstance(part, str)))
            for turn in talk
        )
        for talk in talks
    ]


def at_once(client: LocalClient, talks: Sequence[Conversation]) -> list[Reply]:
    """What is said when each conversation has a thread of its own."""
    with ThreadPoolExecutor(len(talks)) as pool:
        replies = [pool.submit(client.reply, talk, seed) for seed, talk in enumerate(talks)]
        return [each.result(LONG) for each in replies]


def recorded(client: LocalClient) -> list[list[int]]:
    """The tokens of every reply from now on."""
    replies: list[list[int]] = []
    reply = client._reply

    def noted(row: Any, said: Any) -> Reply:
        replies.append(list(said))
        return reply(row, said)

    client._reply = noted  # type: ignore[method-assign]
    return replies


def watched(client: LocalClient, before: Callable[[int], object]) -> None:
    """Call ``before`` with the number of conversations each time before the model works on some."""
    packed = client._packed
    if packed is not None:
        step = packed.step

        def stepped(rows: Any) -> None:
            before(len(rows))
            step(rows)

        packed.step = stepped  # type: ignore[method-assign]
        return
    generate = client._model.generate

    def generated(**inputs: Any) -> Any:
        before(len(inputs["input_ids"]))
        return generate(**inputs)

    client._model.generate = generated


def gathered(client: LocalClient, count: int) -> None:
    """Hold the model's first step until so many conversations are here, those in it included."""
    held: list[int] = []

    def hold(now: int) -> None:
        until = time.monotonic() + LONG
        while not held and now + client._jobs.waiting.qsize() < count and time.monotonic() < until:
            time.sleep(0.001)
        held.append(now)

    watched(client, hold)


BOTH_WAYS = pytest.mark.parametrize("reuse", [True, False], ids=["packed", "padded"])
"""Step by step in one row, as on a CPU; and by ``generate``, as without ``local.reuse``."""


def edited(
    models: Models, to: Path, edit: Callable[[Path], object], family: str = "qwen2_5_vl"
) -> Path:
    """A copy of a model with something done to it."""
    shutil.copytree(models(family), to)
    edit(to)
    return to


def same(replies: Sequence[Reply], others: Sequence[Reply]) -> bool:
    """Whether they are, but for the time that they took."""
    plain = [[(r.text, r.reasoning, r.usage, r.finish) for r in each] for each in (replies, others)]
    return plain[0] == plain[1]
