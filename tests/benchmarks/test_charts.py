from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from PIL import Image
from support import make_task, run_python

from benchmarks.scoring.charts import draw_charts
from er_gym.tasks import load_suite

NAMES = ["types.png", "objects.png", "receptacles.png", "lengths.png", "rooms.png"]


@pytest.fixture
def matplotlib():
    return pytest.importorskip("matplotlib", reason="needs matplotlib: pip install matplotlib")


def sizes(paths: list[Path]) -> list[tuple[int, int]]:
    """Width and height in pixels of images, each of which is decoded whole and is not blank."""
    found = []
    for path in paths:
        with Image.open(path) as image:
            assert image.format == "PNG"
            pixels = image.convert("RGB")
        assert all(low < 128 and high == 255 for low, high in pixels.getextrema())
        found.append(pixels.size)
    return found


def test_the_bundled_suite(matplotlib, tmp_path: Path) -> None:
    settings = dict(matplotlib.rcParams)
    pyplot = sys.modules.get("matplotlib.pyplot")
    paths = draw_charts(load_suite("mini").tasks, tmp_path / "new" / "charts", "mini")
    assert paths == [tmp_path / "new" / "charts" / name for name in NAMES]
    for width, height in sizes(paths):
        assert 700 <= width <= 1500
        assert 450 <= height <= 1200
    # The drawing settings of other code have not changed.
    assert dict(matplotlib.rcParams) == settings
    assert sys.modules.get("matplotlib.pyplot") is pyplot


def test_the_same_tasks_give_the_same_pictures(matplotlib, tmp_path: Path) -> None:
    tasks = load_suite("mini").tasks
    first = [path.read_bytes() for path in draw_charts(tasks, tmp_path, "mini")]
    assert [path.read_bytes() for path in draw_charts(tasks, tmp_path, "mini")] == first


def test_many_tasks_and_a_long_title(matplotlib, tmp_path: Path) -> None:
    tasks = [
        replace(task, id=f"{task.id}-{n}") for task in load_suite("mini").tasks for n in range(86)
    ]
    title = "A suite of a name that is rather longer than any that somebody would give it"
    # As wide as for few: titles are wrapped and figures fit.
    for width, _ in sizes(draw_charts(tasks, tmp_path, title)):
        assert 700 <= width <= 1500


def test_one_task_of_nothing_in_particular(matplotlib, tmp_path: Path) -> None:
    paths = draw_charts([make_task("single_search")], tmp_path, "one")
    assert [path.name for path in paths] == NAMES
    assert all(width > 300 and height > 100 for width, height in sizes(paths))


def test_no_tasks(matplotlib, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="there are no tasks to draw charts of"):
        draw_charts([], tmp_path, "none")
    assert not list(tmp_path.iterdir())


DRAW = """
import os, sys
from pathlib import Path
from benchmarks.scoring import curves, drawing
class Run:
    curve = [{"steps": 1, "seconds": 1, "rollout/success_rate": 0.5, "eval/success_rate": 0.5}] * 2
def draw(out):
    curves.draw_curves({"one": [Run()]}, out)
    with drawing.own_style():
        figure, _ = drawing.canvas(3, 2, "alone")
    drawing.write_charts(out, {"alone": figure}, force=False)
if __name__ == "__main__":
    draw(Path(sys.argv[1]))
    assert "matplotlib.pyplot" not in sys.modules
    print(os.environ["MPLBACKEND"])
"""


def test_no_backend_and_no_style_of_the_users_changes_a_chart(matplotlib, tmp_path: Path) -> None:
    """As a notebook leaves the variable for a Python that lacks the notebook's packages."""
    (tmp_path / "matplotlibrc").write_text("font.size: 30\ntext.usetex: True\n", encoding="utf-8")
    given = {"MPLBACKEND": "module://no_such_package.backend_inline", "MATPLOTLIBRC": str(tmp_path)}
    done = run_python(DRAW, str(tmp_path / "odd"), **given)
    assert done.stdout.strip() == given["MPLBACKEND"]  # others read it
    here: dict[str, Any] = {}
    exec(DRAW, here)
    here["draw"](tmp_path / "plain")
    names = ["alone.png", "learning_seconds.png", "learning_steps.png"]
    assert sorted(each.name for each in (tmp_path / "odd").iterdir()) == names
    for name in names:
        assert (tmp_path / "odd" / name).read_bytes() == (tmp_path / "plain" / name).read_bytes()


def test_only_one_module_makes_figures(repository: Path) -> None:
    modules = [
        each
        for folder in ("agents", "benchmarks", "er_gym")
        for each in (repository / folder).rglob("*.py")
    ]
    marks = (" Figure((", "FigureCanvas", "import matplotlib.pyplot", "from matplotlib import")
    makers = [
        each.name
        for each in modules
        if any(mark in each.read_text(encoding="utf-8") for mark in marks)
    ]
    assert makers == ["drawing.py"]


def test_matplotlib_is_asked_for_where_it_is_missing(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(
        ImportError, match=r"charts need matplotlib: pip install 'er-gym\[charts\]'"
    ):
        draw_charts([make_task("single_search")], tmp_path, "one")
