"""Protocols: the rules of an episode. Each protocol is a row of :data:`PROTOCOLS`.

``default`` is er-gym's own. ``paper`` follows the evaluation program of Embodied-Reasoner (arXiv
2503.21696) rule by rule, so that its numbers compare with the paper's table. docs/agents.md lists
the differences.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from er_gym.envs.action_handler import ActionHandler, DefaultActionHandler, EpisodeSetup
from er_gym.envs.actions import Action, AnyAction, parse_action
from er_gym.envs.arguments import one_of
from er_gym.envs.paper_action_handler import PaperActionHandler, parse_action_as_paper
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
        parse_action: returns the action that a reply means (None if it means none), and its text.
        action_handler: makes the handler that judges and carries out an episode's actions.
        start: returns the start pose, given ``sceneBounds`` and the reachable positions.
        chooses_instances: whether the protocol decides which object a type name stands for.
        unknown_breaks_runs: whether a reply that names no action interrupts a row of same actions.
        repeated: how the fourth same action in a row is recorded; None for the action itself.
        end_is_step: whether ``end`` counts towards the step limit.
        appends_end: whether a successful ``end`` is appended to an episode that the step limit, or
            the third reply that names no action, has cut off.
    """

    name: str
    parse_action: Callable[[AnyAction, ObjectTable], tuple[Action | None, str]]
    action_handler: Callable[[EpisodeSetup], ActionHandler]
    start: Callable[[Mapping[str, Any], Reachable], AgentPose]
    chooses_instances: bool = False
    unknown_breaks_runs: bool = False
    repeated: Action | None = None
    end_is_step: bool = True
    appends_end: bool = False


DEFAULT = EpisodeProtocol(
    name="default",
    parse_action=lambda action, _: parse_action(action),
    action_handler=DefaultActionHandler,
    start=start_pose,
)
PAPER = EpisodeProtocol(
    name="paper",
    parse_action=parse_action_as_paper,
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
    """The protocol of a name.

    Raises:
        ValueError: the name is unknown; the message lists the known names.
    """
    return PROTOCOLS[one_of("protocol", name, PROTOCOLS)]
