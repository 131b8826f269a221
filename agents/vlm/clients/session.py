"""A model client with what its run needs: the ledger, the supervisor and the reply cache."""

from __future__ import annotations

import contextlib
import threading
from pathlib import Path
from typing import TYPE_CHECKING

from agents.vlm.chat import Client
from agents.vlm.clients.registry import resolve_client
from agents.vlm.settings import AgentSettings, Prices
from er_gym.extras import MissingPackage
from er_gym.rollout.events import Cost
from er_gym.rollout.run_directory import REPLIES, SERVER_EVENTS, SPENDING

if TYPE_CHECKING:
    from agents.vlm.clients.budget import Budget
    from agents.vlm.clients.supervisor import ServerEvent
    from er_gym.rollout.json_lines import JsonLines


class ModelSession:
    """Asks one model on behalf of a run; all its threads share one session.

    Attributes:
        name: the client's name and what it opens.
        client: the model's client.
        supervisor: supervises the run's requests; ``supervisor.show`` is called with each event
            that the user should see.

    Args:
        name: such as ``openai:MODEL`` (:data:`agents.vlm.clients.registry.CLIENTS`).
        settings: of the client.
        directory: holds the reply cache, the ledger and the server events. Without a directory
            nothing is stored.
        budget: what the run may spend.

    Raises:
        ValueError: the name belongs to no client, a package is missing, or the directory's ledger
            is a link.
        CannotGoOn: there is no key, or the model cannot be loaded.
    """

    def __init__(
        self,
        name: str,
        settings: AgentSettings,
        directory: Path | None = None,
        budget: Budget | None = None,
    ) -> None:
        kind, opened = resolve_client(name)
        self.name = name
        self._events: JsonLines | None = None
        self._keeping = threading.Lock()
        self._directory = directory
        self._beside: list[Client] = []
        try:
            from agents.vlm.clients.budget import Budget, Ledger
            from agents.vlm.clients.supervisor import RequestSupervisor

            asked = budget or Budget()
            self.supervisor = RequestSupervisor(asked.max_minutes)
            self._ledger = Ledger(asked, settings.prices if kind.priced else Prices())
            client = kind.open(opened, settings, self._ledger, self.supervisor)
            self.client: Client = client
            if directory is not None:
                from agents.vlm.clients.reply_cache import ReplyCache

                self._ledger.open(directory / SPENDING)
                self.supervisor.log_event = self._keep
                self.client = ReplyCache(client, directory / REPLIES)
        except ImportError as error:
            raise MissingPackage(name, str(error.name), kind.install) from error

    def beside(self, name: str, settings: AgentSettings) -> Client:
        """Another model's client, with this session's ledger, reply cache and supervisor.

        Its replies cost what the session's own settings state, and count against the same budget.

        Args:
            name, settings: as the session itself takes them.

        Raises:
            ValueError: the name belongs to no client, or a package is missing.
            CannotGoOn: there is no key, or the model cannot be loaded.
        """
        kind, opened = resolve_client(name)
        try:
            client = kind.open(opened, settings, self._ledger, self.supervisor)
            found: Client = client
            if self._directory is not None:
                from agents.vlm.clients.reply_cache import ReplyCache

                found = ReplyCache(client, self._directory / REPLIES)
        except ImportError as error:
            raise MissingPackage(name, str(error.name), kind.install) from error
        self._beside.append(found)
        return found

    @property
    def cost(self) -> Cost | None:
        """The cost of the run so far; None without a directory."""
        if self._directory is None:
            return None
        spent = self._ledger.spent
        return Cost(
            requests=spent.requests,
            tokens=spent.usage.total,
            cost=spent.cost,
            estimated=spent.usage.estimated,
        )

    def close(self) -> None:
        """Close the client, the ledger and the event log."""
        for client in (*self._beside, self.client):
            client.close()
        self._ledger.close()
        if self._events is not None:
            self._events.close()

    def _keep(self, server_event: ServerEvent) -> None:
        """Append an event to the log; the first event creates the file."""
        from er_gym.rollout.json_lines import JsonLines

        assert self._directory is not None
        # A full disk is reported where it loses data that matters.
        with contextlib.suppress(OSError, ValueError), self._keeping:
            self._events = self._events or JsonLines(self._directory / SERVER_EVENTS)
            self._events.add(server_event.model_dump_json())
