"""How tables are laid out, and what those of collections and of task counts say."""

from __future__ import annotations

import io
from collections import Counter
from dataclasses import replace

import pytest
from rich.console import Console
from support import in_one_test, make_task

from benchmarks.scoring import task_counts
from benchmarks.scoring.data_tables import statistics_tables
from benchmarks.scoring.metrics import Estimate
from benchmarks.scoring.report import load_run
from benchmarks.scoring.tables import interval, print_tables, signed, tables
from er_gym.data.paper_figures import SETS, THOUGHTS
from er_gym.data.statistics import PartStatistics, Statistics
from er_gym.tables import Table, as_markdown

TABLE = Table(
    "Results, in %",
    ("Agent", "n", "Success rate", "95 %"),
    (
        ("openai:a-model-with-a-long-name", "10", "33.33", "9.5 to 70.5"),
        ("oracle", "9", "100.00", "-"),
    ),
    1,
    notes=("x: a note",),
)
WIDE = """
Results, in %
                                     Success
Agent                             n     rate         95 %
─────────────────────────────────────────────────────────
openai:a-model-with-a-long-name  10    33.33  9.5 to 70.5
oracle                            9   100.00            -
x: a note
"""
FOLDED = """
Results, in %
                        Success
Agent                n     rate         95 %
────────────────────────────────────────────
openai:a-model-wit  10    33.33  9.5 to 70.5
h-a-long-name
oracle               9   100.00            -
x: a note
"""


def shown(table: Table, width: int) -> str:
    out = io.StringIO()
    print_tables([table], Console(file=out, width=width))
    return "\n".join(line.rstrip() for line in out.getvalue().splitlines()) + "\n"


@in_one_test(
    "row",
    [  # the width of the terminal; whether the table may turn; how it looks
        (100, False, WIDE),
        (57, False, WIDE),
        (44, False, FOLDED),
        (44, True, FOLDED),  # it fits as it is
        (30, False, FOLDED),  # words are folded no more, figures never
        (30, True, FOLDED),  # turned it would not fit either
    ],
)
def test_words_are_folded_and_figures_are_not(row: tuple[int, bool, str]) -> None:
    width, may_turn, expected = row
    assert shown(replace(TABLE, may_turn=may_turn), width) == expected


def test_a_table_turns_where_only_then_it_fits() -> None:
    many = Table("T", ("Agent", *"abcdefgh"), (("oracle", *["100.00"] * 8),), 1, may_turn=True)
    lines = shown(many, 20).splitlines()
    assert [line.split() for line in lines[2:]] == [
        ["oracle"],
        ["─" * 9],
        *([name, "100.00"] for name in "abcdefgh"),
    ]
    assert shown(many, 80).splitlines()[2].split() == ["Agent", *"abcdefgh"]
    assert shown(replace(many, may_turn=False), 20).splitlines()[2].split()[0] == "Agent"


def test_a_table_without_rows_is_its_title_and_notes() -> None:
    table = Table("None", ("a",), (), 1, notes=("why",))
    assert shown(table, 40) == "\nNone\nwhy\n"
    assert as_markdown([table]) == "**None**\n\n\nwhy\n"
    assert (table.markdown(), table.csv()) == ("", "a\n")


def test_a_table_in_markdown_and_as_csv() -> None:
    table = Table("T\nU", ("name", "n"), (("a|b\nc", "1"), ('d, "e"', "")), 1, notes=("x: y",))
    cells = '| name | n |\n| --- | ---: |\n| a\\|b c | 1 |\n| d, "e" |  |'
    assert table.markdown() == cells
    assert as_markdown([table, table]) == "\n".join([f"**T U**\n\n{cells}\n\nx: y\n"] * 2)
    assert table.csv() == 'name,n\n"a|b\nc",1\n"d, ""e""",\n'


