"""The commands of which plans consist."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from benchmarks.study import checks
from benchmarks.study.phase import Phase
from benchmarks.study.settings import Collected, PlaySettings, TeacherData


@dataclass(frozen=True)
class Commands:
    """Makes the phases of a plan. Every path in them begins with the plan's directory.

    Attributes:
        settings: of the plan.
        root: its directory.
    """

    settings: PlaySettings
    root: Path

    def at(self, out: str) -> str:
        """The path of a directory in the plan's."""
        return str(self.root / out)

    def phase(
        self, name: str, out: str, *command: str, checks: tuple[Callable[[], None], ...] = ()
    ) -> Phase:
        """A phase whose command writes ``out``."""
        return Phase(name, (*command, "--out", self.at(out)), out, checks)

    def collect(self, name: str, out: str, collected: Collected) -> Phase:
        """Collects trajectories of the data engine."""
        return self.phase(
            name,
            out,
            *("collect", "--suite", self.settings.suite, "--recipe", collected.recipe),
            *("--parts", ",".join(collected.parts)),
            *self._instances,
            *self._types,
            *self.collecting(collected.limit),
            checks=(
                partial(checks.check_tasks, self.settings, self.settings.suite),
                partial(checks.check_recipe, collected),
            ),
        )

    def collect_from_teacher(
        self, names: tuple[str, str], run: str, out: str, teacher: TeacherData
    ) -> list[Phase]:
        """The phases in which another agent plays and its successes are collected.

        Args:
            names: of the two phases.
            run: its run directory.
            out: the collection's.
            teacher: who plays what.
        """
        played = self.bench(
            names[0],
            run,
            teacher.agent,
            self.settings.suite,
            teacher.tasks,
            faults=teacher.faults,
            samples=teacher.samples,
            skip=teacher.skip,
        )
        return [
            played,
            self.phase(
                names[1],
                out,
                *("collect", "--select", self.at(run), "--balance", "none"),
                *(("--keep-failed",) if teacher.faults else ()),
                *self.collecting(teacher.limit),
            ),
        ]

    def collecting(self, limit: int | None) -> tuple[str, ...]:
        """The options that every collection has."""
        settings = self.settings
        return (
            *("--language", settings.language, "--seed", str(settings.seed)),
            *("--workers", str(settings.workers)),
            *(self._size if settings.pictures else ("--no-pictures",)),
            *(() if limit is None else ("--limit", str(limit))),
        )

    def frames(self, name: str, out: str, number: int) -> Phase:
        """Draws pictures of the suite's rooms, with what is in view."""
        return self.phase(
            name,
            out,
            *("data", "frames", "--suite", self.settings.suite, "--frames", str(number)),
            *self._size,
            *("--seed", str(self.settings.seed), "--workers", str(self.settings.workers)),
            checks=(partial(checks.check_tasks, self.settings, self.settings.suite),),
        )

    def new_model(
        self, name: str, out: str, architecture: str, data: Iterable[str], dialect: str, seed: int
    ) -> Phase:
        """Makes a model with random weights and a tokenizer that is learnt from data."""
        return self.phase(
            name,
            out,
            *("new-model", architecture),
            *self._data(data),
            *("--dialect", dialect, "--seed", str(seed)),
            checks=(partial(checks.check_new_model, architecture, dialect),),
        )

    def finetune(
        self, name: str, out: str, config: str, model: str, data: Iterable[str], *changes: str
    ) -> Phase:
        """Tunes a model; ``changes`` are overrides of the configuration."""
        checked = [partial(checks.check_finetune, config, changes)]
        if not Path(model).is_relative_to(self.root):  # else an earlier phase makes it
            checked.append(partial(checks.check_model_there, model))
        return self.phase(
            name,
            out,
            *("finetune", "--config", config, "--model", model),
            *self._data(data),
            *_overrides(*changes),
            checks=tuple(checked),
        )

    def bench(
        self,
        name: str,
        out: str,
        agent: str,
        suite: str,
        limit: int | None,
        changes: Sequence[str] | None = None,
        *,
        faults: float = 0.0,
        samples: int | None = None,
        skip: int = 0,
    ) -> Phase:
        """Lets an agent play; ``changes`` are overrides of a model's settings, None for an agent
        that is none of the study's models."""
        settings = self.settings
        play = () if changes is None else settings.play
        checked = (
            partial(checks.check_agent, agent)
            if changes is None
            else partial(checks.check_model_play, (*play, *changes))
        )
        return self.phase(
            name,
            out,
            *("bench", "--suite", suite, "--agent", agent),
            *(() if limit is None else ("--limit", str(limit), "--spread")),
            *self._instances,
            *self._types,
            *("--seed", str(settings.seed)),
            *(
                ("--workers", str(settings.workers))
                if changes is None
                else ("--concurrency", str(settings.concurrency))
            ),
            *_overrides(*play),
            *(() if samples is None else ("--samples", str(samples))),
            *(("--skip", str(skip)) if skip else ()),
            *(("--faults", str(faults)) if faults else ()),
            *_overrides(*(changes or ())),
            checks=(
                partial(checks.check_tasks, settings, suite),
                partial(checks.check_skip, settings, suite, skip),
                checked,
            ),
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

    def _data(self, directories: Iterable[str]) -> tuple[str, ...]:
        return tuple(each for one in directories for each in ("--data", self.at(one)))


def _overrides(*settings: str) -> tuple[str, ...]:
    """The options that override settings, each ``NAME=VALUE``."""
    return tuple(each for one in settings for each in ("--set", one))
