"""``er-gym collect --select RUN``: its options, and what becomes of the episodes of the runs."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from benchmarks.cli.collect_choice import source_of
from benchmarks.cli.errors import BadInput
from benchmarks.cli.options import EXISTING_FOLDER, OptionGroup, option

if TYPE_CHECKING:
    from agents.expert.collect import Stratum
    from agents.expert.players import Players
    from agents.expert.recipe import Recipe
    from agents.expert.selection import Screening, SelectionRules, TypeYield
    from agents.expert.writers.registry import NamedWriter
    from er_gym.data.collection import Collection
    from er_gym.rollout.run_directory import RunDirectory
    from er_gym.tables import Table
    from er_gym.tasks.suites import Suite
    from er_gym.tasks.task import Task

YIELD = "yield.json"
_OF_THE_AGENT = ("obs_mode", "width", "height")
"""Arguments of the environment that change what an agent saw, but not what it did."""
_DEFAULT_BALANCE = "30"
"""As in ``agents.expert.selection``, which is slow to import for ``--help``; a test compares."""
_DEFAULT_MOST_ACTIONS = 36
"""The same."""


class Balance(click.ParamType):
    """``30``, ``recipe`` or ``none``."""

    name = "FACTOR | recipe | none"

    def convert(self, value: Any, param: Any, ctx: Any) -> float | str:
        if value in ("recipe", "none"):
            return str(value)
        try:
            factor = float(value)
        except ValueError:
            factor = 0.0
        if not 1 <= factor < float("inf"):
            self.fail(f"{value!r} is no balance; give a factor from 1, recipe or none", param, ctx)
        return factor


@dataclass(frozen=True)
class SelectOptions(OptionGroup):
    """The options as they were given; None or False where they were not."""

    select: tuple[Path, ...] = option(
        type=EXISTING_FOLDER,
        multiple=True,
        metavar="RUN",
        help="Take the successful episodes of a run of er-gym bench; may be repeated. The options "
        "from here to --rewrite-thoughts are for it.",
    )
    most_actions: int | None = option(
        type=click.IntRange(min=1),
        help=f"Take only episodes of at most so many actions.  [default: {_DEFAULT_MOST_ACTIONS}]",
    )
    most_tokens: int | None = option(
        type=click.IntRange(min=1),
        help="Take only conversations of at most so many tokens, as the model counts them.",
    )
    per_task: int | None = option(
        type=click.IntRange(min=1), help="Take at most so many episodes of a task."
    )
    balance: float | Literal["recipe", "none"] | None = option(
        type=Balance(),
        help="Take at most so many times as many episodes of a task type as of the rarest one; "
        f"or recipe: in the proportions of --recipe; or none.  [default: {_DEFAULT_BALANCE}]",
    )
    keep_failed: bool = option(
        is_flag=True,
        help="Also take episodes in which actions failed; failed turns are not trained on.",
    )
    rewrite_thoughts: bool = option(
        is_flag=True, help="Let --writer write the thoughts, even if the model wrote its own."
    )


@dataclass(frozen=True)
class Selection:
    """A selection from runs.

    Attributes:
        runs: the runs, of the same tasks in the same environment.
        options: of the command line.
        recipe: for the balance.
        strict: whether the critic must accept every thought.
    """

    runs: tuple[RunDirectory, ...]
    options: SelectOptions
    recipe: Recipe
    strict: bool

    @staticmethod
    def of(options: SelectOptions, recipe_name: str | None, strict: bool) -> Selection | None:
        """From the options; None if nothing is to be selected.

        Args:
            options: of the command line.
            recipe_name: ``--recipe``, for its proportions.
            strict: ``--strict-thoughts``.

        Raises:
            BadInput: options do not fit together.
            ValueError: a directory is not a run, or there is no such recipe.
        """
        if not options.select:
            if options.given:
                raise BadInput(f"{options.given[0]} is for --select RUN: give that, too")
            return None
        if recipe_name is not None and options.balance != "recipe":
            raise BadInput("--recipe is for --select with --balance recipe: give that, too")
        from agents.expert.recipe import DEFAULT, load_recipe
        from er_gym.rollout.run_directory import RunDirectory

        paths = [path.resolve() for path in options.select]
        twice = next((path for path in paths if paths.count(path) > 1), None)
        if twice is not None:
            raise BadInput(f"{twice} is given twice; give each --select once")
        runs = tuple(RunDirectory.open(path) for path in paths)
        return Selection(runs, options, load_recipe(recipe_name or DEFAULT), strict)

    @cached_property
    def rules(self) -> SelectionRules:
        """What is taken."""
        from agents.expert.selection import SelectionRules

        rules: dict[str, Any] = {
            each.name: getattr(self.options, each.name)
            for each in fields(SelectionRules)
            if getattr(self.options, each.name) is not None
        }
        if rules.get("balance") == "none":
            rules["balance"] = None
        return SelectionRules(**rules)

    def source(self, name: str | None, tasks_file: Path | None) -> tuple[Suite, dict[str, Any]]:
        """The suite of the runs, and the environment in which they were played.

        Raises:
            BadInput: the runs do not go together, or with the suite.
        """
        from er_gym.envs.protocol import PAPER
        from er_gym.tasks.paper_format import with_every_pose

        first, *others = self.runs
        suite, env = source_of(name, tasks_file, first.path)
        for run in others:
            _check_alike(first, run)
        if env.get("backend", "embedded") != "embedded":
            raise BadInput(
                f"{first.path} was played on the backend {env['backend']}, which does not repeat "
                "itself exactly; select from runs on the embedded one"
            )
        if first.manifest.env.get("faults"):
            env["faults"] = first.manifest.env["faults"]
        if first.manifest.protocol == PAPER.name:  # as er-gym bench plays it
            suite = replace(suite, tasks=tuple(with_every_pose(suite.tasks, {})))
        return suite, env

    @property
    def collected(self) -> Recipe:
        """What is collected."""
        from agents.expert.selection import selection_recipe

        return selection_recipe(self.rules)

    @property
    def stated(self) -> dict[str, Any]:
        """What the collection's manifest states of it."""
        rules = vars(self.rules)
        shares = {}
        if self.rules.balance == "recipe":
            from agents.expert.selection import explored_shares

            shares = {"shares": explored_shares(self.recipe)}
        names = [f"{run.path.name} ({run.manifest.digest})" for run in self.runs]
        own = {"strict_thoughts": self.strict, "rewrite_thoughts": self.options.rewrite_thoughts}
        return {"selects": {"runs": names, **rules, **shares, **own}}

    def strata(
        self, tasks: Sequence[Task], limit: int | None, seed: int, allow_empty: bool
    ) -> tuple[Screening, dict[tuple[str, str], Stratum]]:
        """What may be taken, and how many of each task type.

        Raises:
            BadInput: nothing may be taken, and that is not allowed.
        """
        from agents.expert.selection import screen, selection_strata

        screening = screen(self.runs, tasks, self.rules, seed)
        strata = selection_strata(screening, self.rules, self.recipe, limit)
        if not (allow_empty or any(stratum.quota for stratum in strata.values())):
            reasons = sum((row.left_out for row in screening.yields.values()), Counter[str]())
            why = "; ".join(f"{number} x {reason}" for reason, number in sorted(reasons.items()))
            names = ", ".join(str(run.path) for run in self.runs)
            raise BadInput(f"{names}: no episode can be taken ({why or 'none of these tasks'})")
        return screening, strata

    def players(
        self, make_writer: NamedWriter, strata: Mapping[tuple[str, str], Stratum]
    ) -> Players:
        """Who plays the episodes again."""
        from agents.expert.replayed import Replayers

        candidates = {
            one.id: one
            for stratum in strata.values()
            for one in (stratum.sequence[place] for place in range(stratum.sequence.length or 0))
        }
        return Replayers(make_writer, candidates, self.options.rewrite_thoughts, self.strict)

    def report(
        self,
        screening: Screening,
        strata: Mapping[tuple[str, str], Stratum],
        collection: Collection,
        players: Players,
        limit: int | None,
    ) -> Table:
        """Write what became of the episodes into ``yield.json``, and lay it out as a table."""
        from agents.expert.selection import count_kept, yield_record
        from er_gym.data.collection import CollectionError
        from er_gym.writing import write_atomic

        def why_not(candidate: Any) -> str:
            try:
                trajectory = collection.played(candidate.part, candidate.id)
            except CollectionError:
                return "its replay crashed"
            return players.rejection(trajectory, self.rules.most_actions) or "not taken"

        yields = count_kept(screening, strata, why_not, limit is not None)
        runs = [
            {
                "run": run.path.name,
                "digest": run.manifest.digest,
                "agent": run.manifest.agent,
                "suite": run.manifest.suite,
                "seed": run.manifest.seed,
            }
            for run in self.runs
        ]
        record = yield_record(runs, yields)
        write_atomic(collection.path / YIELD, json.dumps(record, indent=2) + "\n")
        return yield_table(yields)


