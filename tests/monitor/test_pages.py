"""What the monitor's pages say, over real runs."""

from __future__ import annotations

import html
import json
import re
import shutil
import threading
from collections import Counter
from io import BytesIO
from pathlib import Path
from typing import get_args
from xml.etree import ElementTree

import numpy as np
import pytest
from episodes_by_hand import make_step
from fastapi.testclient import TestClient
from PIL import Image

from agents.vlm.chat import Usage
from agents.vlm.clients.budget import Budget, Entry, Ledger
from agents.vlm.settings import Prices
from benchmarks.monitor.app import make_app
from benchmarks.monitor.directories import Directories
from benchmarks.monitor.episode_filter import Filter
from benchmarks.monitor.failures import FAILURES, Failure, failure_of
from benchmarks.monitor.language import words_in
from benchmarks.monitor.site import Site
from benchmarks.pages.monitor import KINDS, Shown
from benchmarks.scoring.metrics import METRICS, score_episode, summarise
from benchmarks.scoring.scorers import CORRECTED
from er_gym.rollout.run_directory import SERVER_EVENTS, SPENDING, RunDirectory
from er_gym.tasks.types import canonical_names
from er_gym.writing import file_stem
from tests.support import in_one_test


@pytest.fixture
def client(runs: Path, visit) -> TestClient:
    return visit(runs)


@pytest.fixture
def ids(runs: Path) -> dict[str, str]:
    """The addresses' ids of both runs, by name."""
    return {directory.path.name: directory.id for directory in Directories([runs]).all()}


def rows(text: str) -> list[str]:
    """The rows of the table of episodes."""
    body = text[text.index('id="rows"') :]
    return re.findall(r"<tr[^>]*>\n(.*?)</tr>", body[body.index("<tbody>") :], re.DOTALL)


def said(text: str) -> str:
    return html.unescape(re.sub(r"<[^>]+>", " ", text.replace("<wbr>", "")))


def test_the_first_page_lists_the_runs(client, ids):
    answer = client.get("/")
    assert answer.status_code == 200
    for name, id in ids.items():
        assert f'<a href="/runs/{id}">' in answer.text
        assert f"<wbr>{name}</a>" in answer.text
    assert "8 of 8" in said(answer.text)
    assert "100.0 %" in said(answer.text)


def test_runs_are_read_before_a_page_is_asked_for(runs, tmp_path):
    folder = shutil.copytree(runs / "random", tmp_path / "random")
    closing = threading.Event()
    with TestClient(
        make_app([folder], closing=closing), base_url="http://127.0.0.1:8010"
    ) as client:
        for thread in threading.enumerate():
            if thread.name == "er-gym-reads-runs":
                thread.join(60)
        (folder / "events.jsonl").rename(tmp_path / "events.jsonl")
        assert "8 of 8" in said(client.get("/").text)
    closing.set()
    (tmp_path / "events.jsonl").rename(folder / "events.jsonl")
    late = Site(Directories([folder]))
    late.read_runs(closing)
    (folder / "events.jsonl").unlink()
    shutil.rmtree(folder / "episodes")
    assert late.summary(late.directories.all()[0]).finished == 0


def test_a_run_costs_what_its_ledger_says_with_the_answers_that_were_rejected(
    runs, tmp_path, visit
):
    folder = shutil.copytree(runs / "random", tmp_path / "random")
    ledger = Ledger(Budget(), Prices())
    ledger.open(folder / SPENDING)
    client = visit(folder)
    address = f"/runs/{Directories([folder]).all()[0].id}"

    def pay(usage: Usage, rejected: str) -> None:
        ledger.enter(Entry.of(usage, model="m", seed=1, cost=0.75, seconds=0.1, rejected=rejected))

    pay(Usage(1_100, 7), "")
    pay(Usage(2_000, 100), "no choices")
    (folder / SERVER_EVENTS).write_text(
        '{"time":"2026-01-01T00:00:00+00:00","event":"retry","what":"<b>503</b>","wait":90}\n{"ti'
    )
    server = client.get(address).text.partition('id="server"')[2].partition("</section>")[0]
    assert "answers paid for 2, not valid 1 · retries 1 · waited (s) 0:01:30" in said(server)
    assert "&lt;b&gt;503" in server
    assert server.count('<svg class="chart"') == 3  # dollars, tokens, retries
    for path in ("/", address):
        text = said(client.get(path).text)
        assert "3,207" in text, path
        assert "$1.50" in text, path
        assert "at most" not in text, path
    pay(Usage(1_000, 0, estimated=True), "no choices")
    with (folder / SPENDING).open("ab") as file:
        file.write(b'{"time": "half an en')
    for path in ("/", address):
        text = said(client.get(path).text)
        assert f"at most {ledger.spent.usage.total:,}" in text, path
        assert "at most $2.25" in text, path
    ledger.close()


