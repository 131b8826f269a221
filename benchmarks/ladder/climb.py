"""Runs the phases of a ladder, one after another, each once."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, ValidationError

from benchmarks.ladder.phases import Phase, phases
from benchmarks.ladder.settings import LadderSettings
from er_gym.locking import Locked, exclusive_use
from er_gym.rollout.processes import CONTEXT, GRACE_SECONDS, end_with_parent
from er_gym.tasks.reading import read_text
from er_gym.writing import make_folder, write_atomic

LADDER = "ladder.json"
_RUNNING = "running"
_FREE = {"workers", "concurrency", "description"}
"""Settings that may change while a ladder is climbed: they do not change what comes out."""
_PATIENCE = 3 * GRACE_SECONDS


class LadderError(ValueError):
    """A ladder cannot be climbed; the message is one line."""


class DonePhase(BaseModel):
    """A phase that has ended well.

    Attributes:
        name, command: of the phase.
        seconds: how long it took, earlier tries not counted.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str
    command: list[str]
    seconds: float


class LadderRecord(BaseModel):
    """The file ``ladder.json``: what is climbed, and how far it has come.

    Attributes:
        format: the version of this layout.
        settings: of the ladder.
        er_gym: the version that began it.
        done: the phases that have ended well, in order.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    format: Literal["er-gym/ladder/1"] = "er-gym/ladder/1"
    settings: LadderSettings
    er_gym: str
    done: list[DonePhase] = []


class PhaseFailed(Exception):
    """A phase ended with an error, which it has printed.

    Attributes:
        phase: which.
        code: its exit code.
    """

    def __init__(self, phase: Phase, code: int) -> None:
        super().__init__(f"{phase.name} ended with code {code}")
        self.phase, self.code = phase, code


def read_record(root: Path) -> LadderRecord | None:
    """What a ladder's directory says; None if there is no ladder yet.

    Raises:
        LadderError: the file is damaged, or the directory holds something else.
    """
    file = root / LADDER
    if not file.exists():
        if root.is_dir() and any(each.name != "run.lock" for each in root.iterdir()):
            raise LadderError(f"{root} is not empty and holds no {LADDER}; choose another --out")
        return None
    try:
        return LadderRecord.model_validate_json(read_text(file))
    except ValidationError as error:
        problem = error.errors()[0]
        place = ".".join(map(str, problem["loc"]))
        raise LadderError(f"{file} is damaged: {place}: {problem['msg']}") from None


def check_same(settings: LadderSettings, record: LadderRecord, root: Path) -> None:
    """Refuse to climb another ladder in the same directory.

    Raises:
        LadderError: a setting differs that changes what comes out.
    """
    here, there = settings.model_dump(mode="json"), record.settings.model_dump(mode="json")
    for name, value in here.items():
        if name not in _FREE and value != there[name]:
            raise LadderError(
                f"{root} holds another ladder: its {name} is {there[name]!r:.300}, this one's "
                f"{value!r:.300}; choose another --out, or give the same settings"
            )


def climb(
    settings: LadderSettings,
    root: Path,
    version: str,
    tell: Callable[[Phase, int, int], None],
    until: str | None = None,
) -> LadderRecord:
    """Run the phases that are not done yet.

    Each runs in a process of its own, which ends when this one ends. An interrupted phase is begun
    again by the same command, and goes on where it was.

    Args:
        settings: of the ladder.
        root: its directory.
        version: er-gym's.
        tell: is called with each phase before it runs, its number from 1, and how many there are.
        until: the name of the last phase to run; None for all.

    Returns:
        What the directory says in the end.

    Raises:
        LadderError: the directory holds another ladder, or there is no phase ``until``.
        Locked: another process climbs it.
        PhaseFailed: a phase ended with an error.
        KeyboardInterrupt: after the running phase has ended.
        OSError: the directory cannot be written to.
    """
    record = read_record(root)
    if record is not None:
        check_same(settings, record, root)
    plan = phases(settings, root)
    names = [phase.name for phase in plan]
    if until is not None and until not in names:
        raise LadderError(f"there is no phase {until!r}; there are: {', '.join(names)}")
    with exclusive_use(root):
        _wait_for_running(root)
        record = LadderRecord(settings=settings, er_gym=version, done=record.done if record else [])
        _write(root, record)
        done = {each.name for each in record.done}
        for number, phase in enumerate(plan, 1):
            if phase.name not in done:
                tell(phase, number, len(plan))
                begin = time.monotonic()
                _run(phase, root)
                seconds = round(time.monotonic() - begin, 1)
                ended = DonePhase(name=phase.name, command=list(phase.command), seconds=seconds)
                record = record.model_copy(update={"done": [*record.done, ended]})
                _write(root, record)
            if phase.name == until:
                break
    return record


def _write(root: Path, record: LadderRecord) -> None:
    make_folder(root)
    write_atomic(root / LADDER, record.model_dump_json(indent=1) + "\n")


def _run(phase: Phase, root: Path) -> None:
    """Run a phase to its end.

    Raises:
        PhaseFailed: it ended with an error.
        KeyboardInterrupt: it was interrupted, and has ended.
    """
    process = CONTEXT.Process(target=_command, args=(phase.command, str(root / _RUNNING)))
    process.start()
    try:
        process.join()
    except KeyboardInterrupt:
        # A terminal sends Ctrl-C to both processes; SIGTERM from elsewhere comes to this one alone.
        process.terminate()
        process.join()
        raise
    if process.exitcode:
        raise PhaseFailed(phase, process.exitcode)


def _command(arguments: Sequence[str], running: str) -> None:
    """Run a command of er-gym's in this process, and end it."""
    from benchmarks.cli.main import main

    end_with_parent()
    with exclusive_use(Path(running)):
        main(list(arguments))


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
