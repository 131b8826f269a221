"""What an ablation has come to: a table for each study."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from benchmarks.ablation.phases import evaluation_of
from benchmarks.ablation.settings import AblationSettings, Study
from benchmarks.scoring.metrics import Estimate, Score, Summary, summarise
from benchmarks.scoring.paired import paired_difference
from benchmarks.scoring.report import by_group, load_run
from benchmarks.scoring.scorers import CORRECTED
from benchmarks.scoring.tables import Table, interval, percent, signed
from er_gym.rollout.run_directory import MANIFEST
from er_gym.tasks.types import GROUPS

_NONE = "-"


@dataclass(frozen=True)
class RowResult:
    """A row that was measured with at least one seed.

    Attributes:
        name: of the row.
        by_seed: success for each seed.
        summary: over all episodes of all seeds, by the corrected scorer; the seeds' episodes of a
            task count as samples of it.
        groups: for each group of tasks.
        difference: in success to the first row of the study, paired over tasks; None for that row.
    """

    name: str
    by_seed: dict[int, float]
    summary: Summary
    groups: dict[str, Summary]
    difference: Estimate | None


def read_study(settings: AblationSettings, study: Study, root: Path) -> list[RowResult]:
    """The rows of a study that have been measured so far.

    Raises:
        RunDirectoryError: a run directory is damaged.
    """
    found: list[RowResult] = []
    first: dict[int, Sequence[Score]] = {}
    for name in study.rows:
        scores = dict(_scores(settings, name, root))
        if not scores:
            continue
        every = [each for seed in scores.values() for each in seed]
        common = [seed for seed in scores if seed in first]
        difference = None
        if common:
            before = [each for seed in common for each in first[seed]]
            difference = paired_difference(
                before, [each for seed in common for each in scores[seed]]
            )
        first = first or scores
        found.append(
            RowResult(
                name=name,
                by_seed={seed: summarise(own)["success"].mean for seed, own in scores.items()},
                summary=summarise(every),
                groups=by_group(every),
                difference=difference,
            )
        )
    return found


def _scores(
    settings: AblationSettings, name: str, root: Path
) -> Iterator[tuple[int, Sequence[Score]]]:
    """The scores of a row for each seed, the seeds counted as samples."""
    for number, seed in enumerate(settings.seeds, 1):
        path = root / evaluation_of(name, seed)
        if (path / MANIFEST).exists():
            scores = load_run(path).scores[CORRECTED.name]
            if scores:
                yield seed, [replace(each, sample=number) for each in scores]


def study_table(study: Study, results: Sequence[RowResult]) -> Table:
    """The results of a study as a table."""
    return Table(
        title=f"{study.title}, success in %",
        head=("row", "seeds", "n", "success", "95 %", "difference", "95 %", *GROUPS, "by seed"),
        rows=tuple(map(_row, results)),
        text_columns=1,
        notes=(
            f"difference: to {study.rows[0]}, paired over tasks",
            "by seed: of weights and order of the data",
        ),
        may_turn=True,
    )


def _row(result: RowResult) -> tuple[str, ...]:
    return (
        result.name,
        str(len(result.by_seed)),
        str(result.summary.n),
        percent(result.summary["success"].mean, 1),
        interval(result.summary["success"]),
        *signed(result.difference),
        *(
            percent(result.groups[each]["success"].mean, 1) if each in result.groups else _NONE
            for each in GROUPS
        ),
        ", ".join(percent(each, 1) for each in result.by_seed.values()),
    )


def as_json(studies: dict[str, list[RowResult]]) -> str:
    """All figures, as fractions with their intervals."""
    told = {name: list(map(_json, results)) for name, results in studies.items()}
    return json.dumps({"format": "er-gym/ablation-result/1", "studies": told}, indent=1)


def _json(result: RowResult) -> dict[str, Any]:
    return {
        "name": result.name,
        "by_seed": result.by_seed,
        **figures(result.summary),
        "groups": {name: figures(each) for name, each in result.groups.items()},
        "difference": None if result.difference is None else asdict(result.difference),
    }


def figures(summary: Summary) -> dict[str, Any]:
    """The number of episodes and every metric."""
    return {"n": summary.n, **{name: asdict(each) for name, each in summary.metrics.items()}}
