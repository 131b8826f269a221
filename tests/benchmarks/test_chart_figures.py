"""Charts show the numbers that they are about: read off the figures, not the pixels."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from support import make_task

from benchmarks.scoring import charts, data_charts, drawing
from er_gym.data.paper_figures import THOUGHTS, TRANSITIONS
from er_gym.data.statistics import STATES, PartStatistics, Statistics
from er_gym.data.trajectory import THOUGHT_KINDS
from er_gym.writing import ForeignFile

pytest.importorskip("matplotlib", reason="needs matplotlib: pip install matplotlib")

MUG, BOOK, BED, DESK = (f"{kind}|+00.00|+01.00|+02.00" for kind in ("Mug", "Book", "Bed", "Desk"))
TASKS = (
    *[make_task("single_search", ("navigate to", DESK), scene="FloorPlan301")] * 3,
    make_task("single_search", ("navigate to", DESK), scene="FloorPlan1"),
    *[make_task("single_pickup", ("navigate to", BED), ("pickup", BOOK), scene="FloorPlan301")] * 2,
    make_task("single_pickup", ("navigate to", DESK), ("pickup", MUG), scene="FloorPlan301"),
)
"""Four tasks of two key actions, ``end`` included, three of three."""


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[..., dict[str, Any]]:
    """Draws without writing: the figures by the names of their files."""
    found: dict[str, Any] = {}

    def keep(path: Path, figure: Any, **_: Any) -> None:
        found[path.stem] = figure

    monkeypatch.setattr(drawing, "write_figure", keep)

    def run(draw: Callable[..., Any], *arguments: Any) -> dict[str, Any]:
        found.clear()
        draw(arguments[0], tmp_path, *arguments[1:])
        return dict(found)

    return run


def texts(figure: Any) -> list[str]:
    return [each.get_text() for each in figure.axes[0].texts]


def labels(figure: Any, axis: str) -> list[str]:
    return [each.get_text() for each in getattr(figure.axes[0], f"get_{axis}ticklabels")()]


def legend(figure: Any) -> list[str]:
    return [each.get_text() for (one,) in [figure.legends] for each in one.get_texts()]


def places(figure: Any) -> list[tuple[float, float]]:
    """Where the notes are: x and y of the data."""
    return [each.xy for each in figure.axes[0].texts]


def test_bars_are_as_long_as_there_are_tasks(drawn: Callable[..., dict[str, Any]]) -> None:
    figures = drawn(charts.draw_charts, TASKS, "ours")
    types = figures["types"]
    assert types.get_suptitle() == "ours: tasks by type, n = 7"
    assert [bar.get_width() for bar in types.axes[0].patches] == [4, 3]
    assert texts(types) == ["4", "3"]
    assert places(types) == [(4, 0), (3, 1)]
    assert len({bar.get_facecolor() for bar in types.axes[0].patches}) == 2  # a shade per group
    assert legend(types) == ["Search (4)", "Manipulate (3)"]
    low, high = types.axes[0].get_ylim()
    assert low > 1
    assert high < 0  # the first on top
    objects, receptacles = figures["objects"], figures["receptacles"]
    assert objects.get_suptitle() == "ours: tasks by type of the first object handled, n = 7"
    assert [bar.get_width() for bar in receptacles.axes[0].patches] == [5, 2]
    assert labels(receptacles, "y") == ["Desk", "Bed"]
    assert receptacles.axes[0].get_xlim()[0] == 0
    assert receptacles.axes[0].get_xlim()[1] > 5  # room for the figure


def test_only_the_most_frequent_are_shown(
    drawn: Callable[..., dict[str, Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(charts, "_TOP", 1)
    figure = drawn(charts.draw_charts, TASKS, "ours")["receptacles"]
    title = "ours: tasks that go to each type of receptacle, the top 1 of 2 types, n = 7"
    assert " ".join(figure.get_suptitle().split()) == title
    assert labels(figure, "y") == ["Desk"]


def test_lengths_are_stacked_by_group(drawn: Callable[..., dict[str, Any]]) -> None:
    long = make_task("single_toggle", *[("navigate to", DESK)] * 4)
    figure = drawn(charts.draw_charts, (*TASKS, long), "ours")["lengths"]
    bars = [(bar.get_x() + 0.4, bar.get_y(), bar.get_height()) for bar in figure.axes[0].patches]
    bars = [(round(x, 6), low, high) for x, low, high in bars if high]
    assert bars == [(2, 0, 4), (3, 0, 3), (5, 0, 1)]
    assert list(zip(texts(figure), places(figure), strict=True)) == [
        ("4", (2, 4)),
        ("3", (3, 3)),
        ("1", (5, 1)),
    ]
    assert figure.axes[0].get_xticks().tolist() == [2, 3, 4, 5]
    both = (*TASKS, make_task("single_pickup", ("pickup", MUG)))  # of two key actions, too
    figure = drawn(charts.draw_charts, both, "ours")["lengths"]
    stacked = [bar for bar in figure.axes[0].patches if bar.get_y()]
    assert [(bar.get_y(), bar.get_height()) for bar in stacked] == [(4, 1)]
    assert texts(figure) == ["5", "3"]


def test_every_type_and_kind_of_room_has_its_number(drawn: Callable[..., dict[str, Any]]) -> None:
    figure = drawn(charts.draw_charts, TASKS, "ours")["rooms"]
    cells = {each.get_position(): each for each in figure.axes[0].texts}
    assert {at: each.get_text() for at, each in cells.items()} == {
        (0.5, 0.5): "1",
        (1.5, 0.5): "3",
        (0.5, 1.5): "0",
        (1.5, 1.5): "3",
    }
    assert {at: each.get_color() for at, each in cells.items()} == {
        (0.5, 0.5): drawing.INK,
        (1.5, 0.5): "white",  # on a dark ground
        (0.5, 1.5): drawing.MUTED,
        (1.5, 1.5): "white",
    }
    assert [each.split("\n") for each in labels(figure, "x")] == [
        ["kitchen", "1"],
        ["bedroom", "6"],
    ]
    assert [each.split("  ")[1] for each in labels(figure, "y")] == ["4", "3"]


STATISTICS = Statistics(
    name="ours",
    parts={
        "imitation": PartStatistics(trajectories=3, actions=Counter({2: 2, 5: 1})),
        "": PartStatistics(trajectories=1, actions=Counter({2: 1})),
    },
    thoughts=Counter({"planning": 3, "reflection": 1}),
)
STATISTICS.transitions["begin"].update({"analysis": 1, "action": 3})


def test_what_follows_what_beside_the_papers_shares(drawn: Callable[..., dict[str, Any]]) -> None:
    figure = drawn(data_charts.draw_statistics, STATISTICS)["transitions"]
    at = {(round(x, 2), round(y, 2)): text for x, y, text in _cells(figure)}
    columns = STATES[1:]
    for y, row in enumerate(STATES):
        for x, column in enumerate(columns):
            ours = {("begin", "analysis"): 25, ("begin", "action"): 75}.get((row, column), 0)
            theirs = TRANSITIONS[row].get(column, 0)
            assert at[x + 0.5, round(y + 0.4, 2)].get_text() == str(ours)
            below = at.get((x + 0.5, round(y + 0.72, 2)))
            assert (below and below.get_text()) == (f"({theirs})" if ours or theirs else None)
    place = columns.index("action") + 0.5
    assert at[place, 0.4].get_color() == "white"
    assert at[columns.index("analysis") + 0.5, 0.4].get_color() == drawing.INK
    assert labels(figure, "x") == list(columns)
    assert labels(figure, "y") == list(STATES)


def _cells(figure: Any) -> list[tuple[float, float, Any]]:
    return [(*each.get_position(), each) for each in figure.axes[0].texts]


def test_kinds_of_thoughts_beside_the_papers(drawn: Callable[..., dict[str, Any]]) -> None:
    figure = drawn(data_charts.draw_statistics, STATISTICS)["kinds"]
    assert figure.get_suptitle() == "ours: thoughts by kind, in %, n = 4"
    widths = [bar.get_width() for bar in figure.axes[0].patches]
    number = len(THOUGHT_KINDS)
    ours = [{"planning": 75, "reflection": 25}.get(kind, 0) for kind in THOUGHT_KINDS]
    assert widths[:number] == ours
    theirs = [100 * THOUGHTS[kind] / sum(THOUGHTS.values()) for kind in THOUGHT_KINDS]
    assert widths[number:] == pytest.approx(theirs)
    assert texts(figure) == [f"{width:.1f}" for width in widths]
    assert legend(figure) == ["this collection", "the paper"]
    heights = [bar.get_y() + bar.get_height() / 2 for bar in figure.axes[0].patches]
    assert heights[::number] == pytest.approx(
        [-0.2, 0.2]
    )  # ours above the paper's, as y grows downwards
    none = drawn(data_charts.draw_statistics, Statistics(parts=STATISTICS.parts))["kinds"]
    assert [bar.get_width() for bar in none.axes[0].patches][:number] == [0] * len(THOUGHT_KINDS)


def test_lengths_of_trajectories_by_part(drawn: Callable[..., dict[str, Any]]) -> None:
    figure = drawn(data_charts.draw_statistics, STATISTICS)["actions"]
    title = "ours: trajectories by number of actions, mean 2.75, n = 4"
    assert " ".join(figure.get_suptitle().split()) == title
    bars = [(bar.get_y(), bar.get_height()) for bar in figure.axes[0].patches]
    assert bars == [(0, 2), (0, 0), (0, 0), (0, 1), (2, 1), (0, 0), (0, 0), (1, 0)]
    assert legend(figure) == ["imitation (mean 3.00, paper's set 1: 4.11)", "no part (mean 2.00)"]
    assert figure.axes[0].get_xticks().tolist() == [2, 3, 4, 5]
    assert figure.axes[0].get_xlim() == pytest.approx((1.3, 5.7))
    many = Statistics(parts={"": PartStatistics(actions=Counter({1: 1, 60: 1}))})
    ticks = drawn(data_charts.draw_statistics, many)["actions"].axes[0].get_xticks().tolist()
    assert ticks == [*range(1, 61, 2)]


@pytest.mark.parametrize(
    ("draw", "about", "last"),
    [
        (charts.draw_charts, (TASKS[:1], "ours"), "rooms.png"),
        (data_charts.draw_statistics, (STATISTICS,), "actions.png"),
    ],
)
def test_a_strangers_file_is_kept_and_nothing_is_drawn_beside_it(
    tmp_path: Path, draw: Callable[..., Any], about: tuple[Any, ...], last: str
) -> None:
    (tmp_path / last).write_bytes(b"mine")
    what, *title = about
    with pytest.raises(ForeignFile):
        draw(what, tmp_path, *title, force=False)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {last: b"mine"}


def test_the_draws_ask_for_matplotlib_where_it_is_missing(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(ImportError, match=r"pip install 'er-gym\[charts\]'"):
        data_charts.draw_statistics(STATISTICS, tmp_path)
