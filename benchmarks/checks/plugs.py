"""Runs the test of plugs in environments of their own, beside the real libraries.

    python -m benchmarks.checks.plugs openenv [--folder DIR] [--python python3.12]

For each plug it makes a virtual environment, installs er-gym with what the plug's row requires,
and pytest, and runs ``tests/integrations/test_NAME.py`` there. It says which version of the library
ran, and how long it took. With --folder the environments stay, and the next run takes them up. It
needs a package index. Libraries that the tests' own environment has are tested by ``make test``.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path

import click
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from benchmarks.harness.output import ROOT
from er_gym.integrations.plugs import PLUGS, Plug

_TESTS_WITH = ("pytest>=9.0", "pytest-timeout>=2.3", "pytest-xdist>=3.6")


@click.command()
@click.argument("names", nargs=-1, metavar="[PLUG]...")
@click.option("--folder", type=click.Path(path_type=Path), help="Where the environments stay.")
@click.option(
    "--python",
    default=sys.executable,
    show_default=True,
    help="The Python that makes the environments.",
)
def main(names: tuple[str, ...], folder: Path | None, python: str) -> None:
    """Test the plugs of these names, by default all, each beside its library."""
    by_name = {plug.name: plug for plug in PLUGS}
    unknown = [name for name in names if name not in by_name]
    if unknown:
        raise click.UsageError(f"no plug {unknown[0]!r}; there are: {', '.join(by_name)}")
    failed = False
    with ExitStack() as stack:
        root = folder or Path(stack.enter_context(tempfile.TemporaryDirectory()))
        for name in names or by_name:
            started = time.perf_counter()
            code = tested(by_name[name], root / name, python)
            took = (time.perf_counter() - started) / 60
            mark = "--" if code else "ok"
            click.echo(f"{mark}  {name}  {took:.1f} min  {_versions(by_name[name], root / name)}")
            failed = failed or code != 0
    sys.exit(1 if failed else 0)


def tested(plug: Plug, environment: Path, python: str) -> int:
    """The exit code of a plug's test in an environment, which is made if it is not there."""
    inside = environment.absolute() / "bin" / "python"
    if not inside.exists():
        subprocess.run([python, "-m", "venv", str(environment)], check=True)
    ours = f".[{plug.extra}]" if plug.extra else "."
    wanted = [*_TESTS_WITH, *plug.requires, "--editable", ours]
    done = subprocess.run([str(inside), "-m", "pip", "install", "--quiet", *wanted], cwd=ROOT)
    if done.returncode:
        return done.returncode
    test = f"tests/integrations/test_{plug.module.rpartition('.')[2]}.py"
    # A test that is skipped, since its library cannot be imported, has not passed.
    return subprocess.run(
        [str(inside), "-m", "pytest", "-n0", "-rs", "--maxfail=5", test], cwd=ROOT
    ).returncode


def _versions(plug: Plug, environment: Path) -> str:
    """What is installed there of what a plug requires."""
    names = [Requirement(each).name for each in plug.requires]
    pip = [str(environment.absolute() / "bin" / "python"), "-m", "pip", "list", "--format=freeze"]
    listed = subprocess.run(pip, capture_output=True, text=True).stdout.splitlines()
    found = dict(line.split("==") for line in listed if "==" in line)
    there = {canonicalize_name(name): version for name, version in found.items()}
    return ", ".join(f"{name} {there.get(canonicalize_name(name), 'missing')}" for name in names)


if __name__ == "__main__":
    main()
