"""Tidy success stands beside success, and an episode's side effects on its page."""

from __future__ import annotations

import html
import json
import re
import shutil
from pathlib import Path
from typing import Any

import pytest

from benchmarks.monitor.directories import Directories
from benchmarks.scoring.metrics import success_rate
from er_gym.rollout.events import EVENTS
from er_gym.rollout.run_directory import EPISODES, RunDirectory

EFFECTS = ["moved Apple|1|2", "moved Mug|3", "opened Fridge|4", "eaten <b>Egg</b>|5"]


@pytest.fixture
def folder(runs: Path, tmp_path: Path) -> Path:
    """The oracle's run, and the same with side effects in the records of its first two episodes,
    of which the stream tells nothing, as those of older versions do."""
    shutil.copytree(runs / "oracle", tmp_path / "oracle")
    other = shutil.copytree(runs / "oracle", tmp_path / "other")
    for file in sorted((other / EPISODES).iterdir())[:2]:
        record = json.loads(file.read_text())
        file.write_text(json.dumps(record | {"side_effects": EFFECTS}))
    stream = other / EVENTS
    stream.write_text(re.sub(',"side_effects":[0-9]+', "", stream.read_text()))
    return tmp_path


def table(client: Any, address: str, name: str) -> list[dict[str, Any]]:
    separator = "&" if "?" in address else "?"
    answer = client.get(f"{address}{separator}as=json&table={name}")
    assert answer.status_code == 200, address
    told: list[dict[str, Any]] = answer.json()
    return told


def test_it_stands_beside_success_wherever_success_does(folder, visit):
    client = visit(folder)
    ids = {each.path.name: each.id for each in Directories([folder]).all()}
    address = f"/runs/{ids['other']}"
    # The list of runs does not read records: one run's stream tells, the other's does not.
    listed = {each["id"]: each for each in table(client, "/?sort=-tidy", "runs")}
    assert [*listed] == [ids["oracle"], ids["other"]]
    assert listed[ids["oracle"]]["Tidy success"] == 1.0
    assert listed[ids["other"]]["Tidy success"] is None
    while "records read so far" in client.get(address).text:
        pass
    rate = success_rate([*"abcdefgh"], [False] * 2 + [True] * 6)
    expected = {"Tidy success": 0.75, "Tidy success low": rate.low, "Tidy success high": rate.high}
    shown = {
        "runs": table(client, "/", "runs")[-1],
        "groups": table(client, address, "groups")[-1],
    }
    for name, row in shown.items():
        assert expected == pytest.approx({each: row[each] for each in expected}), name
    types = {each["Task type"]: each["Tidy success"] for each in table(client, address, "types")}
    assert types == {"single_search": 0.75}
    metrics = table(client, address, "metrics")
    assert [each["id"] for each in metrics[:2]] == ["success", "tidy_success"]
    assert metrics[1]["%"] == 0.75
    effects = {each["Kind"]: each["Number"] for each in table(client, address, "side_effects")}
    assert effects == {"moved": 4, "opened or closed": 2, "-": 2, "All": 8}
    rows = table(client, f"{address}?sort=-effects", "episodes")
    assert [each["Side effects"] for each in rows] == [4, 4, 0, 0, 0, 0, 0, 0]


def test_runs_are_compared_by_it_where_all_tell_it(folder, visit):
    client = visit(folder)
    ids = {each.path.name: each.id for each in Directories([folder]).all()}
    address = f"/compare?of={ids['oracle']}&of={ids['other']}"
    while "8/8" not in client.get(f"{address}").text and "Tidy" not in client.get(address).text:
        pass
    (other_way,) = re.findall(r'href="([^"]+)">Tidy success</a>', client.get(address).text)
    by_success, tidily = (
        table(client, f"/compare{each}", "differences")[0]
        for each in (address.removeprefix("/compare"), html.unescape(other_way))
    )
    assert (by_success["First"], by_success["This"]) == ("100.0 %", "100.0 %")
    assert (tidily["First"], tidily["This"], tidily["Difference"]) == ("100.0 %", "75.0 %", -0.25)
    tasks = table(client, f"/compare{html.unescape(other_way)}", "tasks")
    assert len(tasks) == 2
    assert all("side effects: 4" in str(each.values()) for each in tasks)
    assert table(client, address, "tasks") == []
    metrics = {each["id"]: each for each in table(client, address, "metrics")}
    assert [metrics["tidy_success"][f"{folder.name}/{name}"] for name in ids] == [1.0, 0.75]


def test_the_page_of_an_episode_names_what_was_changed(folder, visit):
    client = visit(folder)
    ids = {each.path.name: each.id for each in Directories([folder]).all()}
    record = next(
        each for each in RunDirectory.open(folder / "other").episodes() if each.side_effects
    )
    said = {}
    for name, id in ids.items():
        page = client.get(f"/runs/{id}/episode", params={"key": record.key}).text
        assert "<b>Egg" not in page
        assert page.count("Side effects") == 1
        said[name] = re.findall(r'<li title="[^"]+">([^<]+): ([^<]+)</li>', page)
        assert ('<p class="small">none</p>' in page) == (name == "oracle")
    assert said["oracle"] == []
    assert said["other"][:3] == [
        ("Apple", "moved"), ("Mug", "moved"), ("Fridge", "opened or closed"),
    ]  # fmt: skip
    file = next((folder / "other" / EPISODES).glob(f"*{record.scene}*"))
    told = json.loads(file.read_text())
    del told["side_effects"]
    file.write_text(json.dumps(told))
    page = client.get(f"/runs/{ids['other']}/episode", params={"key": told["task_id"]}).text
    assert "Side effects" not in page
