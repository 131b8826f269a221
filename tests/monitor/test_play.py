"""A person plays: by the pages' own forms, against a real environment."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError
from starlette.testclient import TestClient

from agents.scripted.oracle import OracleAgent
from agents.vlm.chat import Message, Picture
from agents.vlm.clients.registry import CLIENTS, ModelClientSpec
from agents.vlm.clients.scripted import ScriptedClient
from agents.vlm.record import ConversationRecord, RoundRecord
from benchmarks.cli.main import main
from benchmarks.monitor.app import make_app
from benchmarks.monitor.language import words_in
from benchmarks.monitor.play.plan import plan, run_path
from benchmarks.monitor.play.session import Refused
from benchmarks.monitor.play.sessions import Sessions
from er_gym import EmbodiedEnv
from er_gym.rollout.events import Reply, read_events
from er_gym.rollout.play import episode_seed, play_episode
from er_gym.rollout.records import EpisodeRecord, StepRecord
from er_gym.rollout.run_directory import RunDirectory
from er_gym.tasks import load_suite
from er_gym.tasks.verbs import OWN

HERE = "http://127.0.0.1:8010"
WORDS = words_in("en")
BENCH = ("bench", "--suite", "mini", "--agent", "oracle")
TYPE = "pickup_from_closerep_and_put_in_closerep"
FIRST, SECOND = [task for task in load_suite("mini").tasks if task.type.name == TYPE][:2]


@pytest.fixture(scope="module")
def oracle_actions() -> list[str]:
    """What the oracle does in the first task."""
    env = EmbodiedEnv((), obs_mode="text", **load_suite("mini").env)
    record = play_episode(env, OracleAgent(), FIRST, episode_seed(0, FIRST.id))
    env.close()
    assert record.success
    return [step.text for step in record.steps[1:]]


@pytest.fixture(scope="module")
def player(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Player]:
    """A monitor in which one may play."""
    with Player(tmp_path_factory.mktemp("played")) as player:
        yield player


@pytest.fixture
def alone(tmp_path: Path) -> Iterator[Player]:
    """A monitor in which no other test has played."""
    with Player(tmp_path) as player:
        yield player


class Player:
    """A browser of a monitor, without JavaScript."""

    def __init__(self, folder: Path | None, root: Path | None = None) -> None:
        self.folder = folder
        self.app = make_app([root or folder or Path("nothing")], play=folder)
        self.client = TestClient(self.app, base_url=HERE, follow_redirects=False)

    def __enter__(self) -> Player:
        self.client.__enter__()  # begins and ends the application
        return self

    def __exit__(self, *error: object) -> None:
        self.client.__exit__(*error)

    def get(self, address: str) -> str:
        answer = self.client.get(address)
        assert answer.status_code == 200, answer.text
        return str(answer.text)

    @cached_property
    def secret(self) -> str:
        """What a page of this server has in its forms."""
        found = re.search(r'name="secret" value="([^"]+)"', self.get("/play"))
        assert found is not None
        return found[1]

    def post(self, address: str, origin: str | None = HERE, **fields: str) -> Any:
        """Send a form, as a page of this server does unless something else is given."""
        fields = fields if "secret" in fields else {"secret": self.secret, **fields}
        headers = {} if origin is None else {"Origin": origin}
        return self.client.post(address, data=fields, headers=headers)

    def begin(self, task: str = FIRST.id, agent: str = "", type: str = "") -> str:
        """Begin a session; its address."""
        answer = self.post("/play", suite="mini", task=task, agent=agent, type=type)
        assert answer.status_code == 303, re.findall('"problem".*', answer.text)
        return str(answer.headers["location"])

    def act(self, session: str, action: str) -> Any:
        """Do an action from the page that is shown."""
        return self.post(session, do="act", action=action, step=self.step(session))

    def step(self, session: str) -> str:
        found = re.search(r'name="step" value="(\d+)"', self.get(session))
        assert found is not None, self.get(session)
        return found[1]

    def offered(self, session: str) -> list[str]:
        """The actions that a page offers."""
        return re.findall(r'<button name="action" value="([^"]+)"', self.get(session))

    def wait_for(self, session: str, words: str) -> bool:
        """Whether a page says something within a minute."""
        until = time.monotonic() + 60.0
        while words not in self.get(session):
            if time.monotonic() > until:
                return False
            time.sleep(0.2)
        return True

    def run(self, agent: str = "human") -> RunDirectory:
        assert self.folder is not None
        runs = [RunDirectory.open(file.parent) for file in self.folder.glob("*/run.json")]
        return next(run for run in runs if run.manifest.agent == agent)


def without_times(record: EpisodeRecord) -> dict[str, Any]:
    """What an episode has in common with the same course of another run."""
    told = record.model_dump(exclude={"seconds", "agent", "run"})
    for step in told["steps"]:
        step.pop("thought")
    return told


def conversation(run: RunDirectory, task_id: str) -> ConversationRecord:
    file = run.path / "conversations" / f"{task_id}.json"
    return ConversationRecord.model_validate_json(file.read_bytes())


def test_what_is_chosen_is_begun_and_no_other_type(player: Player) -> None:
    """Suite, type and task are of one form; what does not fit together is refused."""
    page = player.get(f"/play?suite=mini&type={TYPE}")
    assert page.count("<form") == 1
    other = "single_search"
    wrong = player.post("/play", suite="mini", type=other, task=FIRST.id)
    assert (wrong.status_code, f"of the types {other}" in wrong.text) == (400, True)
    shown = player.post("/play", do="show", suite="mini", type=TYPE, agent="oracle")
    assert shown.headers["location"] == f"/play?suite=mini&type={TYPE}&agent=oracle"
    page = player.get(shown.headers["location"])
    assert 'value="oracle"' in page
    assert FIRST.id in page
    assert page.count("<option value=") < 60


def test_playing_leaves_the_run_that_bench_writes(
    player: Player,
    oracle_actions: list[str],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    session = player.begin()
    for action in oracle_actions:
        page = player.get(session)
        assert FIRST.instruction in page
        assert action in player.offered(session)
        assert not any(key.object_id in page for key in FIRST.key_actions if key.object_id)
        assert player.act(session, action).status_code == 303
    assert WORDS["play_success"] in player.get(session)

    with pytest.raises(SystemExit) as ended:
        main([*BENCH, "--task-ids", FIRST.id, "--out", str(tmp_path)])
    assert ended.value.code == 0
    run, bench = player.run(), RunDirectory.open(tmp_path)
    mine, theirs = run.episode(FIRST.id), bench.episode(FIRST.id)
    assert without_times(mine) == without_times(theirs)
    assert (mine.agent, mine.success) == ("human", True)
    assert '"by"' not in (run.path / "episodes" / f"{FIRST.id}.json").read_text()
    assert run.manifest == bench.manifest.model_copy(
        update={"agent": "human", "env": {**bench.manifest.env, "obs_mode": "rgb"}}
    )

    def told(directory: RunDirectory) -> list[dict[str, Any]]:
        hidden = {"time", "seconds", "thought", "agent"}
        return [event.model_dump(exclude=hidden) for event in read_events(directory.path)]

    assert told(run) == told(bench)
    capsys.readouterr()
    with pytest.raises(SystemExit) as ended:
        main(["report", str(run.path), str(bench.path)])
    assert ended.value.code == 0
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert {("human", "1/132", "100.00"), ("oracle", "1/132", "100.00")} <= {
        tuple(row[:3]) for row in rows
    }
    assert player.post("/play", suite="mini", task=FIRST.id).status_code == 409  # played already


def test_the_episode_in_play_begins_again_with_the_pictures_of_a_vision_language_agent(
    alone: Player,
) -> None:
    assert alone.act(alone.begin(), "end").status_code == 303
    left = alone.begin("", type=TYPE)  # the next that has not been played
    assert SECOND.instruction in alone.get(left)
    assert alone.act(left, "observe").status_code == 303
    assert alone.post(left, do="close").status_code == 303
    assert WORDS["play_was_left"] in alone.get(left)
    assert [each.task_id for each in alone.run().episodes()] == [FIRST.id]

    session = alone.begin("", type=TYPE)
    assert SECOND.instruction in alone.get(session)
    assert alone.act(session, "observe").status_code == 303
    shown = [
        alone.client.get(address.replace("&amp;", "&")).content
        for address in re.findall(r'<img src="([^"]+)"', alone.get(session))
    ]
    assert len(shown) == len({*shown}) == 4
    assert alone.act(session, "end").status_code == 303
    assert WORDS["play_failure"] in alone.get(session)
    run = alone.run()
    kept = conversation(run, SECOND.id)
    of_turn = [
        [(run.path / part.path).read_bytes() for part in message.parts if not isinstance(part, str)]
        for message in kept.messages
        if message.role == "user"
    ]
    assert [len(each) for each in of_turn] == [1, 4]
    assert of_turn[1] == shown
    assert [each.by for each in kept.rounds] == ["person", "person"]
    replay = re.search(r'href="(/runs/\w+/episode[^"]+)"', alone.get(session))
    assert replay is not None
    page = alone.get(replay[1].replace("&amp;", "&"))
    assert page.count("data-picture=") == 5
    assert WORDS["said"] not in page  # there is no model

    assert alone.post(session, do="next").status_code == 303
    after = alone.get(session)
    assert SECOND.instruction not in after
    assert alone.step(session) == "1"
    assert alone.post(session, do="close").status_code == 303


def test_a_step_decided_in_place_of_a_model_is_its_own_turn(
    player: Player, monkeypatch: pytest.MonkeyPatch
) -> None:
    sent: list[Sequence[Message]] = []

    def say(messages: Sequence[Message]) -> str:
        sent.append(tuple(messages))
        action = "observe" if len(sent) == 1 else "end"
        return f"<Planning>I go on.</Planning><DecisionMaking>{action}</DecisionMaking>"

    spec = ModelClientSpec(make=lambda *_: ScriptedClient(say), opens="NAME", help="for tests")
    monkeypatch.setitem(CLIENTS.own, "scripted", spec)
    session = player.begin(agent="scripted:model")
    assert not sent
    assert player.post(session, do="step").status_code == 303
    chosen = next(each for each in player.offered(session) if each.startswith("navigate to"))
    assert player.act(session, chosen).status_code == 303
    assert len(sent) == 1
    page = player.get(session)
    assert WORDS["play_by_person"] in page
    assert page.index("I go on.") < page.index("<fieldset"), "beside the picture, above the actions"
    assert player.post(session, do="go").status_code == 303
    assert player.wait_for(session, WORDS["play_failure"])

    *_, own, seen, decided, told = sent[1]
    assert [own.role, seen.role, decided.role, told.role] == ["assistant", "user"] * 2
    assert decided.parts == (f"<DecisionMaking>{chosen}</DecisionMaking>",)
    assert sum(isinstance(part, Picture) for part in seen.parts) == 4
    run = player.run("human+scripted:model")
    assert [step.by for step in run.episode(FIRST.id).steps] == ["", "", "person", ""]
    assert (run.path / "episodes" / f"{FIRST.id}.json").read_text().count('"by"') == 1
    kept = conversation(run, FIRST.id)
    assert kept.agent == run.manifest.agent
    assert [each.by for each in kept.rounds] == ["", "person", ""]
    assert [each.action for each in kept.rounds] == ["observe", chosen, "end"]
    assert kept.rounds[1].success == run.episode(FIRST.id).steps[2].success
    replay = re.search(r'href="(/runs/\w+/episode[^"]+)"', player.get(session))
    assert replay is not None
    page = player.get(replay[1].replace("&amp;", "&"))
    assert page.count(WORDS["play_by_person_record"]) == 1
    assert page.count(WORDS["said"]) == 2
    asked = [event.step for event in read_events(run.path) if isinstance(event, Reply)]
    assert asked == [1, 3]


def test_an_agent_with_a_plan_of_its_own_is_only_watched(player: Player) -> None:
    session = player.begin(agent="searcher")
    assert player.offered(session) == []
    refused = player.post(session, do="act", action="observe", step="1")
    assert refused.status_code == 409
    assert WORDS["play_cannot_yield"].format(agent="searcher") in refused.text
    assert player.post(session, do="step").status_code == 303
    assert player.wait_for(session, "<li value=")
    assert player.get(session).count("<li value=") == 1
    assert player.post(session, do="go").status_code == 303
    assert player.wait_for(session, WORDS["play_success"])
    assert player.run("human+searcher").episode(FIRST.id).success


def test_an_agent_without_thoughts_is_watched(player: Player) -> None:
    session = player.begin(agent="random")
    assert player.post(session, do="step").status_code == 303
    assert player.wait_for(session, "<li value=")
    assert player.get(session).count("<li value=") == 1


@pytest.mark.parametrize(
    ("fields", "origin", "status"),
    [
        ({"secret": ""}, HERE, 403),
        ({"secret": "x" * 32}, HERE, 403),
        ({}, "http://evil.example", 403),
        ({}, "http://127.0.0.1:8011", 403),
        ({}, "null", 403),
        ({}, None, 403),
        ({"suite": "../mini"}, HERE, 400),
        ({"suite": "small_suite:small"}, HERE, 400),
        ({"task": "<script>"}, HERE, 400),
        ({"type": "no such", "task": ""}, HERE, 400),
        ({"agent": "nobody"}, HERE, 400),
        ({"agent": "os:getcwd"}, HERE, 400),
        ({"agent": "zoo:../../x"}, HERE, 400),
        ({"agent": "x" * 9000}, HERE, 413),
    ],
)
def test_what_cannot_be_played_is_refused(
    player: Player, fields: dict[str, str], origin: str | None, status: int
) -> None:
    assert player.folder is not None
    before, shown = sorted(player.folder.rglob("*.json")), player.get("/play")
    asked = {"suite": "mini", "task": SECOND.id, **fields}
    answer = player.post("/play", origin, **asked)
    assert answer.status_code == status
    assert "<script>" not in answer.text
    assert sorted(player.folder.rglob("*.json")) == before
    assert player.get("/play").count("/play/") <= shown.count("/play/")  # no further session


def test_what_makes_no_sense_in_a_session_changes_nothing(player: Player, tmp_path: Path) -> None:
    session = player.begin("", agent="oracle")
    page = player.get(session)
    illegal = "slice Bread"
    for status, fields in {
        422: {"do": "act", "action": illegal, "step": "1"},
        409: {"do": "act", "action": "observe", "step": "2"},
        400: {"do": "reset"},
        403: {"do": "act", "action": "observe", "step": "1", "secret": "x"},
    }.items():
        assert illegal not in player.offered(session)
        assert player.post(session, **fields).status_code == status
        assert player.get(session) == page
    for hostile in ("", "<q>", "navigate to", "\0", "\u202e", "é" * 300, "1", "observe\nend"):
        answer = player.post(session, do="act", action=hostile, step="1")
        assert answer.status_code == 422
        assert "<q>" not in answer.text
        assert "\u202e" not in answer.text
    for step in ("", "-1", "1.0", "٣", "9" * 50):
        assert player.post(session, do="act", action="observe", step=step).status_code == 422
    assert player.get(session) == page
    assert player.post("/play", suite="mini", agent="oracle").status_code == 409  # one plays
    nobody = player.post("/play/nobody", do="act", action="observe", step="1")
    assert nobody.status_code == 404
    assert "Nobody plays here any more" in nobody.text
    assert '<a href="/play">Back</a>' in nobody.text
    assert player.client.get(f"{session}/picture?step=2").status_code == 404
    assert player.client.get(f"{session}/picture?step=1&n=-1").status_code == 404
    player.client.put(session)
    assert player.get(session) == page
    assert player.post(session, do="close").status_code == 303
    assert player.folder is not None
    assert not run_path(player.folder, "mini", "oracle").exists()  # there is nothing to keep


def test_where_playing_is_off_nothing_is_written(tmp_path: Path) -> None:
    with Player(None, tmp_path) as nobody:
        assert "er-gym ui --play" in nobody.get("/play")
        assert nobody.post("/play", secret="x", suite="mini").status_code == 403
        assert nobody.post("/play/x", secret="x", do="act").status_code == 403
        assert nobody.client.get("/play/x").status_code == 404
    assert not any(tmp_path.iterdir())


def test_an_action_is_typed_and_a_task_is_skipped(tmp_path: Path) -> None:
    with Player(tmp_path / "played") as player:
        session = player.begin(task="", type=TYPE)
        went = next(one for one in player.offered(session) if one.startswith("navigate to "))
        for text in ("", "navigate to", "fly to the moon"):
            assert player.act(session, text).status_code == 422, text
        assert (
            player.act(session, went.replace("navigate to ", "GO  to ").lower()).status_code == 303
        )
        assert f"<b>{went}</b>" in player.get(session)
        assert player.post(session, do="skip").status_code == 303
        page = player.get(session)
        assert 'name="step" value="1"' in page  # the next task has begun
        (record,) = player.run().episodes()
        assert (record.end_reason, record.gave_up) == ("gave up", "the person skipped it")
        assert len(record.steps) == 2


def test_sessions_are_few_and_end_when_the_person_has_left(tmp_path: Path) -> None:
    sessions = Sessions(most=1, idle_seconds=0.5)
    one, other = (
        plan(tmp_path, suite="mini", task=FIRST.id, agent=each) for each in ("", "random")
    )
    first = sessions.begin(one)
    with pytest.raises(Refused, match="play_too_many") as refused:
        sessions.begin(other)
    assert refused.value.status == 429
    while first.now.phase != "closed":
        first.wait(60.0, first.now.version)
    assert first.now.left
    assert sessions.open_now() == []
    assert not any(tmp_path.iterdir())


def test_both_languages_have_the_same_words() -> None:
    assert words_in("en").keys() <= words_in("zh").keys()
    labels = {f"do_{verb.name.replace(' ', '_')}" for verb in OWN}
    assert labels <= words_in("en").keys()


def test_who_decided_is_written_only_where_it_was_not_the_agent() -> None:
    own, persons = StepRecord(verb="end", success=True), RoundRecord(message=1, by="person")
    assert "by" not in own.model_dump()
    assert "by" not in json.loads(own.model_dump_json())
    assert StepRecord.model_validate(own.model_dump()) == own
    assert "by" not in RoundRecord(message=1).model_dump()
    assert RoundRecord.model_validate_json(persons.model_dump_json()) == persons
    with pytest.raises(ValidationError):
        StepRecord.model_validate({"verb": "end", "success": True, "by": "a cat"})
