"""The ledger of a run: records what replies cost and stops the run at its budget."""

from __future__ import annotations

import math
import threading
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime, timezone
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from agents.vlm.chat import Message, Reply, Usage
from agents.vlm.clients.supervisor import AGAIN, RequestSupervisor
from agents.vlm.settings import Prices
from er_gym.rollout.agent import CannotGoOn
from er_gym.rollout.json_lines import JsonLines

if TYPE_CHECKING:
    from agents.vlm.clients.reply_cache import CacheableClient


@dataclass(frozen=True)
class Budget:
    """The limits of a run; None for no limit.

    Attributes:
        max_usd: US dollars, by the prices of the settings.
        max_tokens: prompt and completion tokens, cached ones included.
        max_minutes: the running time of this process.

    Raises:
        ValueError: a limit is not a positive, finite number.
    """

    max_usd: float | None = None
    max_tokens: int | None = None
    max_minutes: float | None = None

    def __post_init__(self) -> None:
        for name, given in vars(self).items():
            kinds = (int,) if name == "max_tokens" else (int, float)
            number = isinstance(given, kinds) and not isinstance(given, bool)
            if given is None or (number and 0 < given < math.inf):
                continue
            what = "whole number" if name == "max_tokens" else "finite number"
            raise ValueError(
                f"{name} is {given!r}; give a {what} above 0 (on the command line, "
                f"--{name.replace('_', '-')}), or leave it out for no limit"
            )


@dataclass(frozen=True)
class Spent:
    """The sum of a ledger: tokens, US dollars, and the number of answers."""

    usage: Usage = field(default_factory=Usage)
    cost: float = 0.0
    requests: int = 0


_Count = Annotated[int, Field(ge=0)]
_Amount = Annotated[float, Field(ge=0, allow_inf_nan=False)]


class Entry(BaseModel):
    """A line of the ledger: an answer that was paid for.

    Attributes:
        time: when the answer came, ISO 8601 in UTC.
        model: the model that answered.
        seed: of the episode.
        prompt, completion, cached, reasoning, estimated: tokens, as
            :class:`agents.vlm.chat.Usage` has them.
        cost: US dollars.
        seconds: how long it took.
        rejected: why the answer was not a valid reply; "" for a valid one.
    """

    model_config = ConfigDict(frozen=True)

    time: str
    model: str
    seed: int
    prompt: _Count
    completion: _Count
    cached: _Count
    reasoning: _Count
    estimated: bool = False
    cost: _Amount
    seconds: _Amount
    rejected: str = ""

    @staticmethod
    def of(
        usage: Usage, *, model: str, seed: int, cost: float, seconds: float, rejected: str = ""
    ) -> Entry:
        """An entry with the current time."""
        return Entry(
            time=datetime.now(timezone.utc).isoformat(timespec="milliseconds"),
            model=model,
            seed=seed,
            cost=cost,
            seconds=round(seconds, 3),
            rejected=rejected,
            **vars(usage),
        )


class Ledger:
    """Adds up what a run spends and checks it against the budget.

    The file is authoritative: every entry counts, also those of earlier processes and of other
    processes that write to it now. The limits are checked before each try of a request, so only
    tries under way can exceed them. A charge for a request that the server never began to answer is
    unknown and not included.

    Without :meth:`open` the ledger counts this process alone.

    Args:
        budget: the limits.
        prices: the prices for the costs.

    Raises:
        ValueError: the budget limits dollars, and there are no prices.
    """

    def __init__(self, budget: Budget, prices: Prices) -> None:
        if budget.max_usd is not None and not (prices.prompt or prices.completion):
            raise ValueError(
                "--max-usd needs prices: give prices.prompt and prices.completion, US dollars "
                "for a million tokens, or use --max-tokens"
            )
        self._budget = budget
        self._lock = threading.Lock()
        self._spent = Spent()
        self._lines: JsonLines | None = None

    def open(self, path: Path) -> None:
        """Keep the ledger in a file.

        Args:
            path: JSON lines, one :class:`Entry` each; the file is created if it does not exist.

        Raises:
            ValueError: the path is a link.
            OSError: the file cannot be written.
        """
        self._lines = JsonLines(path)

    @property
    def spent(self) -> Spent:
        """The sum of all entries; after :meth:`close`, the sum at that time."""
        with self._lock:
            for line in self._lines.new() if self._lines is not None else ():
                try:
                    self._spent = _with(self._spent, Entry.model_validate_json(line))
                except ValidationError:
                    continue  # a half-written line
            return self._spent

    def check(self) -> None:
        """Raise CannotGoOn if the budget is spent."""
        budget, spent = self._budget, self.spent
        most = "at most " if spent.usage.estimated else ""
        if budget.max_usd is not None and spent.cost >= budget.max_usd:
            raise CannotGoOn(
                f"the budget is spent: {most}${spent.cost:.2f} of ${budget.max_usd:.2f}; raise "
                f"--max-usd and {AGAIN}{_why(spent)}"
            )
        if budget.max_tokens is not None and spent.usage.total >= budget.max_tokens:
            raise CannotGoOn(
                f"the budget is spent: {most}{spent.usage.total:,} of {budget.max_tokens:,} "
                f"tokens; raise --max-tokens and {AGAIN}{_why(spent)}"
            )

    def enter(self, entry: Entry) -> None:
        """Add an entry.

        Raises:
            CannotGoOn: the file cannot be written.
        """
        if self._lines is None:
            with self._lock:
                self._spent = _with(self._spent, entry)
            return
        try:
            self._lines.add(entry.model_dump_json())
        except OSError as error:
            raise CannotGoOn(
                f"{self._lines.path} cannot be written ({error.strerror}), so that nobody would "
                f"know what is spent; see to that and {AGAIN}"
            ) from error

    def close(self) -> None:
        """Close the file."""
        _ = self.spent
        if self._lines is not None:
            self._lines.close()


class MeteredClient:
    """Wraps a client that keeps no ledger itself, and adds one entry per reply.

    Args:
        client: the client to wrap.
        ledger: the run's ledger.
        supervisor: the run's request supervisor.
    """

    def __init__(
        self, client: CacheableClient, ledger: Ledger, supervisor: RequestSupervisor
    ) -> None:
        self._client, self._ledger, self._supervisor = client, ledger, supervisor

    @property
    def identity(self) -> str:
        """The wrapped client's identity."""
        return self._client.identity

    def reply(self, messages: Sequence[Message], seed: int) -> Reply:
        """The next turn, as :class:`agents.vlm.chat.Client` has it.

        Raises:
            CannotGoOn: the budget is spent, or the ledger cannot be written.
        """
        self._supervisor.request(seed).left()
        self._ledger.check()
        reply = self._client.reply(messages, seed)
        if not reply.from_cache:
            self._ledger.enter(
                Entry.of(
                    reply.usage,
                    model=reply.model,
                    seed=seed,
                    cost=reply.cost,
                    seconds=reply.seconds,
                )
            )
        return reply

    def close(self) -> None:
        """Close the wrapped client."""
        self._client.close()


def _why(spent: Spent) -> str:
    """The note that the sum holds upper bounds; "" if it does not."""
    why = " (where the server's count is missing or cannot be true, upper bounds stand for it)"
    return why if spent.usage.estimated else ""


def _with(spent: Spent, entry: Entry) -> Spent:
    usage = Usage(entry.prompt, entry.completion, entry.cached, entry.reasoning, entry.estimated)
    return Spent(spent.usage + usage, spent.cost + entry.cost, spent.requests + 1)
