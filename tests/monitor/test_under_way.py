"""An episode that is under way is opened, and grows."""

from __future__ import annotations

import html
import json
import re
import shutil
from pathlib import Path

import pytest

from benchmarks.monitor.directories import Directories
from benchmarks.monitor.event_tail import EpisodeRow
from benchmarks.monitor.under_way import record_so_far
from er_gym.rollout.events import EVENTS
from er_gym.rollout.records import EpisodeRecord
from er_gym.rollout.run_directory import EPISODES, RunDirectory


@pytest.fixture
def last(runs: Path, tmp_path: Path) -> tuple[Path, EpisodeRecord, list[str]]:
    """A run in whose last episode two steps were taken, how that became, and the other events."""
    folder = shutil.copytree(runs / "random", tmp_path / "run")
    lines = (folder / EVENTS).read_text().splitlines(keepends=True)
    begins = [n for n, line in enumerate(lines) if '"kind":"episode_begun"' in line]
    key = json.loads(lines[begins[-1]])["task_id"]
    record = RunDirectory.open(folder).episode(key)
    (file,) = (each for each in (folder / EPISODES).iterdir() if key in each.read_text())
    file.unlink()
    cut = begins[-1] + 3
    (folder / EVENTS).write_text("".join(lines[:cut]))
    return folder, record, lines[cut:]


def test_its_steps_room_and_key_actions_are_shown_as_they_come(last, visit):
    folder, record, rest = last
    client = visit(folder)
    address = f"/runs/{Directories([folder]).all()[0].id}"

    def steps() -> list[str]:
        page = client.get(f"{address}/episode", params={"key": record.key}).text
        assert 'id="so-far" data-part data-under-way' in page
        assert len(re.findall("data-key-action=", page)) == len(record.key_actions)
        found = re.findall(r'<li id="step-\d+".*?</h2>', page, re.DOTALL)
        return [re.sub("<[^>]+>|\\s+", " ", each).split(maxsplit=1)[1] for each in found]

    actions = [f"{each.verb} {each.object_type}".strip() for each in record.steps[1:]]
    assert len(steps()) == 3
    step = {"kind": "step", "task_id": record.key, "step": 3, "verb": "observe", "success": False}
    step |= {"reward": 1.0, "thought": "<script>x</script>", "feedback": "<b>No</b> \u202eway."}
    with (folder / EVENTS).open("a") as file:
        file.write(json.dumps(step, separators=(",", ":")) + "\n" + rest[0].replace("step", "ste"))
    shown = steps()
    assert len(shown) == 4
    assert all(action in said for action, said in zip(actions[:2], shown[1:], strict=False))
    page = client.get(f"{address}/episode", params={"key": record.key}).text
    assert "&lt;script&gt;x&lt;/script&gt;" in page
    assert "<script>x" not in page
    said = re.findall('<p class="feedback">(.*?)</p>', page)
    assert [html.unescape(each) for each in said] == [
        *(each.feedback for each in record.steps[1:3]),
        "<b>No</b> ⟨U+202E⟩way.",
    ]
    assert "<b>No" not in page
    assert 'class="room"' in client.get(f"{address}/map", params={"key": record.key}).text
    assert client.get(f"{address}/frame", params={"key": record.key, "n": 4}).status_code == 404


def test_it_is_told_as_far_as_the_stream_tells_it(last):
    folder, record, _ = last
    # Its process died in a first try: the second begins anew.
    *others, begun, first, second = (folder / EVENTS).read_text().splitlines(keepends=True)
    tries = (begun, second.replace('"step":2', '"step":1'), begun, first, second)
    (folder / EVENTS).write_text("".join((*others, *tries)))
    row = EpisodeRow(record.key, task_type=record.task_type, scene=record.scene, max_steps=9)
    manifest = RunDirectory.open(folder).manifest
    found = record_so_far(folder, manifest, row)
    told = {"verb", "object_type", "success", "reward", "thought", "feedback"}
    assert [each.model_dump(include=told) for each in found.steps[1:]] == [
        each.model_dump(include=told) for each in record.steps[1:3]
    ]
    assert (found.seed, found.key_actions, found.max_steps) == (record.seed, record.key_actions, 9)
    foreign = manifest.model_copy(update={"suite": "os"})
    assert record_so_far(folder, foreign, row).key_actions == []
    (folder / EVENTS).unlink()
    assert len(record_so_far(folder, manifest, row).steps) == 1
