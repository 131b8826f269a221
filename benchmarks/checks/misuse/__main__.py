"""``python -m benchmarks.checks.misuse``."""

import sys

from benchmarks.checks.misuse import main

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