@in_one_test(
    "row",
    [
        (Estimate(0.5, 0.25, 0.755), "25.0 to 75.5", ("+50.0", "25.0 to 75.5")),
        (Estimate(-0.05, None, 0.1), "-", ("-5.0", "-")),
        (Estimate(0.0, -0.1, None), "-", ("+0.0", "-")),
    ],
)
def test_intervals(row: tuple[Estimate, str, tuple[str, str]]) -> None:
    estimate, told, difference = row
    assert interval(estimate) == told
    assert signed(estimate) == difference


def test_no_difference_is_two_dashes() -> None:
    assert signed(None) == ("-", "-")


def test_columns_of_words_are_those_before_the_number_of_tasks(run_directory, episode) -> None:
    keys = ("navigate to CounterTop", "pickup Egg", "navigate to Bowl", "put in Bowl", "end")
    run_directory.write(episode(keys, keys))
    untyped = ("pickup Egg", "put in = Plate|-01.47|+01.31|+00.24", "end")
    run_directory.write(episode(untyped, ("pickup Egg", "put in Plate", "end"), task_id="task-2"))
    run = load_run(run_directory.path)
    both, one = tables([run])[0], tables([run], scorer="paper")[0]
    for table, words in ((both, ("Agent", "Scorer")), (one, ("Agent",))):
        assert table.head[: table.text_columns] == words
        assert table.head[table.text_columns] == "n"


def test_a_miss_without_feedback_or_left_key_actions_has_dashes(
    run_directory, episode, step
) -> None:
    silent = step("pickup Egg").model_copy(update={"feedback": ""})
    run_directory.write(episode(("pickup Egg", "end"), (silent,), end_reason="step limit"))
    (miss,) = tables([load_run(run_directory.path)], with_misses=True)[1].rows
    assert miss[3:] == ("step limit", "-", "end")


def test_a_miss_says_why_an_agent_gave_up(run_directory, episode) -> None:
    gave_up = episode(("pickup Egg", "end"), ("!pickup Egg",), end_reason="gave up")
    run_directory.write(gave_up.model_copy(update={"gave_up": "the server\nrefused"}))
    (miss,) = tables([load_run(run_directory.path)], with_misses=True)[1].rows
    assert miss[3:5] == ("gave up", "the server refused")


def test_samples_are_counted_of_all_tasks_and_of_each_group(run_directory, episode) -> None:
    keys = ("pickup Egg", "end")
    for sample in (1, 2):
        done = episode(keys, keys if sample == 1 else ("end",))
        run_directory.write(done.model_copy(update={"sample": sample}))
    found = tables([load_run(run_directory.path)], scorer="corrected", with_types=True)
    (samples,) = (table for table in found if "samples of each task" in table.title)
    names = ["All", "Transport", "Exposed-to-Exposed Object Transfer"]
    assert list(samples.rows) == [(name, "1", "50.00", "100.00", "0.00") for name in names]


STATISTICS = Statistics(
    name="ours",
    parts={
        "anomalies": PartStatistics(
            trajectories=1_000,
            succeeded=500,
            actions=Counter({4: 1, 7: 2}),
            pictures=Counter({3: 1}),
            kinds=Counter({"b": 2, "a": 1_000}),
            faults=Counter({"slip": 2, "crash": 1}),
        ),
        "imitation": PartStatistics(faults=Counter({"slip": 1})),
    },
    thoughts=Counter({"planning": 3, "reflection": 1}),
    words=Counter({"planning": 31}),
    task_types=Counter({"mine": 1, "single_search": 3}),
    sentences=8,
    distinct_sentences=2,
    distinct_thoughts=1,
    most_used="Go on.",
    most_used_count=3,
    refused=Counter({"side": 1, "held": 1, "leak": 2}),
    usd=1234.5,
)
STATISTICS.transitions["begin"].update({"analysis": 1, "action": 2})


