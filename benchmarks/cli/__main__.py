"""``python -m benchmarks.cli`` is ``er-gym``."""

from benchmarks.cli.main import main

main()
