"""The registry of model clients, by the prefix of an agent's name.

An agent ``openai:MODEL`` is the VLM agent with the client ``openai``; a language model of the zoo,
``zoo:NAME``, is one with the client ``hf``. A client is a row of
:data:`CLIENTS`; other packages add rows with an entry point in the group ``er_gym.model_clients``,
or name one as ``package.module:ROW:MODEL``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from agents.vlm.tuned_model import agent_file
from agents.zoo.index import resolved
from er_gym.activity import begin_import
from er_gym.plugins import PluginError, Registry, is_dotted

if TYPE_CHECKING:
    from agents.vlm.clients.budget import Ledger
    from agents.vlm.clients.reply_cache import CacheableClient
    from agents.vlm.clients.supervisor import RequestSupervisor
    from agents.vlm.settings import AgentSettings


@dataclass(frozen=True, kw_only=True)
class ModelClientSpec:
    """A kind of model client.

    Attributes:
        make: makes the client from the text after the prefix, the agent's settings, and the run's
            ledger and supervisor. A client has ``reply`` and ``close``
            (:class:`agents.vlm.chat.Client`)
            and ``identity``, a text that is the same for clients that reply alike.
        opens: what follows the prefix, for messages: ``"MODEL"``.
        help: a short description.
        settings: the file with the settings of an agent that a model was tuned for, None if there
            is none; given the text after the prefix.
        install: what to install when a package is missing.
        priced: whether a reply costs what the settings' ``prices`` state.
        keeps_ledger: whether the client checks the budget and writes the ledger itself.
    """

    make: Callable[[str, AgentSettings, Ledger, RequestSupervisor], CacheableClient]
    opens: str
    help: str
    settings: Callable[[str], Path | None] = lambda opened: None
    install: str = "er-gym[vlm]"
    priced: bool = False
    keeps_ledger: bool = False

    def open(
        self, what: str, settings: AgentSettings, ledger: Ledger, supervisor: RequestSupervisor
    ) -> CacheableClient:
        """Make the client; its replies are entered into the run's ledger."""
        client = self.make(what, settings, ledger, supervisor)
        if self.keeps_ledger:
            return client
        from agents.vlm.clients.budget import MeteredClient

        return MeteredClient(client, ledger, supervisor)


def _openai(
    model: str, settings: AgentSettings, ledger: Ledger, supervisor: RequestSupervisor
) -> CacheableClient:
    from agents.vlm.clients.openai_server import OpenAIClient

    return OpenAIClient(model, settings, ledger, supervisor)


def _local(
    path: str, settings: AgentSettings, ledger: Ledger, supervisor: RequestSupervisor
) -> CacheableClient:
    if settings.local.actors:
        from agents.vlm.clients.model_actors import ModelActors

        return ModelActors(path, settings, supervisor)
    begin_import("PyTorch and transformers", "torch", "transformers")
    from agents.vlm.clients.local import LocalClient

    return LocalClient(path, settings, supervisor)


def _recorded(
    path: str, settings: AgentSettings, ledger: Ledger, supervisor: RequestSupervisor
) -> CacheableClient:
    from agents.vlm.clients.scripted import RecordedClient

    return RecordedClient(Path(path))


CLIENTS: Registry[ModelClientSpec] = Registry(
    kind="model client",
    group="er_gym.model_clients",
    own={
        "openai": ModelClientSpec(
            opens="MODEL",
            help="a model on an OpenAI-compatible server",
            make=_openai,
            priced=True,
            keeps_ledger=True,
        ),
        "hf": ModelClientSpec(
            opens="PATH",
            help="a transformers model in this process, or on a Ray cluster",
            make=_local,
            settings=agent_file,
            install="er-gym[local]",
        ),
        "recorded": ModelClientSpec(
            opens="RUN", help="the recorded replies of an earlier run", make=_recorded
        ),
    },
    expected=f"an {__name__}.ModelClientSpec",
    fits=lambda row: isinstance(row, ModelClientSpec),
)
"""Model clients by name."""


def _split(name: str) -> tuple[str, str]:
    """The client's name and what it opens; ("", "") if the name belongs to no client."""
    client, colon, opened = resolved(name).partition(":")
    if colon and client not in CLIENTS.names() and is_dotted(client + ":" + opened.split(":")[0]):
        attribute, colon, opened = opened.partition(":")
        client = f"{client}:{attribute}"
        return (client, opened) if colon and opened else ("", "")
    return (client, opened) if opened and client in CLIENTS.names() else ("", "")


def is_model_agent(name: str) -> bool:
    """Whether an agent of this name gets its replies from a model client: ``openai:MODEL``.

    Raises:
        ValueError: the zoo has no model of the name ``zoo:NAME``.
    """
    return bool(_split(name)[0])


def resolve_client(name: str) -> tuple[ModelClientSpec, str]:
    """The client of an agent's name, and what the client opens.

    Raises:
        PluginError: the name belongs to no client, or the client cannot be loaded.
    """
    client, opened = _split(name)
    if not client:
        raise PluginError(f"{name!r} is not a model agent; give {agent_name_forms()}")
    return CLIENTS.get(client), opened


def settings_file(name: str) -> Path | None:
    """The file with the settings that the model of an agent was tuned for; None if there is none.

    Args:
        name: the agent's, such as ``hf:DIRECTORY``.

    Raises:
        PluginError: the name belongs to no client, or the client cannot be loaded.
        ValueError: the model cannot be used yet.
    """
    client, opened = resolve_client(name)
    return client.settings(opened)


def agent_name_forms() -> str:
    """The forms of model agents' names, for messages."""
    *most, last = (f"{name}:{row.opens}" for name, row in CLIENTS.own.items())
    return f"{', '.join(most)} or {last}"
