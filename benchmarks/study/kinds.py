"""The kinds of studies: what they are made from, and what they come to."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from agents import configs
from benchmarks.study.ablation import ablation_parts, ablation_told
from benchmarks.study.ablation_phases import ablation_phases
from benchmarks.study.ablation_settings import AblationSettings
from benchmarks.study.commands import Commands
from benchmarks.study.ladder import ladder_parts, ladder_told
from benchmarks.study.ladder_phases import ladder_phases
from benchmarks.study.ladder_settings import LadderSettings
from benchmarks.study.phase import Phase
from benchmarks.study.results import Part, Result
from benchmarks.study.run import Plan, PlanRecord
from benchmarks.study.settings import PlaySettings
from er_gym.tables import as_markdown
from er_gym.writing import write_atomic


@dataclass(frozen=True)
class Kind:
    """A kind of study.

    Attributes:
        name: what a person calls it. Its record is the file ``NAME.json``.
        folder: its configuration files are those of ``configs/FOLDER``.
        settings: the model of these files.
        phases: of settings, in order.
        parts: the models of settings that are compared.
        told: the figures of each part's results, by its name, as ``result.json`` has them.
    """

    name: str
    folder: str
    settings: type[PlaySettings]
    phases: Callable[[Any, Commands], Iterable[Phase]]
    parts: Callable[[Any], list[Part]]
    told: Callable[[Mapping[str, Sequence[Result]]], dict[str, Any]]

    def names(self) -> tuple[str, ...]:
        """The names of er-gym's own, in alphabetical order."""
        return configs.names(self.folder)

    def load(self, name: str, overrides: Sequence[str] = ()) -> PlaySettings:
        """Read settings from a file of ``configs/FOLDER`` by name, or from any file by path.

        Raises:
            ValueError: the file does not exist, or the file or an override is invalid.
        """
        file = configs.file_of(self.folder, name, self.name)
        return configs.load(self.settings, file, self.name, overrides)

    def plan(self, settings: PlaySettings, root: Path) -> Plan:
        """All phases of settings in order; ``root`` is the study's directory."""
        return Plan(self.name, settings, tuple(self.phases(settings, Commands(settings, root))))


LADDER = Kind("ladder", "ladder", LadderSettings, ladder_phases, ladder_parts, ladder_told)
ABLATION = Kind(
    "ablation", "ablations", AblationSettings, ablation_phases, ablation_parts, ablation_told
)
KINDS: Mapping[str, Kind] = {each.name: each for each in (LADDER, ABLATION)}


@dataclass(frozen=True)
class Study:
    """A study, as far as it has come.

    Attributes:
        kind: its kind.
        path: its directory.
        settings: what it was made from.
        record: what has been done.
    """

    kind: Kind
    path: Path
    settings: PlaySettings
    record: PlanRecord

    @staticmethod
    def open(kind: Kind, path: Path) -> Study:
        """Read it.

        Raises:
            ValueError: it is no directory of this kind.
            OSError: it cannot be read.
        """
        record = PlanRecord.model_validate_json((path / f"{kind.name}.json").read_bytes())
        return Study(kind, path, kind.settings.model_validate(record.settings), record)

    def results(self) -> list[tuple[Part, list[Result]]]:
        """See :func:`read_parts`."""
        return read_parts(self.kind, self.settings, self.path)


def read_parts(kind: Kind, settings: PlaySettings, root: Path) -> list[tuple[Part, list[Result]]]:
    """The parts of which a model has been measured, and the results so far.

    Raises:
        RunDirectoryError: a run directory is damaged.
    """
    found = [(part, part.read(root)) for part in kind.parts(settings)]
    return [(part, results) for part, results in found if results]


def write_results(kind: Kind, root: Path, found: Sequence[tuple[Part, list[Result]]]) -> list[Path]:
    """Write the tables and the figures into a study's directory: the files."""
    told = {
        "format": f"er-gym/{kind.name}-result/1",
        **kind.told({part.name: results for part, results in found}),
    }
    tables = [table for part, results in found for table in part.tables(results)]
    write_atomic(root / "result.md", as_markdown(tables))
    write_atomic(root / "result.json", json.dumps(told, indent=1) + "\n")
    return [root / "result.md", root / "result.json"]
