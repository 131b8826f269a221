"""The options of ``er-gym collect`` for a model, and the players that they ask for."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from benchmarks.cli.errors import BadInput, bad_input
from benchmarks.cli.options import OptionGroup, Words, option
from benchmarks.cli.vlm_options import VLMOptions

if TYPE_CHECKING:
    from agents.expert.players import Players
    from agents.expert.writers.reader import Critic
    from benchmarks.vlm_run import VLMRun
    from er_gym.data.trajectory import Language
    from er_gym.rollout.events import Cost

_CONFIG = "expert"
"""The settings of a model that writes thoughts, unless ``--agent-config`` names others."""


@dataclass(frozen=True)
class ExpertOptions(OptionGroup):
    """The options of a model that writes thoughts, names places, or decides."""

    expert: str | None = option(
        type=Words(),
        metavar="CLIENT:MODEL",
        help="A model that writes the thoughts: openai:MODEL, hf:PATH. The options from "
        "--agent-config on are for it.",
    )
    places: str | None = option(
        type=click.Choice(["likely", "model"]),
        help="How the wrong places of a search are chosen: drawn by likelihood, or named by the "
        "model.  [default: likely]",
    )
    decisions: str | None = option(
        type=click.Choice(["plan", "model"]),
        help="Who decides the actions: the expert's plan; or the model, whose successful episodes "
        "are kept.  [default: plan]",
    )
    hint: str | None = option(
        type=click.Choice(["none", "plan"]),
        help="With --decisions model: the hint that the model gets beside the task.  "
        "[default: none]",
    )
    strict_thoughts: bool = option(
        is_flag=True,
        help="With --decisions model or --select: take only episodes all of whose thoughts the "
        "critic accepts.",
    )

    critic: str | None = option(
        type=Words(),
        metavar="CLIENT:MODEL",
        help="With --expert: a model that checks what the critic's rules leave open in the "
        "thoughts: openai:MODEL, hf:PATH. Settings, servers and budget are those of --expert.",
    )

    @property
    def decides(self) -> bool:
        """Whether the model decides every action."""
        return self.decisions == "model"


@dataclass(frozen=True)
class ExpertRun:
    """A model that takes part in a collection.

    Attributes:
        options: of the command line.
        run: the model, its settings and its budget.
        language: of the thoughts.
    """

    options: ExpertOptions
    run: VLMRun
    language: Language

    @staticmethod
    def of(options: ExpertOptions, vlm: VLMOptions, language: Language) -> ExpertRun | None:
        """From the options; None if no model takes part.

        Raises:
            BadInput: options do not fit together.
            ValueError: a setting does not fit.
        """
        if options.expert is None:
            _refuse_without_model(options, vlm)
            return None
        from agents.expert.writers.model import check_settings
        from agents.vlm.clients.budget import Ledger
        from agents.vlm.clients.registry import resolve_client

        kind, _ = resolve_client(options.expert)
        if options.critic is not None:
            resolve_client(options.critic)
        _refuse_misfits(options, vlm, options.expert)
        if not options.decides:
            vlm = replace(vlm, agent_config=vlm.agent_config or _CONFIG)
        run = vlm.run(options.expert)
        prompts = run.settings.prompts.model_copy(update={"language": language})
        run = replace(run, settings=run.settings.model_copy(update={"prompts": prompts}))
        if not options.decides:
            check_settings(run.settings)
        if kind.priced:
            Ledger(run.budget, run.settings.prices)  # says whether prices are missing
        return ExpertRun(options, run, language)

    @property
    def stated(self) -> dict[str, Any]:
        """What the collection's manifest states of it; no secrets."""
        from agents.expert.writers.prompts import load_writer_prompts
        from agents.factory import comparable_settings

        own = load_writer_prompts(self.language, self._profile).digest
        options = self.options
        stated: dict[str, Any] = {"name": self.run.name, "decisions": options.decisions or "plan"}
        if options.decides:
            hint = options.hint or "none"
            more = {} if hint == "none" else {"hint_digest": own}
            return {
                **stated,
                **more,
                "hint": hint,
                "strict_thoughts": options.strict_thoughts,
                "settings": self.run.comparable_settings,
            }
        if options.critic is not None:
            from agents.expert.writers.reader import load_reader_prompts

            reads = {"name": options.critic, "prompts_digest": load_reader_prompts().digest}
            stated["critic"] = reads
        return {
            **stated,
            "places": options.places or "likely",
            "settings": comparable_settings(self.run.settings, own),
        }

    @property
    def _profile(self) -> str:
        """The prompts of a model that writes thoughts. One that decides is told those of an agent,
        and er-gym's own hint.
        """
        from agents.expert.writers.prompts import OWN_PROFILE
        from agents.vlm.settings import Prompts

        stated = self.run.settings.prompts.profile
        own = self.options.decides or stated == Prompts().profile
        return OWN_PROFILE if own else stated

    @property
    def env(self) -> Mapping[str, Any]:
        """The environment's arguments that the settings ask for."""
        return {name: value for name, value in self.run.env.items() if name != "obs_mode"}

    @contextmanager
    def players(
        self, directory: Path, say: Callable[[object], None]
    ) -> Iterator[tuple[Players, Callable[[], Cost | None], Callable[[], str]]]:
        """Who plays, and functions that say what that has cost, and what the critic has read.

        Args:
            directory: of the collection; it keeps replies and bills.
            say: hears, from any thread, what the user should know of the server.
        """
        from agents.expert.writers.prompts import load_writer_prompts
        from er_gym.rollout.agent import CannotGoOn

        prompts, options = load_writer_prompts(self.language, self._profile), self.options
        opens = self.run.factory if options.decides else self.run.session
        with bad_input(CannotGoOn):  # no key, no such model
            asked: Any = opens(directory)
        asked.supervisor.show = say
        with closing(asked):
            if options.decides:
                from agents.expert.decider import Deciders

                hint = options.hint == "plan"
                yield (
                    Deciders(asked, prompts, hint, options.strict_thoughts),
                    lambda: asked.cost,
                    str,
                )
                return
            critic = self._critic(asked)
            yield (
                self._thinkers(asked, prompts, critic),
                lambda: asked.cost,
                lambda: str(critic.counts),
            )

    def _critic(self, session: Any) -> Critic:
        from agents.expert.writers.reader import Critic, reader_settings
        from er_gym.rollout.agent import CannotGoOn

        name = self.options.critic
        if name is None:
            return Critic()
        with bad_input(CannotGoOn):
            return Critic(session.beside(name, reader_settings(self.run.settings)))

    def _thinkers(self, session: Any, prompts: Any, critic: Critic) -> Players:
        from agents.expert.model_places import ModelPlaces
        from agents.expert.players import Thinkers
        from agents.expert.writers.model import ModelWriter

        writer = ModelWriter(
            session.name, session.client, self.run.settings, prompts, critic=critic
        )
        if self.options.places == "model":
            # A prescreening does not know which places the model will name.
            return Thinkers(
                lambda: writer,
                lambda seed: ModelPlaces(session.client, prompts, seed),
                think_later=True,
            )
        return Thinkers(lambda: writer)


