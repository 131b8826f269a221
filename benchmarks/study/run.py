"""Runs the phases of a plan, one after another, each once."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from benchmarks.study.phase import Phase
from benchmarks.study.settings import FREE, PlaySettings
from er_gym import __version__
from er_gym.activity import begin
from er_gym.extras import MissingPackage
from er_gym.locking import Locked, exclusive_use
from er_gym.plugins import NotImported
from er_gym.resumable import FolderKind
from er_gym.rollout.processes import CONTEXT, GRACE_SECONDS, end_with_parent
from er_gym.writing import make_folder, write_atomic

Command = Callable[[Sequence[str]], None]
"""Runs the words of a command of er-gym, such as ``("bench", "--suite", "mini")``, and ends the
process with its exit code. It is picklable."""
_RUNNING = "running"
_PATIENCE = 3 * GRACE_SECONDS
_KEEP_SECONDS = 10.0


class PlanError(ValueError):
    """A plan cannot be run; the message is one line."""


@dataclass(frozen=True)
class Plan:
    """What is to be run.

    Attributes:
        kind: what a person calls it, such as ``ladder``; its record is the file ``KIND.json``.
        settings: what it was made from.
        phases: in order.
    """

    kind: str
    settings: PlaySettings
    phases: Sequence[Phase]

    @property
    def file(self) -> str:
        """The name of its record."""
        return f"{self.kind}.json"

    @property
    def format(self) -> str:
        """The version of the record's layout."""
        return f"er-gym/{self.kind}/1"


class DonePhase(BaseModel):
    """A phase that has ended well.

    Attributes:
        name, command: of the phase.
        seconds: how long it took, with the tries that were interrupted or killed, but for the last
            seconds of the killed ones.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str
    command: list[str]
    seconds: float


class PlanRecord(BaseModel):
    """The record of a plan: what is run, and how far it has come.

    Attributes:
        format: see :attr:`Plan.format`.
        settings: of the plan, as JSON has them.
        er_gym: the version that began it.
        done: the phases that have ended well, in order.
        tried: how long the phase has been tried that has begun and not ended, seconds by its name.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    format: str
    settings: dict[str, Any]
    er_gym: str
    done: list[DonePhase] = []
    tried: dict[str, float] = {}


class PhaseFailed(Exception):
    """A phase ended with an error, which it has printed.

    Attributes:
        phase: which.
        code: its exit code.
    """

    def __init__(self, phase: Phase, code: int) -> None:
        super().__init__(f"{phase.name} ended with code {code}")
        self.phase, self.code = phase, code


def saved_record(plan: Plan, root: Path) -> PlanRecord:
    """The record from which a plan goes on in a directory; one without phases if it begins.

    Raises:
        FolderConflict: a setting differs that changes what comes out, the record is damaged, or
            the directory holds something else.
    """
    record = PlanRecord(
        format=plan.format, settings=plan.settings.model_dump(mode="json"), er_gym=__version__
    )
    kind = FolderKind(
        noun=plan.kind,
        command=f"er-gym {plan.kind}",
        manifest=plan.file,
        model=PlanRecord,
        parts=(),
        holds_something=lambda path: True,  # how long phases have been tried
        compared=_compared,
    )
    if kind.check(root, record):
        return record
    there = kind.read(root)
    return record.model_copy(update={"done": there.done, "tried": there.tried})


def _compared(there: PlanRecord, here: PlanRecord) -> tuple[dict[str, Any], dict[str, Any]]:
    """The settings that change what comes out; one that a version did not have was None there."""
    names = [name for name in here.settings if name not in FREE]
    return (
        {"format": there.format} | {name: there.settings.get(name) for name in names},
        {"format": here.format} | {name: here.settings[name] for name in names},
    )


def check_phases(phases: Iterable[Phase], *, only_print: bool = False) -> list[str]:
    """Check what phases are given, before hours are spent on those before them.

    Args:
        phases: which.
        only_print: whether they are not to run here. Then a package that is missing here is no
            error.

    Returns:
        What could not be checked, each once: nothing was to be imported
        (:func:`er_gym.plugins.without_imports`), or a package is missing here.

    Raises:
        PlanError: the command of one would refuse it.
    """
    unchecked: dict[str, None] = {}
    phases = list(phases)
    for number, phase in enumerate(phases, 1):
        begin(f"checking what the phases are given: {number} of {len(phases)}")
        for check in phase.checks:
            try:
                check()
            except NotImported as told:
                unchecked[f"{told}, since --print runs nothing"] = None
            except ValueError as error:
                if only_print and isinstance(error, MissingPackage):
                    unchecked[str(error)] = None
                    continue
                raise PlanError(f"{phase.name}: {error}") from error
    return [*unchecked]


