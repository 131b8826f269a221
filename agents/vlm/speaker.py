"""What all the agents of a run share that speak: a model's client, prompts, a matcher of names."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from agents import configs
from agents.vlm.chat import Client
from agents.vlm.settings import AgentSettings

if TYPE_CHECKING:
    from agents.vlm.agent import VLMAgent
    from agents.vlm.clients.budget import Budget, Metered

_WHAT = "agent"
SPENDING = "spending.jsonl"
REPLIES = "replies"
_OF_NO_CONSEQUENCE: Mapping[str, Any] = {
    "server": {"base_url", "key_from", "timeout", "tries", "requests_per_minute"},
    "local": {"device_map", "batch", "wait"},
    "prompts": {"dataset"},
    "prices": True,
}
"""Settings that change when and where a model answers, and not what it says. Prompts are known by
their digest."""


def _openai(model: str, settings: AgentSettings) -> Client:
    from agents.vlm.clients.openai_server import OpenAIClient

    return OpenAIClient(model, settings)


def _local(path: str, settings: AgentSettings) -> Client:
    from agents.vlm.clients.local import LocalClient

    return LocalClient(path, settings)


def _recorded(path: str, settings: AgentSettings) -> Client:
    from agents.vlm.clients.scripted import RecordedClient

    return RecordedClient(Path(path))


CLIENTS: Mapping[str, Callable[[str, AgentSettings], Client]] = {
    "openai": _openai,
    "hf": _local,
    "recorded": _recorded,
}
"""By what the name of an agent begins with, before the colon: how its client is made of the rest
and the settings."""


def speaks(name: str) -> bool:
    """Whether an agent of this name is one that speaks, such as ``openai:MODEL``."""
    kind, colon, rest = name.partition(":")
    return kind in CLIENTS and bool(colon and rest)


def load_settings(name: str | None, overrides: Sequence[str] = ()) -> AgentSettings:
    """The settings of an agent: a file of ``configs/agents`` by name, or any by path.

    Raises:
        ValueError: there is no such file, or it does not fit, or an override does not.
    """
    file = configs.file_of("agents", name, _WHAT) if name else None
    return configs.load(AgentSettings, file, _WHAT, overrides)


class Speaker:
    """Makes the agents of a run.

    Args:
        name: ``openai:MODEL``, ``hf:PATH`` or ``recorded:RUN``.
        settings: of the agent.
        directory: where replies are kept, so that none is paid for twice, and what has been spent;
            without it, nothing is kept.
        budget: what may be spent.

    Raises:
        ValueError: the name, the prompts or the matcher's model are not there, or packages are
            missing.
        CannotGoOn: there is no key, or the model cannot be loaded.
    """

    def __init__(
        self,
        name: str,
        settings: AgentSettings,
        directory: Path | None = None,
        budget: Budget | None = None,
    ) -> None:
        from agents.vlm.matching import Matcher
        from agents.vlm.prompts import load_prompts

        if not speaks(name):
            raise ValueError(f"{name!r} is no agent that speaks; give {ways_to_name()}")
        self.name, self.settings = name, settings
        self.prompts = load_prompts(settings.prompts)
        self._matcher = Matcher(settings.matching)
        self._matcher.prepare()
        kind, _, rest = name.partition(":")
        self._metered: Metered | None = None
        try:
            self._client = CLIENTS[kind](rest, settings)
            if directory is not None:
                from agents.vlm.clients import budget as budgets
                from agents.vlm.clients.kept import Kept

                asked = budget or budgets.Budget()
                self._metered = budgets.Metered(self._client, asked, directory / SPENDING)
                self._client = Kept(self._metered, directory / REPLIES)
        except ImportError as error:
            extra = "local" if kind == "hf" else "vlm"
            raise ValueError(
                f"agent {name} needs {error.name}, which is not installed: "
                f"pip install 'er-gym[{extra}]'"
            ) from error

    def agent(self, seed: int) -> VLMAgent:
        """An agent for an episode."""
        from agents.vlm.agent import VLMAgent

        return VLMAgent(
            self._client, self.settings, self.prompts, self._matcher, seed=seed, name=self.name
        )

    @property
    def spent(self) -> str:
        """What the run has cost so far, for people; "" where nothing is written down."""
        if self._metered is None:
            return ""
        spent = self._metered.spent
        words = f"{spent.usage.total:,} tokens in {spent.requests:,} replies"
        return f"{words}, ${spent.cost:.2f}" if spent.cost else words

    def close(self) -> None:
        """Let go of the client."""
        self._client.close()


def ways_to_name() -> str:
    """How agents that speak are named, for messages."""
    return "openai:MODEL, hf:PATH or recorded:RUN"


def consequential(settings: AgentSettings, prompts_digest: str) -> dict[str, Any]:
    """What of the settings decides what an agent says: two runs compare if theirs are equal."""
    kept = settings.model_dump(mode="json", exclude=dict(_OF_NO_CONSEQUENCE))
    return {**kept, "prompts_digest": prompts_digest}
