"""The phases of an ablation: collect, then train and measure each row with each seed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from benchmarks.ablation.settings import AblationSettings, Row
from benchmarks.plan.commands import Commands
from benchmarks.plan.phase import Phase
from benchmarks.plan.run import Plan


def plan_of(settings: AblationSettings, root: Path) -> Plan:
    """All phases of an ablation in order: every row with the first seed, then with the next.

    Args:
        settings: of the ablation.
        root: its directory.
    """
    phases = tuple(_Ablation(settings, Commands(settings, root)).phases())
    return Plan("ablation", settings, phases)


def evaluation_of(row: str, seed: int) -> str:
    """The run directory of a row's evaluation, relative to the ablation's."""
    return f"evaluations/{row}/{seed}"


@dataclass(frozen=True)
class _Ablation:
    settings: AblationSettings
    make: Commands

    def phases(self) -> Iterator[Phase]:
        settings, make = self.settings, self.make
        for name, source in settings.collections.items():
            out = _collection(name)
            if source.collect is not None:
                yield make.collect(out, out, source.collect)
            elif source.teacher is not None:
                run = f"samples/{name}"
                yield from make.teach((run, out), run, out, source.teacher)
        for seed in settings.seeds:
            dialects = (row.dialect or settings.dialect for row in settings.rows.values())
            for dialect in dict.fromkeys(dialects):
                out = _base(dialect, seed)
                words = [_collection(settings.words)]
                yield make.new_model(out, out, settings.architecture, words, dialect, seed)
            for name, row in settings.rows.items():
                yield from self._row(name, row, seed)

    def _row(self, name: str, row: Row, seed: int) -> Iterator[Phase]:
        settings, make = self.settings, self.make
        dialect = row.dialect or settings.dialect
        model = _base(dialect, seed)
        for number, step in enumerate(row.steps, 1):
            out = f"models/{name}/{seed}/{number}"
            yield make.finetune(
                out,
                out,
                settings.finetune,
                make.at(model),
                map(_collection, step.data),
                f"data.dialect={dialect}",
                f"training.seed={seed}",
                "data.parts=[]",
                *settings.set,
                *step.set,
            )
            model = out
        out, evaluation = evaluation_of(name, seed), settings.evaluation
        yield make.bench_model(out, out, make.at(model), evaluation.suite, evaluation.limit)


def _collection(name: str) -> str:
    return f"data/{name}"


def _base(dialect: str, seed: int) -> str:
    return f"bases/{Path(dialect).name}/{seed}"
