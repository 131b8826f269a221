"""Measuring this checkout beside another commit, in a small repository."""

from __future__ import annotations

import subprocess
from pathlib import Path

import click
import pytest

from benchmarks.harness.worktree import Commit, other_tree
from benchmarks.perf.against import Compared, compare, show

SCRIPT = """
import json, sys
rows = [("steps", {rate}, "steps/s"), ("start", {start}, "s"), ("same", 1.0, "MiB"), *{more}]
figures = [{{"name": name, "value": value, "unit": unit}} for name, value, unit in rows]
if "--seconds" in sys.argv:
    open(sys.argv[sys.argv.index("--json") + 1], "w").write(
        json.dumps({{"format": "er-gym/figures/1", "figures": figures}})
    )
"""


def _git(root: Path, *arguments: str) -> str:
    own = ["-c", "user.name=a", "-c", "user.email=a@b.c"]
    told = subprocess.run(
        ["git", "-C", str(root), *own, *arguments], check=True, capture_output=True, text=True
    )
    return told.stdout.strip()


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A repository with a measuring script; what it measures has changed since its commit."""
    _git(tmp_path, "init", "--quiet")
    (tmp_path / "speed.py").write_text(SCRIPT.format(rate=100.0, start=1.0, more=[]))
    _git(tmp_path, "add", ".")
    _git(tmp_path, "commit", "--quiet", "-m", "first")
    more = [("new here", 1.0, "s")]
    (tmp_path / "speed.py").write_text(SCRIPT.format(rate=50.0, start=0.5, more=more))
    return tmp_path


def _trees(root: Path) -> int:
    return len(_git(root, "worktree", "list").splitlines())


def test_both_sides_run_and_the_loss_is_marked(checkout: Path, capsys):
    commit = Commit(checkout).convert("HEAD", None, None)
    rows = compare("speed", ["--seconds", "1"], commit, 3, checkout)
    assert [(row.name, row.ratio, row.lost) for row in rows] == [
        ("steps", 0.5, True),
        ("start", 2.0, False),
        ("same", 1.0, False),
    ]
    assert (rows[0].then, rows[0].now) == ((100.0,) * 3, (50.0,) * 3)
    assert show(rows, commit)
    told = capsys.readouterr().out
    assert "1 of 3 rows are worse" in told
    assert not show(rows[1:], commit)
    assert _trees(checkout) == 1


@pytest.mark.parametrize(
    ("now", "lost"),
    [
        ((80.0, 90.0, 89.0), True),
        ((80.0, 85.0, 95.0), False),  # one round is as good as one of then
        ((90.0, 90.4, 90.5), True),
        ((98.5, 98.6, 98.7), False),  # all are below, but by next to nothing
    ],
)
def test_a_loss_within_the_noise_is_none(now: tuple[float, ...], lost: bool):
    then = (99.0, 94.0, 110.0) if max(now) < 98 else (99.0, 99.1, 99.2)
    assert Compared("steps", "steps/s", then, now).lost is lost
    assert (
        Compared("time", "ms", tuple(1 / x for x in then), tuple(1 / x for x in now)).lost is lost
    )


def test_a_commit_that_cannot_be_compared_with_is_one_line(checkout: Path):
    with pytest.raises(click.BadParameter, match="git knows no commit 'nowhere'"):
        Commit(checkout).convert("nowhere", None, None)
    with pytest.raises(click.BadParameter, match="git knows no commit '--all'"):
        Commit(checkout).convert("--all", None, None)
    with pytest.raises(click.BadParameter, match="not a git repository"):
        Commit(Path("/")).convert("HEAD", None, None)
    _git(checkout, "checkout", "--quiet", "speed.py")
    with pytest.raises(click.BadParameter, match="nothing to compare"):
        Commit(checkout).convert("HEAD", None, None)
    (checkout / "new.py").write_text("")
    assert Commit(checkout).convert("HEAD", None, None) == _git(checkout, "rev-parse", "HEAD")


def test_a_script_that_fails_or_has_other_figures_is_one_line(checkout: Path):
    commit = _git(checkout, "rev-parse", "HEAD")
    with pytest.raises(click.ClickException, match=r"the script of .* No module named lost"):
        compare("lost", [], commit, 3, checkout)
    with pytest.raises(click.ClickException, match="writes no figures that this one reads"):
        compare("speed", [], commit, 3, checkout)
    assert _trees(checkout) == 1


def test_the_other_tree_is_gone_after_ctrl_c(checkout: Path):
    commit = _git(checkout, "rev-parse", "HEAD")
    seen = []

    def interrupted() -> None:
        with other_tree(commit, checkout) as tree:
            seen.append((tree, (tree / "speed.py").read_text(), _trees(checkout)))
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    [(tree, text, trees)] = seen
    assert "100.0" in text
    assert (trees, _trees(checkout), tree.parent.exists()) == (2, 1, False)