def test_a_run_can_be_filtered_and_sorted_by_its_address(client, ids, runs):
    address = f"/runs/{ids['random']}"
    episodes = {each.key: each for each in RunDirectory.open(runs / "random").episodes()}
    assert len(rows(client.get(address).text)) == 8
    kind = next(iter(episodes.values())).task_type
    filtered = rows(client.get(address, params={"type": kind}).text)
    assert len(filtered) == sum(each.task_type == kind for each in episodes.values())
    short = [each for each in episodes.values() if each.num_steps <= 10]
    assert len(rows(client.get(address, params={"steps": "-10"}).text)) == len(short)
    in_order = [
        int(re.search(r'">(\d+)/\d+<', row)[1])
        for row in rows(client.get(address, params={"sort": "steps"}).text)
    ]
    assert in_order == sorted(in_order)
    again = client.get(address, params={"sort": "-steps", "page": "77", "outcome": "failure"})
    downward = [int(re.search(r'">(\d+)/\d+<', row)[1]) for row in rows(again.text)]
    assert downward == sorted(downward, reverse=True)
    assert not rows(client.get(address, params={"text": "no such task"}).text)


@in_one_test("name", ["Search", "search", "single_search", "ER-SingleSearch-v0", "SingleSearch",
                      "Exposed Object Search", "long_range", "Enclosed Object Search"])  # fmt: skip
def test_a_run_is_filtered_by_any_name_of_a_type_or_group(name, client, ids, runs):
    types = [each.task_type for each in RunDirectory.open(runs / "random").episodes()]
    expected = sum(each in canonical_names([name]) for each in types)
    answer = client.get(f"/runs/{ids['random']}", params={"type": name})
    assert len(rows(answer.text)) == expected
    assert "unknown task type" not in answer.text
    assert f" selected>{name}</option>" in answer.text or name in types


def test_an_unknown_name_of_a_type_is_told_with_the_known_ones(client, ids):
    answer = client.get(f"/runs/{ids['random']}", params={"type": "<serch>"})
    assert answer.status_code == 200
    assert not rows(answer.text)
    assert "unknown task type '<serch>'" in said(answer.text)
    assert "long-range tasks" in said(answer.text)
    assert "<serch>" not in answer.text


def test_a_type_that_only_the_run_knows_is_no_unknown_name():
    assert Filter(type="of another package").takes_type("of another package")
    assert not Filter(type="of another package").unknown_type(["of another package"])
    assert Filter(type="of another package").unknown_type(["single_search"])
    assert not Filter(type="Search").takes_type("of another package")


KEYS = ("navigate to Egg", "pickup Egg", "navigate to Bowl", "put Bowl", "end")
NEAR = make_step("navigate to Egg", ("Egg",))


@pytest.mark.parametrize(
    ("steps", "reason", "kind"),
    [
        ((NEAR, "!pickup Egg"), "gave up", "gave up"),
        ((), "gave up", "gave up"),
        ((NEAR, *["!pickup Egg"] * 4), "repeated action", "repeated action"),
        ((NEAR, *["open Fridge", "close Fridge"] * 4, "error"), "no known action",
         "unusable replies"),
        ((NEAR, "pickup Egg", *["observe"] * 20), "step limit", "out of steps"),
        ((NEAR, "pickup Egg", "end"), "step limit", "out of steps"),  # er-gym said end
        ((NEAR, "pickup Egg", "end"), "end", "ended too early"),
        ((NEAR, "pickup Egg"), "the lights went out", "ended otherwise"),
    ],
)  # fmt: skip
def test_a_failure_has_the_name_of_what_ended_it(steps, reason, kind, episode):
    assert failure_of(episode(KEYS, steps, end_reason=reason)) == kind


@pytest.mark.parametrize("language", ["en", "zh"])
def test_every_kind_of_failure_has_words(language):
    assert set(FAILURES) - {"crashed"} <= words_in(language).keys()
    assert set(FAILURES) == set(get_args(Failure))


def test_a_run_tells_success_why_it_failed_and_the_papers_rows(client, ids):
    text = said(client.get(f"/runs/{ids['random']}").text)
    assert "Why episodes failed" in text
    assert re.search(r"\d of 8 failed episodes read", text)
    for figure in ("Qwen2-VL-7B", "Interactor", "Explorer", "Reasoner", "81.0 %", "65.2 %"):
        assert figure in text