def test_statistics_beside_the_papers() -> None:
    found = {table.title: table for table in statistics_tables(STATISTICS)}
    parts = found["ours: trajectories by part"].rows
    assert parts[0] == (
        *("anomalies", "a 1,000, b 2", "1,000", "50.0"),
        *("6.00", "7", "3.00", "3"),
    )
    assert parts[1] == ("imitation", "", "0", "-", "0.00", "0", "0.00", "0")
    assert [row[0] for row in parts[2:]] == ["the paper's set 1", "the paper's set 3"]
    first = SETS[0]
    assert parts[2][2:] == ("1,128", "-", "4.11", "-", f"{first.pictures / 1_128:.2f}", "11")
    thoughts = {row[0]: row[1:] for row in found["ours: thoughts by kind"].rows}
    share = 100 * THOUGHTS["planning"] / sum(THOUGHTS.values())
    assert thoughts["planning"] == ("3", "75.0", f"{share:.1f}", "10.3")
    assert thoughts["analysis"][-1] == "-"
    (follows,) = (table for title, table in found.items() if "what follows what" in title)
    begin = dict(zip(follows.head, follows.rows[0], strict=True))
    assert begin["After"] == "begin"
    assert begin["analysis"].startswith("33 (")
    assert begin["action"].startswith("67 (")
    assert "-" in begin.values()
    types = {row[0]: row[1:] for row in found["ours: types of tasks"].rows}
    assert types["single_search"][:2] == ("3", "75.0")
    assert types["single_pickup"][:2] == ("0", "0.0")
    assert types["mine"] == ("1", "25.0", "-")
    assert [*types][-1] == "mine"  # after the paper's
    wording = found["ours: wording"]
    assert [row[1] for row in wording.rows] == ["8", "25.0", "25.0", "75.00"]
    assert wording.notes == ("The most used thought: Go on.",)
    assert found["ours: the critic's refusals"].rows == (
        ("leak", "2", "50.0"),
        ("held", "1", "25.0"),
        ("side", "1", "25.0"),
    )
    assert found["ours: faults"].rows == (("slip", "3", "75.0"), ("crash", "1", "25.0"))
    assert dict(found["ours: collection"].rows)["cost, US dollars"] == "1,234.50"


def test_statistics_of_nothing() -> None:
    found = {table.title: table for table in statistics_tables(Statistics(name="ours"))}
    assert [row[0] for row in found["ours: trajectories by part"].rows] == [
        f"the paper's set {number}" for number in (1, 2, 3)
    ]
    assert not {"ours: the critic's refusals", "ours: faults"} & found.keys()
    assert found["ours: wording"].notes == ()
    assert {row[1] for row in found["ours: wording"].rows} == {"0", "-"}


def test_task_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    found: list[Table] = []
    monkeypatch.setattr(task_counts, "print_tables", lambda tables, _: found.extend(tables))
    tasks = [
        make_task("single_search", scene="FloorPlan301"),
        make_task("single_search", scene="FloorPlan301"),
        make_task("single_search", scene="FloorPlan2"),
        make_task("single_toggle", scene="FloorPlan2"),
    ]
    task_counts.print_counts(tasks, {"rare": 1, "often": 3}, by_scene=True)
    kinds, scenes, splits, wordings, dropped = found
    counts = {row[1]: dict(zip(kinds.head, row, strict=True)) for row in kinds.rows}
    assert {name: (row["kitchen"], row["bedroom"], row["all"]) for name, row in counts.items()} == {
        "single_search": ("1", "2", "3"),
        "single_toggle": ("1", "0", "1"),
        "all": ("2", "2", "4"),
    }
    assert [(row[0], row[-1]) for row in scenes.rows] == [
        ("FloorPlan2", "2"),
        ("FloorPlan301", "2"),
    ]
    by_type = dict(zip(scenes.head, scenes.rows[1], strict=True))
    assert (by_type["Exposed Object Search"], by_type["Exposed Object Toggle"]) == ("2", "0")
    assert sum(int(row[1]) for row in splits.rows) == 4
    assert sum(int(row[1]) for row in wordings.rows) == 4
    assert dropped.rows == (("often", "3"), ("rare", "1"))
    found.clear()
    task_counts.print_counts(tasks, {})
    assert [table.title for table in found] == ["Tasks"]
