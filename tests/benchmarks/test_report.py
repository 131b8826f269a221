from __future__ import annotations

import csv
import io
import json

import pytest
from rich.console import Console

from benchmarks.cli import options as cli_options
from benchmarks.scoring import report
from benchmarks.scoring.metrics import METRICS, summarise
from benchmarks.scoring.report import load_run
from benchmarks.scoring.tables import print_tables, tables
from er_gym.envs.protocol import PROTOCOLS
from er_gym.rollout.run_directory import RunDirectory
from er_gym.tables import as_markdown

KEYS = ("navigate to CounterTop", "pickup Egg", "navigate to Bowl", "put in Bowl", "end")
UNTYPED = ("pickup Egg", "put in = Plate|-01.47|+01.31|+00.24", "end")
LONG_RANGE = "long-range tasks with dependency relationships"


@pytest.fixture
def run(run_directory, episode):
    """One success, and one that only the corrected scorer sees: 2 of a suite of 2."""
    run_directory.write(episode(KEYS, KEYS))
    played = ("pickup Egg", "put in Plate", "end")
    run_directory.write(episode(UNTYPED, played, task_id="task-2", task_type=LONG_RANGE))
    return load_run(run_directory.path)


@pytest.fixture
def failing_run(run_directory, episode):
    """One success, one given up, one crashed, out of a suite that says it has 2."""
    run_directory.write(episode(KEYS, KEYS))
    run_directory.write(
        episode(
            KEYS,
            ("!pickup Egg", "!pickup | Egg"),
            task_id="task-2",
            end_reason="step limit",
        )
    )
    run_directory.write(
        episode(KEYS, (), task_id="task-3", end_reason="", error="ValueError: no\nmore")
    )
    return load_run(run_directory.path)


def test_where_the_scorers_differ_there_are_two_rows_and_a_note(run):
    overview = tables([run])[0]
    assert overview.title == "Results, suite hand-made, in %"
    # Wilson for 1 of 2 is 9.45 to 90.55, for 2 of 2 it is 34.24 to 100.
    # Efficiency: 6/6 and, with three key actions in four steps, 4/4.
    assert overview.rows == (
        (
            *("oracle", "paper", "2", "50.00", "9.5 to 90.5"),
            *("50.00", "83.33", "-", "-", "100.00", "0.00"),
        ),
        (
            *("oracle", "corrected", "2", "100.00", "34.2 to 100.0"),
            *("100.00", "100.00", "-", "-", "100.00", "100.00"),
        ),
    )
    assert overview.notes == (
        f"{run.path}: the scorers differ in 1 of 2 episodes; er-gym report {run.path} "
        "--format json lists them as scorers_differ",
    )
    assert json.loads(report.as_json([run]))["runs"][0]["scorers_differ"] == ["task-2"]


def test_every_metric_has_its_interval(run):
    *_, paper, corrected = tables([run])
    assert paper.title == f"{run.path}, scorer paper: every metric, in %"
    assert corrected.head == ("", "n", "Mean", "95 %")
    rows = {name: cells for name, *cells in corrected.rows}
    summary = summarise(run.scores["corrected"])
    for metric in METRICS:
        name = metric.replace("_", " ").capitalize()
        estimate = summary[metric]
        assert rows[name] == [
            "2",
            f"{100 * estimate.mean:.2f}",
            f"{100 * estimate.low:.1f} to {100 * estimate.high:.1f}",
        ]
    assert rows["Success"] == ["2", "100.00", "34.2 to 100.0"]
    assert rows["Success: Transport"] == ["1", "100.00", "20.7 to 100.0"]
    assert "Wilson" in corrected.notes[0]
    out = io.StringIO()
    print_tables(tables([run]), Console(file=out, width=100))
    noted = ("scorers_differ", str(run.path))
    lines = out.getvalue().splitlines()
    assert all(len(line) <= 100 for line in lines if not any(word in line for word in noted))
    # A table for each of many runs would bury the one of all.
    assert len(tables([run] * 3)) == 1


