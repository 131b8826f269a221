"""Another commit of this checkout in a folder of its own, for as long as it is needed."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from benchmarks.harness.output import ROOT


class Commit(click.ParamType):
    """A commit of this checkout, by any name that git knows, as its hash.

    Args:
        root: the checkout.
    """

    name = "commit"

    def __init__(self, root: Path = ROOT) -> None:
        self.root = root

    def convert(self, value: str, param: object, ctx: object) -> str:
        """The hash; click ends the script with exit code 2 where there is nothing to compare."""
        asked = ("rev-parse", "--verify", "--quiet", "--end-of-options", f"{value}^{{commit}}")
        found = _git(self.root, *asked)
        if found.returncode:
            why = found.stderr.strip().splitlines()
            told = f": {why[-1]}" if why else f"; `git -C {self.root} log --all` lists them"
            self.fail(f"git knows no commit {value!r}{told}")
        commit = found.stdout.strip()
        changed = _git(self.root, "diff", "--quiet", commit, "--").returncode
        added = _git(self.root, "ls-files", "--others", "--exclude-standard").stdout
        if not changed and not added:
            self.fail(f"this checkout is {value!r}, so there is nothing to compare")
        return commit


@contextmanager
def other_tree(commit: str, root: Path = ROOT) -> Iterator[Path]:
    """The files of a commit; they are gone at the end, after Ctrl-C, too.

    Raises:
        click.ClickException: git cannot make them.
    """
    folder = Path(tempfile.mkdtemp(prefix="er-gym-commit-"))
    tree = folder / "checkout"
    try:
        made = _git(root, "worktree", "add", "--quiet", "--detach", str(tree), commit)
        if made.returncode:
            raise click.ClickException(f"git cannot check out {commit}: {made.stderr.strip()}")
        yield tree
    finally:
        # The folder first: git then forgets a tree without one, however much it had made of it.
        shutil.rmtree(folder, ignore_errors=True)
        _git(root, "worktree", "prune")


def _git(root: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["git", "-C", str(root), *arguments], capture_output=True, text=True, check=False
    )
