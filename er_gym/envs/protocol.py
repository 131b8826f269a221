"""Protocols: by which rules an episode is played. Each is a row of :data:`PROTOCOLS`.

``default`` is this suite's own. ``paper`` is that of the evaluation program of Embodied-Reasoner
(arXiv 2503.21696), rule by rule, so that numbers stand beside the paper's table; docs/agents.md
lists what differs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from er_gym.envs.action_handler import ActionHandler, DefaultActionHandler, EpisodeSetup
from er_gym.envs.actions import Action, AnyAction, understand
from er_gym.envs.arguments import one_of
from er_gym.envs.paper_action_handler import PaperActionHandler, understand_as_paper
from er_gym.envs.paper_approach import start_in_corner
from er_gym.envs.skills import Reachable, start_pose
from er_gym.tasks.task import AgentPose
from er_gym.tasks.verbs import END
from er_gym.thor import ObjectTable


@dataclass(frozen=True)
class EpisodeProtocol:
    """The rules of an episode.

    Attributes:
        name: as ``--protocol`` and ``EmbodiedEnv(protocol=…)`` take it.
        understand: the action that is meant, None if none is; and its text.
        action_handler: how actions are judged and carried out in an episode.
        start: where an episode begins, given the scene's bounds and where the agent can stand.
        chooses_instances: whether it decides itself which object a type name stands for.
        unknown_breaks_runs: whether a reply that names no action comes between two same actions.
        repeated: what the fourth same action in a row is recorded as; None for itself.
        end_is_step: whether ``end`` counts towards the step limit.
        appends_end: whether an episode that is cut off, by the step limit or by three replies that
            name no action, is ended by a successful ``end``.
    """

    name: str
    understand: Callable[[AnyAction, ObjectTable], tuple[Action | None, str]]
    action_handler: Callable[[EpisodeSetup], ActionHandler]
    start: Callable[[Mapping[str, Any], Reachable], AgentPose]
    chooses_instances: bool = False
    unknown_breaks_runs: bool = False
    repeated: Action | None = None
    end_is_step: bool = True
    appends_end: bool = False


DEFAULT = EpisodeProtocol(
    name="default",
    understand=lambda action, _: understand(action),
    action_handler=DefaultActionHandler,
    start=start_pose,
)
PAPER = EpisodeProtocol(
    name="paper",
    understand=understand_as_paper,
    action_handler=PaperActionHandler,
    start=start_in_corner,
    chooses_instances=True,
    unknown_breaks_runs=True,
    repeated=Action(END),
    end_is_step=False,
    appends_end=True,
)
PROTOCOLS = {protocol.name: protocol for protocol in (DEFAULT, PAPER)}


def protocol_named(name: str) -> EpisodeProtocol:
    """Look a protocol up.

    Raises:
        ValueError: there is none of that name; the message lists those there are.
    """
    return PROTOCOLS[one_of("protocol", name, PROTOCOLS)]