def test_success_by_arrangement_of_the_rooms(run_directory, episode):
    for arrangement, actions in (("7", KEYS), ("9", ())):
        for kind in ("pickup_and_put-Egg", "pickup_and_put-Cup"):
            task = f"FloorPlan1-{arrangement}-{kind}"
            run_directory.write(episode(KEYS, actions, task_id=task))
    run = load_run(run_directory.path)
    # Both tasks of an arrangement end alike, so two arrangements tell no more than two tasks.
    *_, table = tables([run], scorer="corrected")
    rows = {name: cells for name, *cells in table.rows}
    assert rows["Success"] == ["4", "50.00", "15.0 to 85.0"]
    assert rows["Success, by arrangement"] == ["2", "50.00", "9.5 to 90.5"]
    assert any("arrangement of the rooms" in note for note in table.notes)
    (data,) = json.loads(report.as_json([run]))["runs"]
    told = data["scorers"]["corrected"]["between_arrangements"]
    assert told["arrangements"] == 2
    assert told["success"]["low"] == pytest.approx(0.0945, abs=1e-4)
    # Where each task has an arrangement of its own, there is nothing to add.
    assert report.between_arrangements(run.episodes[1:3], run.scores["corrected"][1:3]) is None
    # Nor does a single arrangement tell how much they differ.
    assert report.between_arrangements(run.episodes[:2], run.scores["corrected"][:2]) is None


def test_where_they_agree_there_is_one(run_directory, episode):
    run_directory.write(episode(KEYS, KEYS))
    overview = tables([load_run(run_directory.path)])[0]
    assert overview.title == "Results, suite hand-made, scorer both, in %"
    assert [row[:3] for row in overview.rows] == [("oracle", "1/2", "100.00")]


@pytest.mark.parametrize(("scorer", "rate"), [("paper", "50.00"), ("corrected", "100.00")])
def test_one_scorer_can_be_chosen(run, scorer, rate):
    overview = tables([run], scorer=scorer)[0]
    assert f"scorer {scorer}" in overview.title
    assert [row[2] for row in overview.rows] == [rate]


def test_the_columns_are_the_papers(run):
    assert tables([run])[0].head[-7:] == (
        "95 %",
        "Search efficiency",
        "Task completeness",
        "Search",
        "Manipulate",
        "Transport",
        "Composite",
    )


def test_a_run_without_episodes_is_a_row_of_dashes(run_directory):
    loaded = load_run(run_directory.path)
    (row,) = tables([loaded], with_types=True, with_misses=True)[0].rows
    assert row[1:] == ("0/2", *["-"] * 8)
    assert json.loads(report.as_json([loaded]))["runs"][0]["episodes"] == 0
    assert len(report.as_csv([loaded]).splitlines()) == 1


def test_what_differs_between_runs_has_a_column(run, tmp_path, manifest, episode):
    other = RunDirectory.create(tmp_path / "y", manifest.model_copy(update={"suite": "other"}))
    other.write(episode(KEYS, KEYS))
    overview = tables([run, load_run(other.path)])[0]
    assert overview.title == "Results, in %"
    assert overview.head[:4] == ("Agent", "Suite", "Scorer", "n")
    assert [row[:4] for row in overview.rows] == [
        ("oracle", "hand-made", "paper", "2"),
        ("oracle", "hand-made", "corrected", "2"),
        ("oracle", "other", "both", "1/2"),
    ]