def test_a_run_tells_the_metrics_of_bench_and_is_filtered_by_how_episodes_failed(ids, runs, visit):
    client, address = visit(runs), f"/runs/{ids['random']}"
    while "records read so far" in (text := client.get(address).text):
        pass
    assert "by the corrected scorer" in said(text)
    episodes = list(RunDirectory.open(runs / "random").episodes())
    means = summarise([score_episode(each, CORRECTED) for each in episodes])
    for name in METRICS:
        mean = means.metrics[name]
        row = text.split(f'<tr data-row="{name}">')[1].partition("</tr>")[0]
        low_to_high = f"{100 * mean.low:.1f} to {100 * mean.high:.1f}"
        assert f"{100 * mean.mean:.1f} %" in row, name
        assert low_to_high in row, name
    failures = Counter(failure_of(each) or "" for each in episodes)
    assert len(failures) > 1
    for failure in FAILURES:
        found = rows(client.get(address, params={"failure": failure}).text)
        assert len(found) == failures[failure], failure


def test_an_episode_shows_every_step_and_the_key_actions(client, ids, runs):
    episode = next(iter(RunDirectory.open(runs / "oracle").episodes()))
    answer = client.get(f"/runs/{ids['oracle']}/episode", params={"key": episode.key})
    text = said(answer.text)
    assert episode.instruction in text
    steps = re.findall(r"<li id=\"step-\d+\".*?</li>", answer.text, re.DOTALL)
    assert len(steps) == len(episode.steps)
    done: list[str] = []
    for step, shown in zip(episode.steps[1:], steps[1:], strict=True):
        assert f"{step.verb} {step.object_type}".strip() in said(shown)
        assert html.escape(step.feedback, quote=False) in shown or step.feedback in said(shown)
        done += filter(None, re.search(r'data-done="([\d,]*)"', shown)[1].split(","))
    assert sorted(map(int, done)) == list(range(len(episode.key_actions)))


def test_an_episode_without_a_record_says_why(runs, visit, tmp_path):
    shutil.copytree(runs / "oracle", tmp_path / "runs" / "oracle")
    run = RunDirectory.open(tmp_path / "runs" / "oracle")
    damaged, under_way = [record.task_id for record in run.episodes()][:2]
    for task in (damaged, under_way):
        file = next(run.path.glob(f"episodes/*{file_stem(task)}*"))
        file.write_bytes(file.read_bytes()[:50])
    events = run.path / "events.jsonl"
    lines = [
        line
        for line in events.read_text().splitlines(keepends=True)
        if not ('"episode_ended"' in line and under_way in line)
    ]
    events.write_text("".join(lines))
    client = visit(tmp_path)
    (id,) = (one.id for one in Directories([tmp_path]).all())
    for task, expected in (
        (damaged, "The record of this episode cannot be read: "),
        (under_way, "This episode is being played, and this page follows it."),
    ):
        answer = client.get(f"/runs/{id}/episode", params={"key": task})
        assert answer.status_code == 200
        assert expected in said(answer.text)
    assert client.get(f"/runs/{id}/episode", params={"key": "none"}).status_code == 404


def test_the_room_from_above_is_drawn_by_playing_again(client, ids, runs):
    episode = next(iter(RunDirectory.open(runs / "oracle").episodes()))
    answer = client.get(f"/runs/{ids['oracle']}/map", params={"key": episode.key})
    drawing = ElementTree.fromstring(answer.text)
    stands = [each for each in drawing.iter() if "data-map-step" in each.attrib]
    assert len(stands) == len(episode.steps)
    last = len(episode.steps) - 1
    frame = client.get(f"/runs/{ids['oracle']}/frame", params={"key": episode.key, "n": last})
    assert (frame.status_code, frame.content[:3]) == (200, b"\xff\xd8\xff")
    address = f"/runs/{ids['oracle']}/frame?key={episode.key}&n={last}&what="
    seen = {
        what: np.asarray(Image.open(BytesIO(client.get(address + what).content)).convert("RGB"))
        for what in ("depth", "instance")
    }
    assert np.ptp(seen["depth"].astype(int), axis=2).max() < 8  # grey
    assert np.ptp(seen["instance"].astype(int), axis=2).max() > 80
    assert client.get(address + "classes").status_code == 404
    beyond = client.get(f"/runs/{ids['oracle']}/frame", params={"key": episode.key, "n": last + 1})
    assert beyond.status_code == 404


