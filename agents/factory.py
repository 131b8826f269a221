"""What all model agents of a run share: the model's client, the prompts and the name matcher."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from agents import configs
from agents.vlm.clients.registry import (
    agent_name_forms,
    is_model_agent,
    resolve_client,
    settings_file,
)
from agents.vlm.clients.session import ModelSession
from agents.vlm.record import without_secrets
from agents.vlm.settings import AgentSettings
from er_gym.extras import MissingPackage

if TYPE_CHECKING:
    from agents.vlm.agent import VLMAgent
    from agents.vlm.clients.budget import Budget

__all__ = [
    "AgentFactory",
    "agent_name_forms",
    "comparable_settings",
    "is_model_agent",
    "load_settings",
    "settings_file",
]

_WHAT = "agent"
_NOT_COMPARED: Mapping[str, Any] = {
    "server": {"base_url", "key_from", "timeout", "connect", "tries", "requests_per_minute"},
    "local": {"device_map", "batch", "wait", "reuse", "actors", "actor_gpus", "actor_cpus"},
    "prompts": {"dataset", "dialect"},
    "prices": True,
}
"""Settings that change when and where a model answers, but not its replies. The digest stands for
the prompts."""

_ADDED: Sequence[tuple[str, str, Any]] = (
    ("pictures", "model_min_pixels", None),
    ("pictures", "model_max_pixels", None),
    ("pictures", "noise", False),
    ("history", "trim", None),
)
"""Settings that older versions did not have, with what those did."""


def load_settings(
    name: str | None, overrides: Sequence[str] = (), beneath: Path | None = None
) -> AgentSettings:
    """Read an agent's settings from a file of ``configs/agents`` by name, or from any file by path.

    Args:
        name: of the file; None for none.
        overrides: see :func:`agents.configs.load`.
        beneath: a file whose settings hold where the first does not state them
            (:func:`agents.vlm.clients.registry.settings_file`).

    Raises:
        ValueError: the file does not exist, or a file or an override is invalid.
    """
    file = configs.file_of("agents", name, _WHAT) if name else None
    if beneath is not None:
        configs.load(AgentSettings, beneath, _WHAT)  # so that an error in it names it
    return configs.load(AgentSettings, file, _WHAT, overrides, beneath=beneath)


class AgentFactory(ModelSession):
    """Makes the model agents of a run: a session with its prompts and its name matcher.

    Attributes and arguments are those of :class:`~agents.vlm.clients.session.ModelSession`.

    Raises:
        ValueError: as there; or the prompts or the matcher's model do not exist.
        CannotGoOn: as there.
    """

    def __init__(
        self,
        name: str,
        settings: AgentSettings,
        directory: Path | None = None,
        budget: Budget | None = None,
    ) -> None:
        from agents.vlm.matching import Matcher
        from agents.vlm.prompts import prompts_for

        kind, _ = resolve_client(name)  # a wrong name is told before a wrong prompt
        self.settings = settings
        try:
            self.prompts = prompts_for(settings)
            self._matcher = Matcher(settings.matching)
            self._matcher.prepare()
        except MissingPackage as error:  # its extra would not be enough for every client
            raise MissingPackage(name, error.package, kind.install) from error
        super().__init__(name, settings, directory, budget)

    def agent(self, seed: int, name: str = "") -> VLMAgent:
        """An agent for an episode; ``name`` is how its conversation names it, where that is not
        the factory's."""
        from agents.vlm.agent import VLMAgent

        return VLMAgent(
            self.client,
            self.settings,
            self.prompts,
            self._matcher,
            seed=seed,
            name=name or self.name,
        )


def comparable_settings(settings: AgentSettings, prompts_digest: str) -> dict[str, Any]:
    """The settings that decide an agent's replies. Two runs are comparable if these are equal."""
    kept = settings.model_dump(mode="json", exclude=dict(_NOT_COMPARED))
    for group, name, before in _ADDED:  # so that older runs, without them, can be continued
        if kept[group][name] is before:
            del kept[group][name]
            if not kept[group]:
                del kept[group]
    return {**without_secrets(settings, kept), "prompts_digest": prompts_digest}
