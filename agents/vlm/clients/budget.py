"""What replies cost: written down, added up, and stopped in time."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime, timezone
from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import BaseModel, ValidationError

from agents.base import CannotGoOn
from agents.vlm.chat import Message, Reply, Usage
from agents.vlm.settings import Prices

if TYPE_CHECKING:
    from agents.vlm.clients.kept import Identified

_AGAIN = "run the same command again to continue"
_CLOSED = -1


@dataclass(frozen=True)
class Budget:
    """What may be spent; no limit for None.

    Attributes:
        max_usd: US dollars, by the prices that the settings state.
        max_tokens: of prompts and completions, also those that the server remembered.
        max_minutes: of this process.
    """

    max_usd: float | None = None
    max_tokens: int | None = None
    max_minutes: float | None = None


@dataclass(frozen=True)
class Spent:
    """What has been spent: tokens, US dollars, and how many requests were answered."""

    usage: Usage = field(default_factory=Usage)
    cost: float = 0.0
    requests: int = 0


class Entry(BaseModel):
    """A line of a ledger: a reply that was paid for.

    Attributes:
        time: when it came, ISO 8601 in UTC.
        model: which answered.
        seed: of the episode.
        prompt, completion, cached, reasoning: tokens, as :class:`agents.vlm.chat.Usage` has them.
        cost: US dollars.
        seconds: how long it took.
    """

    time: str
    model: str
    seed: int
    prompt: int
    completion: int
    cached: int
    reasoning: int
    cost: float
    seconds: float


class Metered:
    """Writes down what each reply of another client costs, and asks no more when it is too much.

    The ledger is what counts: whatever stands in it has been spent, by an earlier process too, or
    by another that writes to the same file now. A limit is looked at before each request, so that
    at most the requests under way go beyond it. What a server charges for an answer that never
    came is not known, and not in it.

    Args:
        client: is asked.
        budget: what may be spent.
        ledger: JSON lines, :class:`Entry` each; it and its directory are made.

    Raises:
        ValueError: dollars are limited and no prices are known.
        OSError: the ledger cannot be written.
    """

    def __init__(self, client: Identified, budget: Budget, ledger: Path) -> None:
        if budget.max_usd is not None:
            prices = getattr(client, "prices", None) or Prices()
            if not (prices.prompt or prices.completion):
                raise ValueError(
                    "--max-usd needs prices: give prices.prompt and prices.completion, US dollars "
                    "for a million tokens, or use --max-tokens"
                )
        self._client, self._budget = client, budget
        self._began = time.monotonic()
        self._lock = threading.Lock()
        self._spent = Spent()
        self._read_to = 0
        self._path = ledger
        ledger.parent.mkdir(parents=True, exist_ok=True)
        self._file = os.open(ledger, os.O_RDWR | os.O_APPEND | os.O_CREAT, 0o644)
        size = os.fstat(self._file).st_size
        if size and os.pread(self._file, 1, size - 1) != b"\n":
            os.write(self._file, b"\n")  # ends what a killed process left half-written

    @property
    def identity(self) -> str:
        """The other client's."""
        return self._client.identity

    @property
    def spent(self) -> Spent:
        """What stands in the ledger; once it is closed, what stood in it then."""
        with self._lock:
            self._catch_up()
            return self._spent

    def reply(self, messages: Sequence[Message], seed: int) -> Reply:
        """The next turn, as :class:`agents.vlm.chat.Client` has it.

        Raises:
            CannotGoOn: the budget is spent, or the ledger cannot be written.
        """
        self._check()
        reply = self._client.reply(messages, seed)
        if not reply.kept:
            self._write(reply, seed)
        return reply

    def close(self) -> None:
        """Close the ledger and the other client."""
        with self._lock:
            if self._file != _CLOSED:
                self._catch_up()
                os.close(self._file)
                self._file = _CLOSED
        self._client.close()

    def _check(self) -> None:
        budget, spent = self._budget, self.spent
        if budget.max_usd is not None and spent.cost >= budget.max_usd:
            raise CannotGoOn(
                f"the budget is spent: ${spent.cost:.2f} of ${budget.max_usd:.2f}; raise --max-usd "
                f"and {_AGAIN}"
            )
        if budget.max_tokens is not None and spent.usage.total >= budget.max_tokens:
            raise CannotGoOn(
                f"the budget is spent: {spent.usage.total:,} of {budget.max_tokens:,} tokens; "
                f"raise --max-tokens and {_AGAIN}"
            )
        minutes = (time.monotonic() - self._began) / 60
        if budget.max_minutes is not None and minutes >= budget.max_minutes:
            raise CannotGoOn(f"the {budget.max_minutes:g} minutes are over; {_AGAIN}")

    def _catch_up(self) -> None:
        """Read what has come to the ledger, whoever wrote it."""
        if self._file == _CLOSED:
            return
        new = max(0, os.fstat(self._file).st_size - self._read_to)
        for line in os.pread(self._file, new, self._read_to).split(b"\n")[:-1]:
            self._read_to += len(line) + 1
            self._spent = _with(self._spent, line)

    def _write(self, reply: Reply, seed: int) -> None:
        usage = reply.usage
        entry = Entry(
            time=datetime.now(timezone.utc).isoformat(timespec="milliseconds"),
            model=reply.model,
            seed=seed,
            prompt=usage.prompt,
            completion=usage.completion,
            cached=usage.cached,
            reasoning=usage.reasoning,
            cost=reply.cost,
            seconds=round(reply.seconds, 3),
        )
        try:
            with self._lock:
                # One write of a whole line to the end of the file: lines of processes do not mix.
                os.write(self._file, entry.model_dump_json().encode() + b"\n")
        except OSError as error:
            raise CannotGoOn(
                f"{self._path} cannot be written ({error.strerror}), so that nobody would know "
                f"what is spent; see to that and {_AGAIN}"
            ) from error


def _with(spent: Spent, line: bytes) -> Spent:
    """What is spent with a line of the ledger; a half-written one says nothing."""
    try:
        entry = Entry.model_validate_json(line)
    except ValidationError:
        return spent
    usage = Usage(entry.prompt, entry.completion, entry.cached, entry.reasoning)
    return Spent(spent.usage + usage, spent.cost + entry.cost, spent.requests + 1)