def yield_table(yields: Mapping[str, TypeYield]) -> Table:
    """What became of the samples of each task type."""
    from er_gym.tables import Table
    from er_gym.tasks.types import BY_NAME

    reasons = sorted({reason for row in yields.values() for reason in row.left_out})
    lines = [
        (BY_NAME[name].title if name in BY_NAME else name, row) for name, row in yields.items()
    ]
    numbers = [
        [
            *(row.tasks, row.solved, row.played, row.succeeded, row.kept),
            *(row.left_out[reason] for reason in reasons),
        ]
        for _, row in lines
    ]
    nothing = [0] * (5 + len(reasons))
    sums = [sum(column) for column in zip(nothing, *numbers, strict=True)]
    return Table(
        title="What became of the samples",
        head=("", "Tasks", "Solved", "Samples", "Successes", "Kept", *map(_column, reasons)),
        rows=tuple(
            (name, *map(str, row))
            for name, row in zip(
                (*(name for name, _ in lines), "All"), (*numbers, sums), strict=True
            )
        ),
        text_columns=1,
        may_turn=True,
    )


def _column(reason: str) -> str:
    return reason[:1].upper() + reason[1:]


def _check_alike(first: RunDirectory, other: RunDirectory) -> None:
    """Refuse a run of other tasks or in another environment."""
    ours, theirs = first.manifest, other.manifest
    if theirs.suite_digest != ours.suite_digest:
        raise BadInput(
            f"{other.path} was played with the tasks of {theirs.suite}, {first.path} with those "
            f"of {ours.suite}; select from each with an --out of its own"
        )
    for name in sorted({*ours.env, *theirs.env} - {*_OF_THE_AGENT}):
        here, there = ours.env.get(name), theirs.env.get(name)
        if here != there:
            raise BadInput(
                f"{other.path} was played with {name} {there!r}, {first.path} with {here!r}; "
                "select from each with an --out of its own"
            )
