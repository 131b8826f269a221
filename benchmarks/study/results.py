"""What a study has come to: the models that have been measured, as tables and as JSON."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, TypeAlias

from benchmarks.scoring.metrics import Estimate, Score, Summary, summarise, summarise_by
from benchmarks.scoring.report import RunReport, by_group, load_run
from benchmarks.scoring.scorers import CORRECTED
from benchmarks.scoring.series import Chart
from benchmarks.scoring.tables import NONE, interval, percent, signed
from benchmarks.study.charts import Say, Shown, in_english
from benchmarks.study.phase import Measurement
from er_gym.rollout.run_directory import CONVERSATIONS, MANIFEST
from er_gym.tables import Table
from er_gym.tasks.types import GROUPS
from er_gym.writing import file_stem

MOST_KEY_ACTIONS = 9
"""Tasks with as many key actions or more are counted together, as in the paper's figure."""


@dataclass(frozen=True)
class Result:
    """A model that has been measured with at least one seed.

    Attributes:
        of: which.
        runs: by seed, its evaluations that have an episode.
        differences: from other models, by what they tell, paired over tasks; None where there is
            nothing to compare with.
    """

    of: Measurement
    runs: Mapping[int, RunReport]
    differences: Mapping[str, Estimate | None] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Of the model."""
        return self.of.name

    def scores(self, seeds: Sequence[int] | None = None) -> list[Score]:
        """Of the episodes with some seeds or, for None, all, by the corrected scorer. The episodes
        that several seeds have of a task are samples of it."""
        every = {seed: run.scores[CORRECTED.name] for seed, run in self.runs.items()}
        return [
            replace(each, sample=number) if len(every) > 1 else each
            for number, seed in enumerate(every, 1)
            if seeds is None or seed in seeds
            for each in every[seed]
        ]

    @cached_property
    def summary(self) -> Summary:
        """Over all episodes."""
        return summarise(self.scores())

    @cached_property
    def groups(self) -> dict[str, Summary]:
        """For each group of tasks that was played."""
        return by_group(self.scores())

    @cached_property
    def by_seed(self) -> dict[int, float]:
        """Success for each seed."""
        return {seed: summarise(self.scores([seed]))["success"].mean for seed in self.runs}

    @cached_property
    def by_key_actions(self) -> dict[int, Summary]:
        """For each number of key actions."""
        numbers = {
            each.task_id: str(min(len(each.key_actions), MOST_KEY_ACTIONS))
            for run in self.runs.values()
            for each in run.episodes
        }
        order = map(str, range(MOST_KEY_ACTIONS + 1))
        found = summarise_by(self.scores(), lambda each: numbers[each.task_id], order)
        return {int(name): summary for name, summary in found.items()}

    @cached_property
    def tokens(self) -> float | None:
        """Tokens of the model's replies in an episode; None if there are no conversations."""
        counts = []
        for run in self.runs.values():
            for episode in run.episodes:
                file = run.path / CONVERSATIONS / f"{file_stem(episode.key)}.json"
                if file.is_file():
                    told = json.loads(file.read_text(encoding="utf-8"))
                    counts.append(told["completion_tokens"])
        return sum(counts) / len(counts) if counts else None

    @property
    def shown(self) -> Shown:
        """As a chart shows it."""
        return Shown(self.name, self.of.faults, self.summary["success"], [*self.by_seed.values()])

    def as_dict(self) -> dict[str, Any]:
        """All figures, as fractions with their intervals."""
        return {
            "name": self.name,
            "faults": self.of.faults,
            **({"run": next(iter(self.of.runs.values()))} if len(self.of.runs) == 1 else {}),
            **_figures(self.summary),
            **{name: each and asdict(each) for name, each in self.differences.items()},
            "by_seed": self.by_seed,
            "tokens": self.tokens,
            "groups": {name: _figures(each) for name, each in self.groups.items()},
            "by_key_actions": {str(n): _figures(each) for n, each in self.by_key_actions.items()},
        }


def read_result(of: Measurement, root: Path) -> Result | None:
    """A model as far as it has been measured; None if it has not been.

    Raises:
        RunDirectoryError: a run directory is damaged.
    """
    there = {seed: root / run for seed, run in of.runs.items() if (root / run / MANIFEST).exists()}
    runs = {seed: load_run(path) for seed, path in there.items()}
    runs = {seed: run for seed, run in runs.items() if run.episodes}
    return Result(of, runs) if runs else None