def test_another_protocol_than_the_default_is_named(run, tmp_path, manifest, episode):
    env = {**manifest.env, "protocol": "paper"}
    other = RunDirectory.create(tmp_path / "y", manifest.model_copy(update={"env": env}))
    other.write(episode(KEYS, KEYS))
    papers = load_run(other.path)
    assert "protocol paper" in tables([papers])[0].title
    both = tables([run, papers])[0]
    assert both.head[:3] == ("Agent", "Protocol", "Scorer")
    assert [row[1] for row in both.rows] == ["default", "default", "paper"]
    rows = csv.DictReader(io.StringIO(report.as_csv([run, papers])))
    assert {row["run"]: row["protocol"] for row in rows} == {
        str(run.path): "default",
        str(papers.path): "paper",
    }
    data = json.loads(report.as_json([run, papers]))["runs"]
    assert data[0]["suite_version"] is None  # these are no tasks of er-gym's suites
    assert {each["version"] for each in data[0]["scorers"].values()} == {1}
    assert [each["protocol"] for each in data] == ["default", "paper"]


def test_by_type(run):
    _, paper, corrected, *_ = tables([run], with_types=True)
    assert paper.title.endswith("scorer paper, in %")
    assert [row[:2] for row in paper.rows] == [
        ("All", "2"),
        ("Transport", "1"),
        ("Composite", "1"),
        ("Exposed-to-Exposed Object Transfer", "1"),
        ("Long-Range Task with Dependencies", "1"),
    ]
    by_name = {row[0]: dict(zip(paper.head, row, strict=True)) for row in paper.rows}
    assert by_name["Composite"]["Success"] == "0.00"
    assert by_name["Composite"]["Ordered completeness"] == "66.67"
    assert by_name["Transport"]["Steps saved"] == "80.00"
    assert corrected.rows[2][2] == "100.00"


def test_misses_say_why(failing_run):
    misses = tables([failing_run], with_misses=True)[1]
    assert misses.title.endswith("2 of 3 episodes without success")
    assert misses.rows == (
        (
            *("task-2", "pickup_and_put", "FloorPlan1", "step limit"),
            *("you cannot: pickup | Egg", "pickup Egg, put in Bowl, end"),
        ),
        (
            *("task-3", "pickup_and_put", "FloorPlan1", "crashed"),
            *("ValueError: no more", "pickup Egg, put in Bowl, end"),
        ),
    )


def test_crashes_are_noted(failing_run):
    assert tables([failing_run])[0].notes == (
        f"{failing_run.path}: 1 of 3 episodes crashed and count as failures; "
        "running the same command again plays them again",
    )


def test_markdown(failing_run):
    text = as_markdown(tables([failing_run], with_misses=True))
    lines = text.splitlines()
    assert lines[0] == "**Results, suite hand-made, scorer both, in %**"
    assert lines[2].startswith("| Agent | n | Success | 95 % |")
    assert lines[3].startswith("| --- | ---: |")
    widths = {line.replace("\\|", "").count("|") for line in lines[2:5]}
    assert widths == {11}
    assert "you cannot: pickup \\| Egg" in text


def test_csv_has_a_line_per_slice(run):
    rows = list(csv.DictReader(io.StringIO(report.as_csv([run]))))
    slices = [(row["scorer"], row["level"], row["name"]) for row in rows]
    assert slices == [
        (scorer, level, name)
        for scorer in ("paper", "corrected")
        for level, name in [("overall", "all"), ("group", "Transport"), ("group", "Composite")]
    ]
    assert float(rows[0]["success"]) == 0.5
    assert float(rows[0]["completeness"]) == pytest.approx(5 / 6)
    assert float(rows[0]["success_low"]) == pytest.approx(0.0945, abs=1e-4)
    assert rows[1]["completeness_low"] == ""  # one episode has no interval
    with_types = csv.DictReader(io.StringIO(report.as_csv([run], "paper", with_types=True)))
    assert [row["level"] for row in with_types] == ["overall", "group", "group", "type", "type"]


