"""A scratch copy of the checkout, its tests, and which of them run which lines."""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.checks.planting.faults import Fault
from benchmarks.harness import processes
from benchmarks.harness.output import ROOT

_FAILED = re.compile(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", re.MULTILINE)
_SETTINGS = """
[run]
source = {package}
data_file = {data}
parallel = true
patch = subprocess
"""
_IDLE = 180.0
"""A run of tests hangs that has nothing to do for so many seconds."""


@dataclass(frozen=True)
class Run:
    """What came of some tests.

    Attributes:
        passed: whether all passed. failed: the first one that did not, ``""`` if none is named.
        late: whether the tests were ended at their limit. output: what pytest said.
    """

    passed: bool
    failed: str
    late: bool
    output: str


@dataclass(frozen=True)
class Reach:
    """Which tests of a folder run which lines of a package.

    Attributes:
        tests: by file and line, the tests that run it, and ``""`` for what no test runs by itself:
            an import, or another process.
        seconds: by test, how long it took.
    """

    tests: Mapping[str, Mapping[int, frozenset[str]]]
    seconds: Mapping[str, float] = field(repr=False)

    def stages(self, fault: Fault) -> Iterator[list[str]]:
        """The tests that can notice a fault: those that run its lines, then, where it may also show
        in others, the rest of them."""
        lines = self.tests.get(fault.file, {})
        found = frozenset[str]().union(*(lines.get(line, frozenset()) for line in fault.lines))
        first = {each.rpartition("|")[0] for each in found} - {""}
        if fault.at_import and found:
            of_file = frozenset[str]().union(*lines.values())
            first |= {each.rpartition("|")[0] for each in of_file} - {""}
        if first:
            yield self._in_order(first)
        # What a fixture, an import or another process ran may be used by other tests, too.
        shared = {each.partition("::")[0] for each in found if each.endswith("|setup")}
        rest = {
            each
            for each in self.seconds
            if each not in first and ("" in found or each.partition("::")[0] in shared)
        }
        if rest:
            yield self._in_order(rest)

    def _in_order(self, tests: set[str]) -> list[str]:
        """Tests of a file together, for the sake of its fixtures; the quickest files first."""
        took: defaultdict[str, float] = defaultdict(float)
        for test in tests:
            took[test.partition("::")[0]] += self.seconds.get(test, 0.0)
        rank = {test: index for index, test in enumerate(self.seconds)}
        files = {file: index for index, file in enumerate(sorted(took, key=lambda one: took[one]))}
        return sorted(
            tests, key=lambda test: (files[test.partition("::")[0]], rank.get(test, len(rank)))
        )


@contextlib.contextmanager
def scratch_copy(root: Path) -> Iterator[Path]:
    """A copy of a checkout's files, with the shared data beside it; removed afterwards."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=root,
        capture_output=True,
        check=True,
    ).stdout.decode()
    with tempfile.TemporaryDirectory(prefix="er-gym-faults-") as folder:
        copy = Path(folder) / "checkout"
        for name in filter(None, listed.split("\0")):
            if (root / name).is_file():
                (copy / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(root / name, copy / name)
        shared = root.parent / "shared"
        if shared.is_dir():
            (copy.parent / "shared").symlink_to(shared.resolve())
        yield copy


@contextlib.contextmanager
def planted(checkout: Path, fault: Fault) -> Iterator[None]:
    """The copy of the checkout has the fault."""
    path = checkout / fault.file
    source = path.read_bytes()
    for compiled in (path.parent / "__pycache__").glob(f"{path.stem}.*.pyc"):
        compiled.unlink()
    path.write_bytes(fault.planted(source))
    try:
        yield
    finally:
        path.write_bytes(source)


def run_tests(
    checkout: Path, tests: Sequence[str], seconds: float, *more: str, **environment: str
) -> Run:
    """Run tests in a copy of a checkout.

    Args:
        seconds: the limit on the processor's time of each process, which does not depend on the
            load of the machine. Tests that wait and do nothing are ended as well.
    """

    with tempfile.TemporaryDirectory() as folder:
        listed = Path(folder) / "wanted"
        listed.write_text("\n".join(tests), encoding="utf-8")
        limited = ["bash", "-c", 'ulimit -t "$0" && exec "$@"', str(int(seconds) + 1)]
        command = [
            *limited,
            sys.executable,
            "-m",
            "pytest",
            "-n0",
            "-rfE",
            "-p",
            "no:cacheprovider",
        ]
        command += ["-o", "faulthandler_timeout=0", "--tb=line", f"--basetemp={folder}/tmp"]
        variables = {
            "PYTHONPATH": f"{checkout}{os.pathsep}{ROOT}",
            "PYTHONDONTWRITEBYTECODE": "1",
            # The tests' own limits are on the wall clock: on a busy machine they would notice
            # what is no fault.
            "PYTEST_TIMEOUT": "0",
            **environment,
        }
        done = processes.run(
            [*command, *more, f"@{listed}"],
            cwd=checkout,
            terminal=False,
            environment={**os.environ, **variables},
            seconds=math.inf,
            idle=_IDLE,
        )
    late = done.code in (-signal.SIGXCPU, -signal.SIGKILL)
    failed = _FAILED.search(done.text())
    return Run(done.code == 0, failed[1] if failed else "", late, done.text())


def failing_of(checkout: Path, tests: Sequence[str]) -> set[str]:
    """Those of some tests that fail in a copy of a checkout."""
    return {*_FAILED.findall(run_tests(checkout, tests, 3600.0).output)}


def reach_of(checkout: Path, package: str, files: Sequence[str], kept: Path) -> Reach:
    """Run some files or folders of tests once; note the lines of a package that each test runs.

    Args:
        kept: the folder that keeps what was found for the next time.

    Raises:
        RuntimeError: tests fail that should pass.
    """
    from coverage import CoverageData

    folder = kept / f"{package.replace('/', '-')}-{_digest(checkout, package, *files)[:12]}"
    data, times = folder / "lines.coverage", folder / "seconds.json"
    if not times.is_file():
        folder.mkdir(parents=True, exist_ok=True)
        settings = _SETTINGS.format(package=checkout / package, data=data)
        (folder / "coverage.ini").write_text(settings, encoding="utf-8")
        plugin = ["-p", "benchmarks.checks.planting.watching"]
        run = run_tests(checkout, files, 3600.0, *plugin, ER_GYM_WATCHED=str(folder))
        if not run.passed:
            times.unlink(missing_ok=True)
            raise RuntimeError(f"tests of {package} fail without a fault:\n{run.output[-2000:]}")
    seconds: dict[str, float] = json.loads(times.read_text(encoding="utf-8"))
    found = CoverageData(str(data))
    found.read()
    tests: dict[str, dict[int, frozenset[str]]] = {}
    for file in found.measured_files():
        inside = file.partition("/checkout/")[2]
        lines = found.contexts_by_lineno(file)
        tests[inside] = {line: frozenset(contexts) for line, contexts in lines.items()}
    return Reach(tests, seconds)


def _digest(checkout: Path, *places: str) -> str:
    found = hashlib.sha256()
    for place in places:
        inside = sorted((checkout / place).rglob("*.py"))
        for path in inside or [checkout / place]:
            found.update(path.relative_to(checkout).as_posix().encode() + path.read_bytes())
    return found.hexdigest()
