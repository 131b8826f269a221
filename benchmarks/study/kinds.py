"""The kinds of studies: what they are made from, and what they come to."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from agents import configs
from benchmarks.study.ablation import ablation_parts
from benchmarks.study.ablation_phases import ablation_phases
from benchmarks.study.ablation_settings import AblationSettings
from benchmarks.study.commands import Commands
from benchmarks.study.ladder import ladder_parts
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
    """

    name: str
    folder: str
    settings: type[PlaySettings]
    phases: Callable[[Any, Commands], Iterable[Phase]]
    parts: Callable[[Any], list[Part]]

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


LADDER = Kind("ladder", "ladder", LadderSettings, ladder_phases, ladder_parts)
ABLATION = Kind("ablation", "ablations", AblationSettings, ablation_phases, ablation_parts)
KINDS: Mapping[str, Kind] = {each.name: each for each in (LADDER, ABLATION)}


@dataclass(frozen=True)
class Study:
    """A study, as far as it has come.

    Attributes:
        kind, path, settings: its kind, its directory, and what it is made from.
    """

    kind: Kind
    path: Path
    settings: PlaySettings

    @staticmethod
    def open(kind: Kind, path: Path) -> tuple[Study, PlanRecord]:
        """Read what there is, and what has been done.

        Raises:
            ValueError: it is no directory of this kind.
            OSError: it cannot be read.
        """
        record = PlanRecord.model_validate_json((path / f"{kind.name}.json").read_bytes())
        return Study(kind, path, kind.settings.model_validate(record.settings)), record

    @cached_property
    def plan(self) -> Plan:
        """All phases in order."""
        phases = self.kind.phases(self.settings, Commands(self.settings, self.path))
        return Plan(self.kind.name, self.settings, tuple(phases))

    def results(self) -> list[tuple[Part, list[Result]]]:
        """The parts of which a model has been measured, and the results so far.

        Raises:
            RunDirectoryError: a run directory is damaged.
        """
        found = [(part, part.read(self.path)) for part in self.kind.parts(self.settings)]
        return [(part, results) for part, results in found if results]

    def write(self, found: Sequence[tuple[Part, list[Result]]]) -> list[Path]:
        """Write the tables and the figures of results into the directory: the files."""
        told: dict[str, Any] = {"format": f"er-gym/{self.kind.name}-result/1"}
        rows = {part.name: [each.as_dict() for each in results] for part, results in found}
        told |= {"studies": rows} if self.kind is ABLATION else {"rungs": rows["ladder"]}
        tables = [table for part, results in found for table in part.tables(results)]
        files = [self.path / "result.md", self.path / "result.json"]
        write_atomic(files[0], as_markdown(tables))
        write_atomic(files[1], json.dumps(told, indent=1) + "\n")
        return files
