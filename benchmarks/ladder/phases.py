"""The phases of a ladder: each is a command of er-gym's with the directory that it writes."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from agents.finetune.settings import STAGES, Stage
from benchmarks.ladder.settings import CONTROLS, Control, Eyes, LadderSettings, StageSettings

BASE = "base"
_NEW, _FRAMES = "new-model", "data/frames"


@dataclass(frozen=True)
class Phase:
    """A step of a ladder.

    Attributes:
        name: unique, such as ``2-exploration/sample``.
        command: the arguments of ``er-gym``.
        out: the directory that it writes, relative to the ladder's.
    """

    name: str
    command: tuple[str, ...]
    out: str

    def __str__(self) -> str:
        return shlex.join(("er-gym", *self.command))


@dataclass(frozen=True)
class Rung:
    """A model that is measured.

    Attributes:
        name: ``base``, the stage that made it, or a control.
        faults: the rate of faults.
        run: the run directory of its evaluation, relative to the ladder's.
    """

    name: str
    faults: float
    run: str


def phases(settings: LadderSettings, root: Path) -> list[Phase]:
    """All phases in order.

    Args:
        settings: of the ladder.
        root: its directory.
    """
    return list(_Plan(settings, root).phases())


def rungs(settings: LadderSettings) -> list[Rung]:
    """The evaluations in order."""
    names = [name for name in (BASE, *settings.stages) if name != BASE or settings.evaluation.base]
    found = [Rung(name, 0.0, _evaluation(name, 0.0)) for name in names]
    for rate in settings.evaluation.faults:
        found += [
            Rung(name, rate, _evaluation(name, rate))
            for name in settings.stages
            if name != STAGES[0]
        ]
    return found + [
        Rung(name, 0.0, _evaluation(name, 0.0)) for name in settings.evaluation.controls
    ]


@dataclass(frozen=True)
class _Plan:
    """Makes the commands. Every path in them begins with the ladder's directory."""

    settings: LadderSettings
    root: Path

    def phases(self) -> Iterator[Phase]:
        settings = self.settings
        eyes = settings.base.eyes
        model = self._at(BASE) if eyes else settings.base.model or self._at(BASE)
        learnt_before: list[str] = []
        if eyes is not None:
            yield self._frames(eyes)
        before = BASE
        for stage, row in settings.stages.items():
            data = []
            for phase in self._data(stage, row, model):
                if phase.command[0] == "collect":
                    data.append(phase.out)
                yield phase
            if before == BASE:
                if settings.base.architecture:
                    yield self._new_model([*data, *([_FRAMES] if eyes else [])])
                if eyes is not None:
                    yield self._see(eyes)
                if settings.evaluation.base:
                    yield self._evaluate(BASE, model, 0.0)
            yield self._finetune(stage, row, model, [*learnt_before * row.again, *data])
            learnt_before += data
            model, before = self._at(_stage(stage)), stage
            yield self._evaluate(stage, model, 0.0)
            if stage != STAGES[0]:
                for rate in settings.evaluation.faults:
                    yield self._evaluate(stage, model, rate)
        for control in settings.evaluation.controls:
            yield self._control(control, model)

    def _data(self, stage: Stage, row: StageSettings, model: str) -> Iterator[Phase]:
        number = _stage(stage)
        if row.teacher is not None:
            teacher, run = row.teacher, f"samples/{number}-teacher"
            yield self._phase(
                f"{number}/teacher",
                run,
                *self._bench(teacher.agent, self.settings.suite, teacher.tasks),
                *("--samples", str(teacher.samples), "--workers", str(self.settings.workers)),
            )
            yield self._phase(
                f"{number}/taught",
                f"data/{number}-taught",
                *("collect", "--select", self._at(run), "--balance", "none"),
                *self._collecting(teacher.limit),
            )
        if row.sample is not None:
            sample, run = row.sample, f"samples/{number}"
            faults = ("--faults", str(sample.faults)) if sample.faults else ()
            yield self._phase(
                f"{number}/sample",
                run,
                *self._bench_model(model, self.settings.suite, sample.tasks),
                *("--samples", str(sample.samples)),
                *faults,
                *_overrides(
                    f"sampling.temperature={sample.temperature}", f"sampling.top_p={sample.top_p}"
                ),
            )
            corrects = stage == "reflection"
            yield self._phase(
                f"{number}/{'correct' if corrects else 'select'}",
                f"data/{number}-{'corrected' if corrects else 'selected'}",
                "collect",
                *("--correct" if corrects else "--select", self._at(run), "--allow-empty"),
                *(("--rewrite-thoughts",) * sample.rewrite_thoughts),
                *self._collecting(sample.limit),
            )
        if row.collect is not None:
            yield self._phase(
                f"{number}/collect",
                f"data/{number}",
                *("collect", "--suite", self.settings.suite, "--recipe", row.collect.recipe),
                *("--parts", ",".join(row.collect.parts)),
                *self._instances,
                *self._types,
                *self._collecting(row.collect.limit),
            )

    def _collecting(self, limit: int | None) -> tuple[str, ...]:
        settings = self.settings
        return (
            *("--language", settings.language, "--seed", str(settings.seed)),
            *("--workers", str(settings.workers)),
            *(self._size if settings.pictures else ("--no-pictures",)),
            *(() if limit is None else ("--limit", str(limit))),
        )

    def _frames(self, eyes: Eyes) -> Phase:
        return self._phase(
            "base/frames",
            _FRAMES,
            *("data", "frames", "--suite", self.settings.suite, "--frames", str(eyes.frames)),
            *self._size,
            *("--seed", str(self.settings.seed), "--workers", str(self.settings.workers)),
        )

    def _see(self, eyes: Eyes) -> Phase:
        base = self.settings.base
        return self._phase(
            "base/eyes",
            BASE,
            *("finetune", "--config", eyes.finetune, "--model", base.model or self._at(_NEW)),
            *self._data_options([_FRAMES]),
            *self._finetuning(eyes.set),
        )

    def _new_model(self, data: Sequence[str]) -> Phase:
        return self._phase(
            "base/new-model",
            _NEW if self.settings.base.eyes else BASE,
            *("new-model", self.settings.base.architecture),
            *self._data_options(data),
            *("--dialect", self.settings.dialect, "--seed", str(self.settings.seed)),
        )

    def _finetune(self, stage: Stage, row: StageSettings, model: str, data: Sequence[str]) -> Phase:
        return self._phase(
            f"{_stage(stage)}/finetune",
            _stage(stage),
            *("finetune", "--config", row.finetune, "--model", model),
            *self._data_options(data),
            *self._finetuning(row.set),
        )

    def _finetuning(self, overrides: Sequence[str]) -> tuple[str, ...]:
        return _overrides(
            f"data.dialect={self.settings.dialect}",
            *((f"data.language={self.settings.language}",) if self.settings.base.eyes else ()),
            f"training.seed={self.settings.seed}",
            "data.parts=[]",
            *overrides,
        )

    def _evaluate(self, name: str, model: str, faults: float) -> Phase:
        evaluation = self.settings.evaluation
        out = _evaluation(name, faults)
        play = list(evaluation.set)
        base = self.settings.base
        if name == BASE and base.architecture and not base.eyes:
            # No stage has told it how to converse.
            sees = () if self.settings.pictures else ("sees=text",)
            play = [f"prompts.dialect={self.settings.dialect}", *sees, *play]
        return self._phase(
            out,
            out,
            *self._bench_model(model, evaluation.suite, evaluation.limit),
            *(("--faults", str(faults)) if faults else ()),
            *_overrides(*play),
        )

    def _control(self, name: Control, model: str) -> Phase:
        evaluation, out = self.settings.evaluation, _evaluation(name, 0.0)
        if name == "blind":
            noise = _overrides(*evaluation.set, "pictures.noise=true")
            command = (*self._bench_model(model, evaluation.suite, evaluation.limit), *noise)
        else:
            workers = ("--workers", str(self.settings.workers))
            command = (*self._bench(name, evaluation.suite, evaluation.limit), *workers)
        return self._phase(out, out, *command)

    def _bench(self, agent: str, suite: str, limit: int | None) -> tuple[str, ...]:
        return (
            *("bench", "--suite", suite, "--agent", agent),
            *(() if limit is None else ("--limit", str(limit), "--spread")),
            *self._instances,
            *self._types,
            *("--seed", str(self.settings.seed)),
        )

    def _bench_model(self, model: str, suite: str, limit: int | None) -> tuple[str, ...]:
        return (
            *self._bench(f"hf:{model}", suite, limit),
            *("--concurrency", str(self.settings.concurrency)),
            *_overrides(*self.settings.play),
        )

    @property
    def _size(self) -> tuple[str, ...]:
        sizes = {"--width": self.settings.width, "--height": self.settings.height}
        return tuple(
            each
            for name, pixels in sizes.items()
            if pixels is not None
            for each in (name, str(pixels))
        )

    @property
    def _types(self) -> tuple[str, ...]:
        return ("--types", ",".join(self.settings.types)) if self.settings.types else ()

    @property
    def _instances(self) -> tuple[str, ...]:
        return ("--instances", self.settings.instances) if self.settings.instances else ()

    def _data_options(self, data: Sequence[str]) -> tuple[str, ...]:
        return tuple(each for one in data for each in ("--data", self._at(one)))

    def _phase(self, name: str, out: str, *command: str) -> Phase:
        return Phase(name, (*command, "--out", self._at(out)), out)

    def _at(self, out: str) -> str:
        return str(self.root / out)


def _overrides(*settings: str) -> tuple[str, ...]:
    return tuple(each for one in settings for each in ("--set", one))


def _stage(stage: Stage) -> str:
    return f"{STAGES.index(stage) + 1}-{stage}"


def _evaluation(name: str, faults: float) -> str:
    number = 0
    if name in STAGES:
        number = STAGES.index(name) + 1
    elif name in CONTROLS:
        number = len(STAGES) + 1
    return f"evaluations/{number}-{name}" + (f"-faults-{faults:g}" if faults else "")
