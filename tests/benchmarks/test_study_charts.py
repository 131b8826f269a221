"""A study's chart is told once: its picture and its place in a page show the same."""

from __future__ import annotations

import re

import pytest

from benchmarks.monitor.charts import as_svg
from benchmarks.scoring.metrics import Estimate
from benchmarks.scoring.series import Axis, Chart, Point, Series
from benchmarks.study.ablation_settings import Compared
from benchmarks.study.charts import Shown, comparison_chart, ladder_chart
from benchmarks.study.kinds import KINDS, Study
from benchmarks.study.paper_rungs import PAPER

RUNGS = [
    Shown("imitation", 0.0, Estimate(0.4, 0.3, 0.5), [0.4]),
    Shown("exploration", 0.0, Estimate(0.6, 0.5, 0.7), [0.6]),
    Shown("exploration", 0.1, Estimate(0.55, 0.45, 0.65), [0.55]),
    Shown("reflection", 0.0, None, []),
    Shown("random", 0.0, Estimate(0.03, 0.01, 0.06), [0.03]),
]
STUDY = Compared(title="Sizes", rows=("small", "large"), axis="size", numbers=(2, 64))


def test_a_ladder_has_a_line_for_each_rate_of_faults_and_no_line_to_the_controls() -> None:
    chart = ladder_chart("Success", RUNGS)
    told = {each.name: (each.kind, [point[:2] for point in each.points]) for each in chart.series}
    paper = [(0.0, PAPER["imitation"].success), (1.0, PAPER["exploration"].success)]
    assert told == {
        "this ladder": ("line", [(0.0, 40.0), (1.0, 60.0)]),
        "this ladder, 10 % of actions fail": ("line", [(1.0, pytest.approx(55.0))]),
        "played beside it": ("points", [(3.0, 3.0)]),
        "the paper's models, 809 tasks": ("bars", [*paper, (2.0, PAPER["reflection"].success)]),
    }
    assert chart.x.names == ["imitation", "exploration", "reflection", "random"]
    nothing = [Shown(each.name, each.faults, None, []) for each in RUNGS]
    assert as_svg("x", ladder_chart("Success", nothing)) == ""  # nor the paper's alone


def test_rows_stand_at_their_numbers_and_each_seed_has_a_dot() -> None:
    rows = [
        Shown("large", 0.0, Estimate(0.5, 0.4, 0.6), [0.45, 0.55]),
        Shown("small", 0.0, Estimate(0.2, 0.1, 0.3), [0.2]),
    ]
    every, dots = comparison_chart(STUDY, rows).series
    assert [point[:2] for point in every.points] == [(64.0, 50.0), (2.0, 20.0)]
    assert [(x, round(y)) for x, y, *_ in dots.points] == [(64, 45), (64, 55), (2, 20)]
    (alone,) = comparison_chart(STUDY, rows[1:]).series
    assert alone.kind == "line"
    unnumbered = Compared(title="Parts", rows=("small", "large"))
    chart = comparison_chart(unnumbered, rows)
    assert [point.x for point in chart.series[0].points] == [1.0, 0.0]
    assert (chart.x.names, chart.series[0].kind) == (("small", "large"), "points")


@pytest.mark.parametrize("chart", [ladder_chart("Success", RUNGS), comparison_chart(STUDY, [])])
def test_both_media_have_the_same_words(chart: Chart) -> None:
    pytest.importorskip("matplotlib", reason="needs the extra charts")
    from benchmarks.scoring.drawing import draw

    (axes,) = draw(chart).axes
    page = str(as_svg("x", chart)).replace("&#39;", "'")
    drawn = [each for each in chart.series if each.points]
    legend = axes.get_legend()
    names = [text.get_text() for text in legend.get_texts()] if legend else []
    assert sorted(names) == sorted(each.name for each in drawn if len(drawn) > 1)
    assert all(name in page for name in names)
    values = [f"{point.y:.0f}" for each in drawn if each.named for point in each.points]
    assert sorted(each.get_text() for each in axes.texts) == sorted(values)
    shown = re.findall(r'class="value"[^>]*>([^<]*)<', page)
    assert sorted(f"{float(each):.0f}" for each in shown) == sorted(values)


def test_intervals_are_whiskers_or_a_band() -> None:
    pytest.importorskip("matplotlib", reason="needs the extra charts")
    from benchmarks.scoring.drawing import draw

    found = [Point(0, 4, 3, 6), Point(1, 5, 5, 5)]
    (axes,) = draw(Chart("", Axis(), Axis(), [Series("a", found, whiskers=True)])).axes
    (bars,) = (each for each in axes.collections if len(each.get_segments()) == 2)
    assert [segment[:, 1].tolist() for segment in bars.get_segments()] == [[3, 6], [5, 5]]
    (axes,) = draw(Chart("", Axis(), Axis(), [Series("a", found)])).axes
    assert not any(spine.get_visible() for spine in axes.spines.values())
    (band,) = axes.collections
    assert {3.0, 6.0} <= set(band.get_paths()[0].vertices[:, 1])


@pytest.mark.parametrize("name", KINDS)
def test_a_study_that_has_not_been_measured_has_no_results(name: str, tmp_path) -> None:
    kind = KINDS[name]
    study = Study(kind, tmp_path, kind.load(kind.names()[0]))
    assert study.results() == []
    (tmp_path / f"{name}.json").write_text("{}")
    with pytest.raises(ValueError, match="settings"):
        Study.open(kind, tmp_path)