def _refuse_without_model(options: ExpertOptions, vlm: VLMOptions) -> None:
    given = [
        *(["--places model"] if options.places == "model" else ()),
        *(["--decisions model"] if options.decides else ()),
        *([f"--critic {options.critic}"] if options.critic else ()),
        *(flag for flag in options.given if flag in ("--hint", "--strict-thoughts")),
        *vlm.given,
    ]
    if given:
        raise BadInput(f"{given[0]} is for a model: give --expert, such as --expert openai:MODEL")


def _refuse_misfits(options: ExpertOptions, vlm: VLMOptions, name: str) -> None:
    if options.decides:
        if options.places:
            raise BadInput("--places is for --decisions plan: a model that decides has no plan")
        if options.critic:
            raise BadInput(
                "--critic is for --decisions plan; er-gym data verify --critic reads the thoughts "
                "of a model that decides"
            )
        return
    alone = [
        *([f"--hint {options.hint}"] if options.hint else ()),
        *(["--strict-thoughts"] if options.strict_thoughts else ()),
        *(["--prompts-from"] if vlm.prompts_from else ()),
        *([f"--expert {name}"] if name.startswith("recorded:") else ()),
    ]
    if alone:
        raise BadInput(f"{alone[0]} is for a model that decides: give --decisions model, too")