@dataclass(frozen=True)
class Part:
    """Models that are compared: all of a ladder, or some rows of an ablation.

    Attributes:
        name: of its picture, and of an ablation's study.
        measured: the models, in order.
        compared: gives results, in order, their differences.
        tables: what the results have come to.
        chart: the models in a chart, in some words.
        pictured: whether the chart becomes a picture.
    """

    name: str
    measured: Sequence[Measurement]
    compared: Callable[[Sequence[Result]], list[Result]]
    tables: Callable[[Sequence[Result]], list[Table]]
    chart: Callable[[Sequence[Shown], Say], Chart]
    pictured: bool

    def read(self, root: Path) -> list[Result]:
        """The models that have been measured so far.

        Raises:
            RunDirectoryError: a run directory is damaged.
        """
        found = (read_result(each, root) for each in self.measured)
        return self.compared([each for each in found if each is not None])

    def picture(self, results: Sequence[Result]) -> Chart:
        """Results in a chart in English."""
        return self.chart([each.shown for each in results], in_english)


def _figures(summary: Summary) -> dict[str, Any]:
    """The number of episodes and every metric."""
    return {"n": summary.n, **{name: asdict(each) for name, each in summary.metrics.items()}}


Cells: TypeAlias = Callable[[Result], tuple[str, ...]]


def _mean(metric: str) -> Cells:
    return lambda each: (percent(each.summary[metric].mean, 1),)


def _difference(name: str) -> Cells:
    return lambda each: signed(each.differences.get(name))


def _success_in(parts: Mapping[Any, Summary], names: Sequence[Any]) -> tuple[str, ...]:
    return tuple(
        percent(parts[each]["success"].mean, 1) if each in parts else NONE for each in names
    )


_LENGTHS = range(1, MOST_KEY_ACTIONS + 1)
_COLUMNS: Mapping[str, tuple[tuple[str, ...], Cells]] = {
    "rung": (("rung", "faults"), lambda each: (each.name, f"{100 * each.of.faults:g}")),
    "row": (("row", "seeds"), lambda each: (each.name, str(len(each.by_seed)))),
    "n": (("n",), lambda each: (str(each.summary.n),)),
    "success": (("success",), _mean("success")),
    "interval": (("95 %",), lambda each: (interval(each.summary["success"]),)),
    "gain": (("gain", "95 %"), _difference("gain")),
    "change": (("change", "95 %"), _difference("change")),
    "loss_reduction": (("loss reduction", "95 %"), _difference("loss_reduction")),
    "more_repeats": (("more", "95 %"), _difference("more_repeats")),
    "more_revisits": (("more", "95 %"), _difference("more_revisits")),
    "difference": (("difference", "95 %"), _difference("difference")),
    "search_efficiency": (("SE",), _mean("search_efficiency")),
    "completeness": (("TC",), _mean("completeness")),
    "repeat_rate": (("repeated",), _mean("repeat_rate")),
    "revisit_rate": (("revisited",), _mean("revisit_rate")),
    "groups": (GROUPS, lambda each: _success_in(each.groups, GROUPS)),
    "lengths": (
        (*map(str, _LENGTHS[:-1]), f"{MOST_KEY_ACTIONS}+"),
        lambda each: _success_in(each.by_key_actions, _LENGTHS),
    ),
    "tokens": (
        ("tokens",),
        lambda each: (NONE if each.tokens is None else f"{each.tokens:,.0f}",),
    ),
    "seeds": (
        ("by seed",),
        lambda each: (", ".join(percent(rate, 1) for rate in each.by_seed.values()),),
    ),
}
"""Of each figure of a model, the heads of its columns and its cells in %."""


def results_table(
    title: str,
    columns: str,
    results: Sequence[Result],
    *notes: str,
    more: Sequence[tuple[str, ...]] = (),
    may_turn: bool = False,
) -> Table:
    """Results as a table.

    Args:
        title: above it.
        columns: names of :data:`_COLUMNS`, with spaces between them.
        results: a row each.
        notes: below it.
        more: rows below theirs.
        may_turn: see :class:`~er_gym.tables.Table`.
    """
    chosen = [_COLUMNS[name] for name in columns.split()]
    return Table(
        title=title,
        head=tuple(head for heads, _ in chosen for head in heads),
        rows=(*(tuple(c for _, cells in chosen for c in cells(each)) for each in results), *more),
        text_columns=1,
        notes=notes,
        may_turn=may_turn,
    )