def test_runs_are_compared_task_by_task(client, ids, runs):
    both = {"of": [ids["random"], ids["oracle"]]}
    answer = client.get("/compare", params=both)
    text = said(answer.text)
    lost = sum(each.success for each in RunDirectory.open(runs / "random").episodes())
    assert f"+{8 - lost}" in text
    assert f"{100 * (8 - lost) / 8:+.1f}" in text
    links = re.findall(r'href="(/compare/episode\?[^"]+)"', answer.text)
    assert len(links) == 8 - lost
    diff = client.get(html.unescape(links[0]))
    assert diff.status_code == 200
    assert diff.text.count("data-player") == 2
    assert re.search(r"They part at step \d+", said(diff.text))
    for _ in range(8 - lost):  # each visit counts at least one more, on however slow a machine
        text = said(client.get("/compare", params=both).text)
    assert f"{8 - lost}/{8 - lost}" in text
    neither = client.get("/compare", params=both | {"change": "neither"})
    assert "/compare/episode" not in neither.text
    for page in ("1234567x", "9" * 5_000, "0"):  # no such page: the last or the first
        asked = client.get("/compare", params=both | {"page": page})
        assert asked.text.count("/compare/episode") == 8 - lost
    assert client.get("/compare").status_code == 200
    assert client.get("/compare", params={"of": ["nothing"]}).status_code == 404
    assert "too few tasks for an interval" in text
    (other_way,) = re.findall(r'href="(\?of=[^"]+)">compare with this one', answer.text)
    assert other_way == f"?of={ids['oracle']}&of={ids['random']}"
    turned = client.get(f"/compare{other_way}").text
    assert turned.index(f'value="{ids["oracle"]}"') < turned.index(f'value="{ids["random"]}"')
    assert f"−{100 * (8 - lost) / 8:.1f}" in said(turned)


def test_settings_are_shown_and_compared_runs_that_were_not_played_alike_are_named(
    runs, tmp_path, visit
):
    folder = shutil.copytree(runs / "random", tmp_path / "random")
    shutil.copytree(runs / "oracle", tmp_path / "oracle")
    told = json.loads((folder / "run.json").read_text())
    told["env"] |= {"instances": "explore", "faults": 0.2, "width": 640}
    (folder / "run.json").write_text(json.dumps(told))
    client = visit(tmp_path)
    ids = {each.path.name: each.id for each in Directories([tmp_path]).all()}
    page = " ".join(said(client.get(f"/runs/{ids['oracle']}").text).split())
    for setting in ("env.instances target", "env.protocol default", "env.faults 0.0", "seed 0",
                    "er_gym 0.", "scorer corrected", "env.obs_mode text"):  # fmt: skip
        assert setting in page
    assert re.search(r"begun 20\d\d-", page)
    both = client.get("/compare", params={"of": [ids["random"], ids["oracle"]]})
    text = " ".join(said(both.text).split())
    assert "not played alike: env.instances (explore / target), env.faults (0.2 / 0.0). So" in text
    assert "env.width 640 800" in text
    assert "seed 0 0" not in text
    alike = client.get("/compare", params={"of": [ids["oracle"], ids["oracle"]]})
    assert "not played alike" not in alike.text


def test_pages_speak_chinese(client, ids):
    chosen = client.get("/language/zh", params={"back": f"/runs/{ids['oracle']}"})
    assert chosen.status_code == 303
    assert chosen.headers["location"] == f"/runs/{ids['oracle']}"
    assert '<html lang="zh">' in client.get("/").text
    client.cookies.clear()
    by_browser = client.get("/", headers={"accept-language": "zh-CN,zh;q=0.9"})
    assert '<html lang="zh">' in by_browser.text


def test_another_machine_needs_the_token(runs):
    with TestClient(make_app([runs], "secret"), base_url="http://192.0.2.7:8010") as client:
        refused = client.get("/")
        assert (refused.status_code, refused.headers["content-type"]) == (
            403,
            "text/plain; charset=utf-8",
        )
        assert "?token=…" in refused.text
        assert client.get("/", params={"token": "guess"}).status_code == 403
        let_in = client.get("/", params={"token": "secret", "a": "b"}, follow_redirects=False)
        assert (let_in.status_code, let_in.headers["location"]) == (303, "/?a=b")
        assert client.get("/").status_code == 200
    with TestClient(make_app([runs], ""), base_url="http://rebound.example:8010") as client:
        assert client.get("/").status_code == 403


def test_the_pictures_that_are_taken_of_pages_are_of_pages(runs, visit, tmp_path):
    shown, client = Shown(runs, tmp_path), visit(runs)
    for kind in ("runs", "run", "episode", "compare", "compare-episode", "data", "choose"):
        assert client.get(KINDS[kind].address(shown)).status_code == 200, kind
    for kind in ("collection", "policy", "ladder", "curves"):
        with pytest.raises(LookupError):
            KINDS[kind].address(shown)
