"""Whether pip can install every extra under constraints.txt, each into an empty environment.

    python -m benchmarks.checks.installing [--extra rl --extra all] [--python python3.12]

pip resolves and downloads metadata, and installs nothing; it needs a package index. The test of
the same name reads what is installed and is quick; this is the real thing, some minutes long.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import click

from benchmarks.cli.extras import extras

ROOT = Path(__file__).resolve().parents[2]


@click.command()
@click.option("--extra", "wanted", multiple=True, help="[default: every extra, and none]")
@click.option("--python", default=sys.executable, show_default=True, help="Makes the environment.")
def main(wanted: tuple[str, ...], python: str) -> None:
    """Resolve, and say for each extra how many packages it takes or why it cannot be had."""
    failed = []
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([python, "-m", "venv", folder], check=True)
        for extra in wanted or ("", *extras()):
            started = time.perf_counter()
            said = resolve(Path(folder) / "bin" / "python", extra)
            took = time.perf_counter() - started
            found = re.search(r"^Would install (.*)$", said, re.MULTILINE)
            if found is None:
                failed.append(extra)
            result = f"{len(found[1].split())} packages" if found else said.strip()
            click.echo(f"{'ok' if found else '--'}  er-gym[{extra}]  {took:.0f} s  {result}")
    sys.exit(1 if failed else 0)


def resolve(python: Path, extra: str) -> str:
    """What pip says to installing the checkout with an extra ("": none)."""
    asked = [str(python), "-m", "pip", "install", "--dry-run", "--constraint", "constraints.txt"]
    done = subprocess.run(
        [*asked, f".[{extra}]" if extra else "."], cwd=ROOT, capture_output=True, text=True
    )
    return done.stdout if done.returncode == 0 else done.stderr


if __name__ == "__main__":
    main()
