"""Which suites a submission may name: er-gym's own, and fresh tasks of these."""

from __future__ import annotations

from dataclasses import replace

from benchmarks.leaderboard.months import fresh_of
from er_gym.tasks.suites import (
    Suite,
    load_suite,
    suite_config,
    suite_from_file,
    suite_home,
    suite_names,
)


def board_suite(name: str) -> Suite:
    """The suite of a name that a stranger gives: no other package's, which would be imported.

    Raises:
        ValueError: er-gym has no such suite, or its fresh tasks have not been made here.
    """
    if name.removesuffix("-zh") in suite_names():
        return load_suite(name)
    fresh = fresh_of(name)
    if fresh is None or fresh[0] not in suite_names():
        known = ", ".join(suite_names())
        raise ValueError(f"{name!r:.60} is none of er-gym's own suites; those are {known}")
    own, seed = fresh
    file = suite_home() / f"{own}-fresh-{seed}.jsonl.gz"
    if not file.exists():
        raise ValueError(
            f"the tasks of {own} from the seed {seed} are not here; this makes them: er-gym bench "
            f"--suite {own} --fresh {seed} --agent oracle --limit 1"
        )
    return replace(suite_from_file(file), env=suite_config(own).env)
