"""The phases of an ablation: collect, then train and measure each row with each seed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from benchmarks.study.ablation_settings import AblationSettings, Row
from benchmarks.study.commands import Commands
from benchmarks.study.phase import Measurement, Phase


def ablation_phases(settings: AblationSettings, make: Commands) -> Iterator[Phase]:
    """All phases of an ablation in order: every row with the first seed, then with the next."""
    return _Ablation(settings, make).phases()


def row_measured(settings: AblationSettings, name: str) -> Measurement:
    """A row with all of its seeds."""
    return Measurement(name, {seed: _evaluation(name, seed) for seed in settings.seeds})


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
                yield from make.collect_from_teacher((run, out), run, out, source.teacher)
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
        out, evaluation = _evaluation(name, seed), settings.evaluation
        player = f"hf:{make.at(model)}"
        yield make.bench(out, out, player, evaluation.suite, evaluation.limit, ())


def _collection(name: str) -> str:
    return f"data/{name}"


def _base(dialect: str, seed: int) -> str:
    return f"bases/{Path(dialect).name}/{seed}"


def _evaluation(row: str, seed: int) -> str:
    return f"evaluations/{row}/{seed}"
