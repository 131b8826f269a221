"""Runs a command that says nothing, and says for it how long it has taken; for the Makefile.

    python -m benchmarks.checks.shown WHAT VENV COMMAND …

Needs no package, since it shows how they are installed: on a terminal, the number of those that are
in the virtual environment VENV is counted. What the command does print is shown.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from benchmarks.cli.live_line import LINE


def main(arguments: Sequence[str]) -> int:
    """Run the command, and end as it ends."""
    what, folder, *command = arguments
    if sys.stderr.isatty():
        LINE.show(what, lambda: packages(Path(folder)))
    else:
        print(what, file=sys.stderr, flush=True)
    began = time.monotonic()
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace"
    )
    assert process.stdout is not None
    try:
        for line in process.stdout:
            print(line, end="", file=sys.stderr)
        code = process.wait()
    except KeyboardInterrupt:  # the terminal has sent it to the command, too
        code = process.wait() or 130
    finally:
        LINE.end()
    if code == 0 and sys.stderr.isatty():
        seconds = time.monotonic() - began
        print(f"{what}: {packages(Path(folder)) or 'done'}, {seconds:.0f} s", file=sys.stderr)
    return code


def packages(folder: Path) -> str:
    """How many packages a virtual environment has, in words; "" if it has none yet."""
    count = sum(1 for _ in folder.glob("lib/python*/site-packages/*.dist-info"))
    return f"{count} packages" if count else ""


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
