"""The phases of a ladder: each is a command of er-gym's with the directory that it writes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from agents.finetune.settings import STAGES, Stage
from benchmarks.study.commands import Commands
from benchmarks.study.ladder_settings import (
    CONTROLS,
    Control,
    LadderSettings,
    Sampled,
    StageSettings,
)
from benchmarks.study.phase import Measurement, Phase

BASE = "base"
_NEW, _FRAMES = "new-model", "data/frames"


def ladder_phases(settings: LadderSettings, make: Commands) -> Iterator[Phase]:
    """All phases of a ladder in order."""
    return _Ladder(settings, make).phases()


def rungs(settings: LadderSettings) -> list[Measurement]:
    """The evaluations in order."""
    told = settings.evaluation
    names = [name for name in (BASE, *settings.stages) if name != BASE or told.base]
    later = [name for name in settings.stages if name != STAGES[0]]
    found = [
        *((name, 0.0) for name in names),
        *((name, rate) for rate in told.faults for name in later),
        *((name, 0.0) for name in told.controls),
    ]
    return [
        Measurement(name, {settings.seed: _evaluation(name, rate)}, rate) for name, rate in found
    ]


@dataclass(frozen=True)
class _Ladder:
    """Puts the commands together."""

    settings: LadderSettings
    make: Commands

    def phases(self) -> Iterator[Phase]:
        settings, make = self.settings, self.make
        eyes = settings.base.eyes
        model = make.at(BASE) if eyes else settings.base.model or make.at(BASE)
        learnt_before: list[str] = []
        if eyes is not None:
            yield make.frames("base/frames", _FRAMES, eyes.frames)
        before = BASE
        for stage, row in settings.stages.items():
            data = []
            for phase in self._data(stage, row, model):
                if phase.command[0] == "collect":
                    data.append(phase.out)
                yield phase
            if before == BASE:
                if architecture := settings.base.architecture:
                    yield make.new_model(
                        "base/new-model",
                        _NEW if eyes else BASE,
                        architecture,
                        [*data, *([_FRAMES] if eyes else [])],
                        settings.dialect,
                        settings.seed,
                    )
                if eyes is not None:
                    yield make.finetune(
                        "base/eyes",
                        BASE,
                        eyes.finetune,
                        settings.base.model or make.at(_NEW),
                        [_FRAMES],
                        *self._finetuning(eyes.set),
                    )
                if settings.evaluation.base:
                    yield self._evaluate(BASE, model, 0.0)
            yield make.finetune(
                f"{_stage(stage)}/finetune",
                _stage(stage),
                row.finetune,
                model,
                [*learnt_before * row.again, *data],
                *self._finetuning(row.set),
            )
            learnt_before += data
            model, before = make.at(_stage(stage)), stage
            yield self._evaluate(stage, model, 0.0)
            if stage != STAGES[0]:
                for rate in settings.evaluation.faults:
                    yield self._evaluate(stage, model, rate)
        for control in settings.evaluation.controls:
            yield self._control(control, model)

    def _finetuning(self, changes: Sequence[str]) -> tuple[str, ...]:
        """The overrides of every fine-tuning."""
        settings = self.settings
        return (
            f"data.dialect={settings.dialect}",
            *((f"data.language={settings.language}",) if settings.base.eyes else ()),
            f"training.seed={settings.seed}",
            "data.parts=[]",
            *changes,
        )

    def _data(self, stage: Stage, row: StageSettings, model: str) -> Iterator[Phase]:
        make, number = self.make, _stage(stage)
        if row.teacher is not None:
            names = (f"{number}/teacher", f"{number}/taught")
            run, out = f"samples/{number}-teacher", f"data/{number}-taught"
            yield from make.collect_from_teacher(names, run, out, row.teacher)
        if row.sample is not None:
            sample, run = row.sample, f"samples/{number}"
            yield make.bench(
                f"{number}/sample",
                run,
                f"hf:{model}",
                self.settings.suite,
                sample.tasks,
                (f"sampling.temperature={sample.temperature}", f"sampling.top_p={sample.top_p}"),
                faults=sample.faults,
                samples=sample.samples,
                skip=sample.skip,
            )
            if stage == STAGES[2]:
                yield self._corrected(f"{number}/correct", f"data/{number}-corrected", run, sample)
                for name in self._sampled_before(stage) if sample.earlier else ():
                    yield self._corrected(
                        f"{number}/correct-{name}",
                        f"data/{number}-corrected-{name}",
                        f"samples/{name}",
                        sample,
                    )
            if stage != STAGES[2] or sample.successes:
                yield make.phase(
                    f"{number}/select",
                    f"data/{number}-selected",
                    *("collect", "--select", make.at(run), "--allow-empty"),
                    *(("--keep-failed", "--balance", "none") if sample.successes else ()),
                    *(("--rewrite-thoughts",) * sample.rewrite_thoughts),
                    *make.collecting(sample.limit),
                )
        if row.collect is not None:
            yield make.collect(f"{number}/collect", f"data/{number}", row.collect)

    def _corrected(self, name: str, out: str, run: str, sample: Sampled) -> Phase:
        """Corrects the failures of a run."""
        return self.make.phase(
            name,
            out,
            *("collect", "--correct", self.make.at(run), "--allow-empty"),
            *(("--correct-after", after) if (after := sample.correct_after) != "wrong" else ()),
            *(("--correct-by", sample.correct_by) if sample.correct_by != "expert" else ()),
            *(("--own-thoughts",) * sample.own_thoughts),
            *self.make.collecting(sample.limit),
        )

    def _sampled_before(self, stage: Stage) -> list[str]:
        """The numbered names of the earlier stages that have samples."""
        earlier = STAGES[: STAGES.index(stage)]
        return [_stage(each) for each in earlier if self.settings.stages[each].sample]

    def _evaluate(self, name: str, model: str, faults: float) -> Phase:
        evaluation = self.settings.evaluation
        out = _evaluation(name, faults)
        play = list(evaluation.set)
        base = self.settings.base
        if name == BASE and base.architecture and not base.eyes:
            # No stage has told it how to converse.
            sees = () if self.settings.pictures else ("sees=text",)
            play = [f"prompts.dialect={self.settings.dialect}", *sees, *play]
        samples = evaluation.fault_samples if faults and evaluation.fault_samples > 1 else None
        suite, limit = evaluation.suite, evaluation.limit
        return self.make.bench(
            out, out, f"hf:{model}", suite, limit, play, faults=faults, samples=samples
        )

    def _control(self, name: Control, model: str) -> Phase:
        evaluation, out = self.settings.evaluation, _evaluation(name, 0.0)
        suite, limit = evaluation.suite, evaluation.limit
        if name == "blind":
            noise = (*evaluation.set, "pictures.noise=true")
            return self.make.bench(out, out, f"hf:{model}", suite, limit, noise)
        return self.make.bench(out, out, name, suite, limit)


def _stage(stage: Stage) -> str:
    return f"{STAGES.index(stage) + 1}-{stage}"


def _evaluation(name: str, faults: float) -> str:
    number = 0
    if name in STAGES:
        number = STAGES.index(name) + 1
    elif name in CONTROLS:
        number = len(STAGES) + 1
    return f"evaluations/{number}-{name}" + (f"-faults-{faults:g}" if faults else "")
