"""Checks that pip can install every extra under constraints.txt, each into an empty environment.

    python -m benchmarks.checks.installing [--extra rl --extra all] [--install | --wheel]

pip resolves and downloads metadata, and installs nothing; it needs a package index. The test of the
same name only reads the installed packages and is quick; this check takes some minutes. With
--install, each extra is installed in an environment of its own, which is measured and removed, and
the plug that it is for is imported there; some take gigabytes. With --wheel, a wheel is built and
installed instead, and its commands are tried with and without a terminal
(:mod:`benchmarks.checks.terminals`). --python names another Python.
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
from er_gym.integrations.plugs import PLUGS

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
@click.option("--install", is_flag=True, help="Install each extra, and import its plug.")
@click.option("--wheel", is_flag=True, help="Build a wheel, install it, and try its commands.")
def main(wanted: tuple[str, ...], python: str, install: bool, wheel: bool) -> None:
    """Resolve each extra, and print the number of its packages or why it cannot be installed."""
    failed = []
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([python, "-m", "venv", folder], check=True)
        if wheel:
            end(terminals.check(command=[str(installed(Path(folder)))], checkout=False))
        for extra in wanted or ("", *extras()):
            started = time.perf_counter()
            if install:
                fits, said = tried(python, extra)
            else:
                fits, said = resolve(Path(folder) / "bin" / "python", extra)
            took = time.perf_counter() - started
            failed += [] if fits else [extra]
            click.echo(f"{'ok' if fits else '--'}  er-gym[{extra}]  {took:.0f} s  {said}")
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


def resolve(python: Path, extra: str) -> tuple[bool, str]:
    """Whether pip can install the checkout with an extra ("": none), and the number of packages, or
    why not."""
    done = _pip(python, extra, "--dry-run")
    found = re.search(r"^Would install (.*)$", done.stdout, re.MULTILINE)
    return found is not None, f"{len(found[1].split())} packages" if found else done.stderr.strip()


def tried(python: str, extra: str) -> tuple[bool, str]:
    """Whether the checkout with an extra can be installed and the plugs imported that it is for,
    and the size, or why not."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([python, "-m", "venv", folder], check=True)
        environment = Path(folder) / "bin" / "python"
        bare = _size(folder)
        done = _pip(environment, extra)
        if done.returncode:
            return False, done.stderr.strip()
        said = [f"{(_size(folder) - bare) / 1e6:,.0f} MB"]
        for plug in (each for each in PLUGS if each.extra == extra):
            command = [str(environment), "-c", f"import {plug.module}"]
            # Elsewhere: the installed copy is meant, not the checkout.
            done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
            if done.returncode:
                return False, f"{said[0]}, and {plug.module}: {done.stderr.strip()}"
            said.append(plug.module)
        return True, ", ".join(said)


def _pip(python: Path, extra: str, *options: str) -> subprocess.CompletedProcess[str]:
    asked = [str(python), "-m", "pip", "install", *options]
    if extra not in BY_THEMSELVES:
        asked += ["--constraint", "constraints.txt"]
    asked.append(f".[{extra}]" if extra else ".")
    return subprocess.run(asked, cwd=ROOT, capture_output=True, text=True)


def _size(folder: str) -> int:
    """The bytes of the files in a folder."""
    return sum(file.stat().st_size for file in Path(folder).rglob("*") if not file.is_symlink())


if __name__ == "__main__":
    main()
