"""The options of ``er-gym data verify`` for a model that reads thoughts, and what it does."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from itertools import islice
from typing import TYPE_CHECKING

from benchmarks.cli.errors import BadInput, bad_input
from benchmarks.cli.options import OptionGroup, Words, option
from benchmarks.cli.vlm_options import VLMOptions

if TYPE_CHECKING:
    from er_gym.data.collection import Collection

_CONFIG = "expert"
"""The settings that er-gym collect has for a model that writes thoughts: the same questions are
then answered from the same cache."""


@dataclass(frozen=True)
class CriticOptions(OptionGroup):
    """The option of a model that reads thoughts."""

    critic: str | None = option(
        type=Words(),
        metavar="CLIENT:MODEL",
        help="Let a model check what the critic's rules leave open in the thoughts: openai:MODEL, "
        "hf:PATH. Its replies and their cost are kept in DIR. The options from --agent-config on "
        "are for it.",
    )


def refuse_without_critic(options: CriticOptions, vlm: VLMOptions) -> None:
    """Refuse options that are for a model, if there is none.

    Raises:
        BadInput: there are such options.
    """
    if options.critic is None and vlm.given:
        raise BadInput(f"{vlm.given[0]} is for a model: give --critic, such as openai:MODEL")
    if vlm.prompts_from is not None:
        raise BadInput("--prompts-from is for a model that plays; leave it out")


def read_thoughts(
    collection: Collection,
    options: CriticOptions,
    vlm: VLMOptions,
    limit: int | None,
    say: Callable[[object], None],
) -> Iterator[tuple[str, str]]:
    """The id of a trajectory and an objection of the model, for each; at last ``""`` and how much
    was read.

    Raises:
        BadInput: a setting does not fit, or the model cannot be asked.
        CannotGoOn: it cannot be asked any more; the same command continues from its replies.
    """
    from agents.expert.reading import objections
    from agents.expert.writers.reader import Critic, reader_settings
    from er_gym.rollout.agent import CannotGoOn

    assert options.critic is not None
    with bad_input(CannotGoOn):
        run = replace(vlm, agent_config=vlm.agent_config or _CONFIG).run(options.critic)
        session = replace(run, settings=reader_settings(run.settings)).session(collection.path)
    session.supervisor.show = say
    with closing(session):
        critic = Critic(session.client)
        trajectories = islice(collection.trajectories(), limit)
        yield from objections(trajectories, critic, run.concurrency)
        yield "", "\n".join(map(str, filter(None, (critic.counts, session.cost))))
