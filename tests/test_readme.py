"""What the README shows is what one gets."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

from er_gym.sim.actions import ACTIONS


def test_the_python_example_runs(repository: Path) -> None:
    (example,) = re.findall(r"```python\n(.*?)```", (repository / "README.md").read_text(), re.S)
    done = subprocess.run([sys.executable, "-c", example], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("Task: ")
    assert " -> " in done.stdout


def test_every_picture_and_page_is_there(repository: Path) -> None:
    for link in re.findall(r"\]\(([^)#]+)\)", (repository / "README.md").read_text()):
        if "://" not in link:
            assert (repository / link).exists(), link


def test_the_list_of_actions_is_complete(repository: Path) -> None:
    page = (repository / "docs" / "fidelity.md").read_text().partition("## Actions")[2]
    assert set(re.findall(r"\w+", page)) == {*ACTIONS, "Reset"}
