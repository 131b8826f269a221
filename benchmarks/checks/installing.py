"""Checks that pip can install every extra under constraints.txt, each into an empty environment.

    python -m benchmarks.checks.installing [--extra rl --extra all | --wheel] [--python python3.12]

pip resolves and downloads metadata, and installs nothing; it needs a package index. The test of the
same name only reads the installed packages and is quick; this check takes some minutes. With
--wheel, a wheel is built and installed instead, and its commands are tried with and without a
terminal (:mod:`benchmarks.checks.terminals`).
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import click

from benchmarks.checks import terminals
from benchmarks.cli.extras import extras
from benchmarks.harness.output import ROOT
from benchmarks.harness.tally import end

BY_THEMSELVES = ("ms-swift", "nemo-gym", "openenv", "rllib", "skyrl-gym", "verifiers", "verl")
"""The extras that do not go with constraints.txt; pyproject.toml says why."""
_TRIED = "charts,ui,vlm"
"""The extras of the commands that are tried."""


@click.command()
@click.option("--extra", "wanted", multiple=True, help="[default: every extra, and none]")
@click.option(
    "--python",
    default=sys.executable,
    show_default=True,
    help="The Python that makes the environment.",
)
@click.option("--wheel", is_flag=True, help="Build a wheel, install it, and try its commands.")
def main(wanted: tuple[str, ...], python: str, wheel: bool) -> None:
    """Resolve each extra, and print the number of its packages or why it cannot be installed."""
    failed = []
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([python, "-m", "venv", folder], check=True)
        if wheel:
            end(terminals.check(command=[str(installed(Path(folder)))], checkout=False))
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


def installed(environment: Path) -> Path:
    """The command of a wheel that is built, and installed with what the tried commands need."""
    pip = [str(environment / "bin" / "python"), "-m", "pip"]
    made = environment / "wheel"
    subprocess.run(
        [*pip, "wheel", "--no-deps", "--wheel-dir", str(made), "."], cwd=ROOT, check=True
    )
    (file,) = made.glob("*.whl")
    constrained = ["install", "--constraint", str(ROOT / "constraints.txt")]
    subprocess.run([*pip, *constrained, f"er-gym[{_TRIED}] @ {file.as_uri()}"], check=True)
    return environment / "bin" / "er-gym"


def resolve(python: Path, extra: str) -> str:
    """Pip's answer to a dry installation of the checkout with an extra ("": none)."""
    asked = [str(python), "-m", "pip", "install", "--dry-run"]
    if extra not in BY_THEMSELVES:
        asked += ["--constraint", "constraints.txt"]
    done = subprocess.run(
        [*asked, f".[{extra}]" if extra else "."], cwd=ROOT, capture_output=True, text=True
    )
    return done.stdout if done.returncode == 0 else done.stderr


if __name__ == "__main__":
    main()
