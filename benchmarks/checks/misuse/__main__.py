"""``python -m benchmarks.checks.misuse``."""

from benchmarks.checks import misuse
from benchmarks.harness.tally import run_check

if __name__ == "__main__":
    run_check(misuse.check, misuse.__doc__)