def run_plan(
    plan: Plan,
    root: Path,
    command: Command,
    tell: Callable[[Phase, int, int], None],
    until: str | None = None,
) -> PlanRecord:
    """Run the phases that are not done yet.

    Each runs in a process of its own, which ends when this one ends. An interrupted phase is begun
    again by the same command, and goes on where it was.

    Args:
        plan: the phases.
        root: its directory.
        command: runs a phase's words.
        tell: is called with each phase before it runs, its number from 1, and how many there are.
        until: the name of the last phase to run; None for all.

    Returns:
        What the directory says in the end.

    Raises:
        FolderConflict: the directory holds another plan.
        PlanError: there is no phase ``until``, or the command of a phase would refuse what it is
            given.
        Locked: another process runs it.
        PhaseFailed: a phase ended with an error.
        KeyboardInterrupt: after the running phase has ended.
        OSError: the directory cannot be written to.
    """
    done = {each.name for each in saved_record(plan, root).done}
    names = [phase.name for phase in plan.phases]
    if until is not None and until not in names:
        raise PlanError(f"there is no phase {until!r}; there are: {', '.join(names)}")
    asked = plan.phases if until is None else plan.phases[: names.index(until) + 1]
    check_phases(phase for phase in asked if phase.name not in done)
    with exclusive_use(root):
        _wait_for_running(root)
        record = saved_record(plan, root)
        done = {each.name for each in record.done}
        _write(root / plan.file, record)
        for number, phase in enumerate(plan.phases, 1):
            if phase.name not in done:
                tell(phase, number, len(plan.phases))
                record = _try(phase, root, command, plan.file, record)
            if phase.name == until:
                break
    return record


def _try(phase: Phase, root: Path, command: Command, file: str, record: PlanRecord) -> PlanRecord:
    """Run a phase to its end, and keep how long it takes.

    Returns:
        The record with the phase that is done.

    Raises:
        PhaseFailed, KeyboardInterrupt: as :func:`_run`.
    """
    before, begin = record.tried.get(phase.name, 0.0), time.monotonic()

    def seconds() -> float:
        return round(before + time.monotonic() - begin, 1)

    def keep() -> None:
        tried = {phase.name: seconds()}
        _write(root / file, record.model_copy(update={"tried": tried}))

    try:
        _run(phase, root, command, keep)
    except (PhaseFailed, KeyboardInterrupt):
        keep()
        raise
    ended = DonePhase(name=phase.name, command=list(phase.command), seconds=seconds())
    record = record.model_copy(update={"done": [*record.done, ended], "tried": {}})
    _write(root / file, record)
    return record


def _write(file: Path, record: PlanRecord) -> None:
    make_folder(file.parent)
    write_atomic(file, record.model_dump_json(indent=1) + "\n")


def _run(phase: Phase, root: Path, command: Command, keep: Callable[[], None]) -> None:
    """Run a phase to its end; ``keep`` is called from time to time.

    Raises:
        PhaseFailed: it ended with an error.
        KeyboardInterrupt: it was interrupted, and has ended.
    """
    running = str(root / _RUNNING)
    process = CONTEXT.Process(target=_run_here, args=(command, phase.command, running))
    process.start()
    try:
        process.join(_KEEP_SECONDS)
        while process.exitcode is None:
            keep()
            process.join(_KEEP_SECONDS)
    except KeyboardInterrupt:
        # A terminal sends Ctrl-C to both processes; SIGTERM from elsewhere comes to this one alone.
        process.terminate()
        process.join()
        raise
    if process.exitcode:
        raise PhaseFailed(phase, process.exitcode)


def _run_here(command: Command, words: Sequence[str], running: str) -> None:
    """Run a phase's words in this process."""
    end_with_parent()
    with exclusive_use(Path(running)):
        command(words)


def _wait_for_running(root: Path) -> None:
    """Wait for a phase whose parent was killed: it ends by itself, soon.

    Raises:
        Locked: it did not.
    """
    deadline = time.monotonic() + _PATIENCE
    while True:
        try:
            with exclusive_use(root / _RUNNING):
                return
        except Locked:
            if time.monotonic() > deadline:
                raise
            time.sleep(0.2)
