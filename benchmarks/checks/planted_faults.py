"""Plants small faults in the code, and counts those that the tests of the mirror folder notice.

    nice -n 19 python -m benchmarks.checks.planted_faults [--package er_gym/envs] [--seed 0]

Each fault is planted in a scratch copy of the checkout, which is removed afterwards. Only the tests
that run the line with the fault are run, so the tests of each package first run once with
coverage.py. A fault that no test runs has survived at once. A run of the tests that goes on for too
long is ended, and counts as a fault that is noticed; the table counts these by themselves. A test
that notices a fault must pass without it.

``--work`` keeps what was found, so that the same command continues where it ended. ``--again``
tries once more what survived, after tests were added. ``--one ID`` shows a fault, and tries it.

Faults are not planted in what only says something (docstrings, messages of errors and logs,
``__repr__``), in what only checks the program's own promises (annotations, ``assert``,
``strict=``), in decorators and in f-strings. Faults that change nothing that a user can see were
judged so by hand, and are listed with their reasons in ``planting/mirrors.py``.

The mutation testers on PyPI do not fit. mutmut makes every fault of a file, in functions only, and
none of ``mutmut``'s and ``cosmic-ray``'s kinds swaps arguments; cosmic-ray changes the working tree
and runs one command of tests for all; neither draws a seeded sample or counts by package.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import click

from benchmarks.checks.planting.faults import Fault, chosen, faults_of
from benchmarks.checks.planting.mirrors import EQUIVALENT, PACKAGES, tests_of
from benchmarks.checks.planting.reach import (
    Reach,
    failing_of,
    planted,
    reach_of,
    run_tests,
    scratch_copy,
)
from benchmarks.harness.output import ROOT, print_table, write_figures
from er_gym.tasks.reading import read_text

_ENOUGH = 0.9
"""The share of faults that the tests of each package must notice."""
_LIMIT, _SLACK = 60.0, 10
"""The limit of a run of tests: seconds of the processor's time, and for each second that the tests
took without a fault so many more."""
_NOTICED, _LATE, _SURVIVED, _UNREACHED, _SAME, _UNSURE = (
    *("noticed", "by limit", "survived", "no test", "same", "unsure"),
)
_RESULTS = (_NOTICED, _LATE, _SURVIVED, _UNREACHED, _SAME, _UNSURE)


@click.command()
@click.option("--package", "packages", multiple=True, type=click.Choice(PACKAGES))
@click.option("--seed", default=0, show_default=True)
@click.option("--faults", "count", default=60, show_default=True, help="in all packages together")
@click.option("--one", "identity", help="show the fault of this id, and try it alone")
@click.option("--again", is_flag=True, help="try once more what survived")
@click.option(
    "--by",
    multiple=True,
    help="with --again: files of tests, such as new ones, that are tried instead of all",
)
@click.option("--list", "only_list", is_flag=True, help="list the faults, and plant none")
@click.option(
    "--work",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path(tempfile.gettempdir()) / "er-gym-planted-faults",
    show_default=True,
    help="the folder that keeps results, and which tests run which lines",
)
def main(
    packages: tuple[str, ...],
    seed: int,
    count: int,
    identity: str | None,
    again: bool,
    by: tuple[str, ...],
    only_list: bool,
    work: Path,
) -> None:
    """Plant faults, print each with its result, and then a table by package."""
    packages = packages or PACKAGES
    found = {package: faults_of(ROOT, package) for package in packages}
    if identity is None:
        share, more = divmod(count, len(packages))
        picked = {
            package: chosen(ROOT, found[package], share + (index < more), seed)
            for index, package in enumerate(packages)
        }
    else:
        picked = {
            package: [each for each in found[package] if each.id == identity]
            for package in packages
        }
        picked = {package: faults for package, faults in picked.items() if faults}
        if not picked:
            raise click.UsageError(f"no fault has the id {identity!r}; --list shows some")
    if only_list or identity is not None:
        for faults in picked.values():
            for fault in faults:
                click.echo(f"{fault}\n{fault.diff((ROOT / fault.file).read_bytes())}\n")
    if only_list:
        return
    results = _try_all(picked, work, fresh=identity is not None, again=again, by=by)
    head = ("package", "faults", *_RESULTS, "rate")
    print_table("Planted faults", head, table(picked, results))
    counts = Counter(results[each.id] for faults in picked.values() for each in faults)
    noticed = counts[_NOTICED] + counts[_LATE]
    sys.exit(int(noticed < _ENOUGH * (sum(counts.values()) - counts[_SAME])))


def _try_all(
    picked: Mapping[str, Sequence[Fault]],
    work: Path,
    *,
    fresh: bool,
    again: bool,
    by: Sequence[str],
) -> dict[str, str]:
    file = work / "results.json"
    work.mkdir(parents=True, exist_ok=True)
    results = _kept(file)
    with scratch_copy(ROOT) as checkout:
        for package, faults in picked.items():
            done = [_NOTICED, _LATE, *(() if again else (_SURVIVED, _UNREACHED))]
            left = [
                fault
                for fault in faults
                if fault.id not in EQUIVALENT
                and (fresh or results.get(fault.id, {}).get("result") not in done)
            ]
            reach = Reach({}, {})
            if left and not by:
                click.echo(f"{package}: which tests run which lines", err=True)
                reach = reach_of(checkout, package, tests_of(checkout, package), work)
            for fault in left:
                stages = [list(by)] if by else reach.stages(fault)
                result, test = _try(checkout, stages, reach, fault)
                results[fault.id] = {"result": result, "test": test}
                write_figures(file, results)
                click.echo(f"{result:9} {fault}  {test}")
            # What fails without the fault, too, has noticed nothing.
            tests = {results[each.id]["test"] for each in left} - {""}
            failing = failing_of(checkout, sorted(tests)) if tests else set()
            for fault in left:
                if results[fault.id]["test"] in failing:
                    results[fault.id]["result"] = _UNSURE
            write_figures(file, results)
    found = {identity: one["result"] for identity, one in results.items()}
    return found | dict.fromkeys(EQUIVALENT, _SAME)


def _kept(file: Path) -> dict[str, dict[str, str]]:
    if not file.is_file():
        return {}
    kept: dict[str, dict[str, str]] = json.loads(read_text(file, 10_000_000))["figures"]
    return kept


def _try(
    checkout: Path, stages: Iterable[Sequence[str]], reach: Reach, fault: Fault
) -> tuple[str, str]:
    """The result of a fault, and the test that noticed it."""
    reached = False
    for tests in stages:
        reached = True
        limit = _LIMIT + _SLACK * sum(reach.seconds.get(test, 0.0) for test in tests)
        with planted(checkout, fault):
            run = run_tests(checkout, tests, limit, "-x")
        if run.late:
            return _LATE, ""
        if not run.passed:
            return _NOTICED, run.failed
    return (_SURVIVED if reached else _UNREACHED), ""


def table(
    picked: Mapping[str, Sequence[Fault]], results: Mapping[str, str]
) -> list[tuple[object, ...]]:
    """Counts by package: the rate is that of noticed faults among those that change something."""
    counts = {
        package: Counter(results[fault.id] for fault in faults)
        for package, faults in picked.items()
    }
    rows: list[tuple[object, ...]] = []
    for name, row in (*counts.items(), ("in all", sum(counts.values(), Counter()))):
        noticed, real = row[_NOTICED] + row[_LATE], sum(row.values()) - row[_SAME]
        rate = f"{100 * noticed / real:.0f} %" if real else "-"
        rows.append((name, sum(row.values()), *(row[each] for each in _RESULTS), rate))
    return rows


if __name__ == "__main__":
    main()
