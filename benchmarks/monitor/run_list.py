"""The list of runs: what it can be filtered and sorted by."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from benchmarks.monitor.listing import AddressFilter
from benchmarks.monitor.run_view import RunSummary

SORTS: Mapping[str, Callable[[RunSummary], Any]] = {
    # Those that play come first.
    "name": lambda run: (run.state != "playing", run.directory.name),
    "agent": lambda run: (run.manifest.agent if run.manifest else "", run.directory.name),
    "suite": lambda run: (run.manifest.suite if run.manifest else "", run.directory.name),
    "state": lambda run: (run.state, run.directory.name),
    "progress": lambda run: run.finished,
    "success": lambda run: -1.0 if run.success.rate is None else run.success.rate,
    "tidy": lambda run: -1.0 if run.success.tidy is None else run.success.tidy.mean,
    "crashed": lambda run: run.counts["crashed"],
    "tokens": lambda run: run.spent.tokens,
    "cost": lambda run: run.spent.cost,
    "begun": lambda run: run.begun,
}


@dataclass(frozen=True)
class RunFilter(AddressFilter[RunSummary]):
    """Which runs are shown.

    Attributes:
        state, suite: exact values; "" for any.
        tag: a tag that the run has; "" for any run.
    """

    sorts: ClassVar[Mapping[str, Callable[[RunSummary], Any]]] = SORTS

    state: str = ""
    suite: str = ""
    tag: str = ""
    sort: str = "name"

    def takes(self, row: RunSummary) -> bool:
        """Whether a run is shown."""
        agent, suite = (row.manifest.agent, row.manifest.suite) if row.manifest else ("", "")
        return (
            self.state in ("", row.state)
            and self.suite in ("", suite)
            and (not self.tag or self.tag in row.tags)
            and self.says(" ".join((row.directory.name, agent, suite, *row.tags)))
        )


def choices(runs: list[RunSummary]) -> dict[str, list[str]]:
    """The values by which runs can be filtered."""
    return {
        "state": sorted({run.state for run in runs}),
        "suite": sorted({run.manifest.suite for run in runs if run.manifest}),
        "tag": sorted({tag for run in runs for tag in run.tags}),
    }
