"""The documentation site: it builds without a warning, which a link to nowhere would be."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from er_gym.tasks.types import TASK_TYPES

pytest.importorskip("sphinx", reason="needs the extra docs")


def test_every_link_leads_somewhere_and_every_page_is_listed(
    repository: Path, tmp_path: Path
) -> None:
    # In a process of its own, since Sphinx changes how modules are imported. The builder "dummy"
    # reads all pages and resolves their links, and writes nothing.
    build = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "dummy"]
    ended = subprocess.run(
        [*build, str(repository / "docs"), str(tmp_path)],
        cwd=repository, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr


def test_each_environment_has_a_page_with_its_picture(repository: Path) -> None:
    pages = repository / "docs" / "environments"
    listed = (pages / "index.md").read_text("utf-8")
    for row in TASK_TYPES:
        assert f"({row.env_id}.md)" in listed
        assert f"images/environments/{row.env_id}.jpg" in (pages / f"{row.env_id}.md").read_text(
            "utf-8"
        )
    assert len(list(pages.glob("*.md"))) == len(TASK_TYPES) + 1
