"""With which settings runs were played, and where they differ."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from benchmarks.monitor.formats import moment
from benchmarks.monitor.run_view import RunSummary
from benchmarks.scoring.scorers import CORRECTED
from er_gym.envs.protocol import DEFAULT

_USUAL: Mapping[str, Any] = {
    "env.protocol": DEFAULT.name,
    "env.instances": "target",
    "env.faults": 0.0,
    "env.backend": "embedded",
}
"""The values of what tells most where a manifest does not state it."""
_OF_THE_AGENT = frozenset({"obs_mode", "width", "height", "render_device", "light"})
"""The environment's arguments that say what an agent is shown, not how hard its tasks are."""
_PLAYED = ("suite", "suite_digest", "seed", "er_gym")
_NOTHING = "–"


@dataclass(frozen=True)
class Setting:
    """A setting of some runs.

    Attributes:
        name: its path in the manifest, such as ``env.faults``.
        values: one for each run.
        matters: whether runs with different values play by other rules or other tasks, so that a
            difference between them is not the agents' alone.
    """

    name: str
    values: Sequence[str]
    matters: bool

    @property
    def differs(self) -> bool:
        """Whether it has several values."""
        return len(set(self.values)) > 1


def settings_of(runs: Sequence[RunSummary]) -> list[Setting]:
    """The settings that any of some runs has, those that matter first."""
    told = [_told(run) for run in runs]
    names = list(dict.fromkeys(name for each in told for name in each))
    names.sort(key=lambda name: not _matters(name))
    return [
        Setting(name, [each.get(name, _NOTHING) for each in told], _matters(name)) for name in names
    ]


def _matters(name: str) -> bool:
    environment, _, argument = name.partition(".")
    if environment == "env":
        return argument.partition(".")[0] not in _OF_THE_AGENT
    return name in _PLAYED


def _told(run: RunSummary) -> dict[str, str]:
    manifest = run.manifest
    if manifest is None:
        return {}
    leave_out = {"format", "set_aside", "taken"}
    stated = dict(_flat(manifest.model_dump(mode="json", exclude=leave_out)))
    usual = {
        name: value
        for name, value in _USUAL.items()
        if not any(f"{each}.".startswith(f"{name}.") for each in stated)
    }
    return {name: str(value) or '""' for name, value in (usual | stated).items()} | {
        "samples": str(run.samples),
        "set_aside": str(len(manifest.set_aside)),
        "scorer": CORRECTED.name,
        "begun": moment(run.begun),
    }


def _flat(told: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in told.items():
        if isinstance(value, dict) and value:
            yield from _flat(value, f"{before}{name}.")
        elif value not in ({}, None):
            yield f"{before}{name}", value