def test_json_carries_everything(failing_run):
    (data,) = json.loads(report.as_json([failing_run]))["runs"]
    assert data["manifest"]["suite_digest"] == "abc"
    assert (data["episodes"], data["crashed"], data["scorers_differ"]) == (3, 1, [])
    assert set(data["scorers"]) == {"paper", "corrected"}
    overall, group, kind = data["scorers"]["paper"]["slices"]
    assert (overall["level"], overall["n"]) == ("overall", 3)
    assert overall["success"]["mean"] == pytest.approx(1 / 3)
    assert (group["name"], kind["name"]) == ("Transport", "pickup_and_put")
    assert [each["success"] for each in data["scorers"]["corrected"]["episodes"]] == [
        True,
        False,
        False,
    ]
    assert [miss["task_id"] for miss in data["misses"]] == ["task-2", "task-3"]


@pytest.mark.parametrize("width", [40, 80, 240])
def test_nothing_is_cut_off(run, failing_run, width):
    shown = tables([run, failing_run], with_types=True, with_misses=True)
    out = io.StringIO()
    print_tables(shown, Console(file=out, width=width))
    figures = [cell for table in shown for row in table.rows for cell in row[table.text_columns :]]
    text = out.getvalue()
    assert len(figures) > 50
    for figure in set(figures):
        assert text.count(figure) >= figures.count(figure)


def test_a_narrow_terminal_turns_the_results(run):
    def lines(width):
        out = io.StringIO()
        print_tables(tables([run])[:1], Console(file=out, width=width))
        return [" ".join(line.split()) for line in out.getvalue().splitlines()]

    assert "oracle paper 2 50.00 9.5 to 90.5 50.00 83.33 - - 100.00 0.00" in lines(120)
    assert "Scorer paper corrected" in lines(80)
    assert "Task completeness 83.33 100.00" in lines(80)
    narrow = [line for line in lines(80) if not line.startswith("/")]
    assert max(map(len, narrow)) <= 80


def test_the_command_offers_the_scorers_and_protocols_there_are():
    assert cli_options.SCORER_CHOICES == report.SCORER_CHOICES
    assert tuple(PROTOCOLS) == cli_options.PROTOCOL_CHOICES


def test_tidy_success_stands_beside_success_where_records_tell(run_directory, episode):
    for number, effects in enumerate([[], ["moved Apple|1", "opened Fridge|2"]], 1):
        played = episode(KEYS, KEYS, task_id=f"task-{number}")
        run_directory.write(played.model_copy(update={"side_effects": effects}))
    loaded = load_run(run_directory.path)
    overview, changed, every = tables([loaded], scorer="corrected")
    assert overview.head[2:5] == ("Success", "95 %", "Tidy success")
    assert overview.rows[0][2:5] == ("100.00", "34.2 to 100.0", "50.00")
    assert changed.rows == (
        ("oracle", str(loaded.path), "2", "50.00", "1.00", "0.50", "0.50", "0.00", "0.00", "0.00"),
    )
    assert ("Tidy success", "2", "50.00", "9.5 to 90.5") in every.rows
    (told,) = json.loads(report.as_json([loaded]))["runs"]
    scores = told["scorers"]["corrected"]
    assert scores["slices"][0]["tidy_success"]["mean"] == 0.5
    assert scores["slices"][0]["side_effects"]["mean"] == 1.0
    assert [each["tidy_success"] for each in scores["episodes"]] == [True, False]
    (row, *_) = csv.DictReader(io.StringIO(report.as_csv([loaded])))
    assert (row["tidy_success"], row["side_effects"]) == ("0.5", "1.0")
    # A success whose older record does not tell: no rate of tidy success can be given.
    run_directory.write(episode(KEYS, KEYS, task_id="task-3"))
    loaded = load_run(run_directory.path)
    assert tables([loaded])[0].rows[0][4] == "-"
    (row, *_) = csv.DictReader(io.StringIO(report.as_csv([loaded])))
    assert row["tidy_success"] == ""
    # A failure is no tidy success, whatever else it did.
    run_directory.forget("task-3")
    run_directory.write(episode(KEYS, (), task_id="task-4"))
    assert tables([load_run(run_directory.path)])[0].rows[0][4] == "33.33"
