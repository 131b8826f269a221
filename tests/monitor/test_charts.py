"""Charts as SVG: what they show, and that a log of any length costs little to show."""

from __future__ import annotations

import json
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

from benchmarks.monitor.charts import as_svg, round_ticks, tick_label
from benchmarks.monitor.curve_tail import CurveTail, last_line
from benchmarks.scoring.series import MOST_POINTS, Axis, Chart, Point, Series, decimated, points

SVG = "{http://www.w3.org/2000/svg}"


def drawn(markup: str) -> ElementTree.Element:
    return ElementTree.fromstring(str(markup).replace("<svg ", f'<svg xmlns="{SVG[1:-1]}" ', 1))


def places(line: ElementTree.Element) -> list[tuple[float, float]]:
    return [tuple(map(float, each.split(","))) for each in line.get("points", "").split()]


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [
        (0, 100, [0, 20, 40, 60, 80, 100]),
        (0, 0.004, [0, 0.001, 0.002, 0.003, 0.004]),
        (-3, 4, [-2, 0, 2, 4]),
        (7, 7, [7]),
    ],
)
def test_ticks_are_round(low, high, expected):
    assert round_ticks(low, high) == pytest.approx(expected)


def test_labels_of_ticks_are_short():
    assert [tick_label(x, [0, 6e4]) for x in (0, 2e4, 6e4)] == ["0", "20k", "60k"]
    assert tick_label(2.5e6, [5e6]) == "2.5M"
    assert tick_label(0.25, [1.0]) == "0.25"
    assert tick_label(2e-5, [1e-4]) == "2e-5"


def test_a_chart_is_to_scale_and_says_what_it_shows():
    lines = [
        Series("while <it> trains", points([(0, 0), (100, 50), (200, 100)])),
        Series("evaluation", [Point(100, 40, 30, 60)], whiskers=True),
    ]
    chart = Chart("Success & more", Axis("steps"), Axis("%", 0, 100), lines)
    markup = as_svg("x", chart)
    picture = drawn(markup)
    assert picture.get("role") == "img"
    assert picture.get("aria-labelledby") == "x-title x-desc"
    assert picture.find(f"{SVG}title").text == "Success & more"
    assert "while <it> trains: 3, 0 … 100" in picture.find(f"{SVG}desc").text
    (line,) = picture.iter(f"{SVG}polyline")
    (left, bottom), middle, (right, top) = places(line)
    assert middle == pytest.approx(((left + right) / 2, (bottom + top) / 2), abs=0.1)
    (whisker,) = (each for each in picture.iter(f"{SVG}path") if each.get("class") == "whisker")
    low, high = map(float, re.match(r"M[\d.]+ ([\d.]+)V([\d.]+)", whisker.get("d")).groups())
    assert low == pytest.approx(bottom + 0.3 * (top - bottom), abs=0.2)
    assert high == pytest.approx(bottom + 0.6 * (top - bottom), abs=0.2)
    looks = {each.get("class") for each in picture.findall(f"{SVG}g")}
    assert {"s0", "s1"} <= looks
    shapes = {each.get("d") for each in picture.iter(f"{SVG}path") if each.get("class") == "marker"}
    assert len(shapes) == 2
    assert as_svg("x", chart) == markup


def test_what_cannot_be_drawn_is_left_out():
    odd = points([(0, 1), (1, float("nan")), (2, float("inf")), (3, 0.0), (4, 10.0)])
    picture = drawn(as_svg("x", Chart("", Axis(), Axis(log=True), [Series("a", odd)])))
    (line,) = picture.iter(f"{SVG}polyline")
    assert len(places(line)) == 2
    assert as_svg("x", Chart("", Axis(), Axis(), [Series("a", [])])) == ""
    one = Chart("", Axis(), Axis(), [Series("a", points([(5, 3)]))])
    assert "polyline" not in as_svg("x", one)


def test_long_series_keep_their_range():
    long = points([(x, float(x % 7)) for x in range(10_000)])
    short = decimated(long)
    assert len(short) <= MOST_POINTS
    assert {(point.low, point.high) for point in short} == {(0.0, 6.0)}
    assert short[0].x == pytest.approx(9.5)


def test_a_log_is_followed_in_few_points_however_it_is_read(tmp_path: Path):
    log = tmp_path / "metrics.jsonl"
    lines = [
        json.dumps({"update": n, "loss": 1000.0 - n, **({"eval": 1.0} if n == 77 else {})}) + "\n"
        for n in range(3_000)
    ]
    log.write_text("".join(lines[:1_000]) + lines[1_000][:9])
    tail = CurveTail(log, "update")
    tail.read()
    assert tail.lines == 1_000
    log.write_text("".join(lines))  # the same file, grown
    tail.read()
    at_once = CurveTail(log, "update")
    at_once.read()
    assert tail.points("loss") == at_once.points("loss")
    found = tail.points("loss")
    assert len(found) <= MOST_POINTS
    assert (found[0].high, found[-1].low) == (1000.0, -1999.0)
    assert [point.x for point in tail.points("eval")] == [77]
    assert tail.last["loss"] == last_line(log)["loss"] == -1999.0
    # A run that goes on from a checkpoint replaces its log.
    other = tmp_path / "new"
    other.write_text("".join(lines[:500]))
    other.replace(log)
    tail.read()
    assert tail.lines == 500


def test_lines_that_are_no_figures_are_passed_over(tmp_path: Path):
    log = tmp_path / "metrics.jsonl"
    lines = ['{"update": 1, "loss": 2}', "no JSON", "[1]", '{"update": "x", "loss": 1}',
             '{"update": 2, "loss": NaN}', '{"update": 3, "loss": 1' + "0" * 400 + "}",
             '{"update": 4, "loss": 5}']  # fmt: skip
    log.write_text("\n".join(lines) + "\n")
    tail = CurveTail(log, "update")
    tail.read()
    assert [point[:2] for point in tail.points("loss")] == [(1, 2), (4, 5)]
