"""``er-gym collect --expert``, end to end: a server that misbehaves, a local model, a recording."""

from __future__ import annotations

import importlib.util
import json
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("openai", reason="needs the extra vlm")

from click.testing import CliRunner
from small_suite import NAME, small
from verified import problems

from agents.expert.decider import Deciders, DecidingAgent
from agents.expert.writers.reader import Critic, reader_settings
from agents.vlm.clients.session import ModelSession
from agents.vlm.settings import AgentSettings
from benchmarks.checks.expert_server import collect_with_faults, wrong_thoughts
from benchmarks.checks.scripted_expert import answers, good, scripted_expert
from benchmarks.cli.main import cli
from benchmarks.harness.chat_server import ChatServer, Fault, Messages, text_of
from er_gym.data.collection import Collection
from er_gym.data.knowledge import knowledge_at
from er_gym.data.trajectory import Trajectory

SMALL = ("--set", "pictures.width=64", "--set", "pictures.height=48")


def collect(out: Path, *more: str) -> Any:
    command = ["collect", "--suite", NAME, "--parts", "imitation", "--workers", "1"]
    command += ["--out", str(out), *more]
    return CliRunner().invoke(cli, command, standalone_mode=False)


def with_expert(url: str, out: Path, *more: str) -> Any:
    return collect(out, "--expert", "openai:scripted", "--base-url", url, *SMALL, *more)


def trajectories(out: Path) -> list[Trajectory]:
    return list(Collection.open(out).trajectories())


@pytest.fixture
def server() -> Iterator[ChatServer]:
    """A model that does as it is asked."""
    with scripted_expert() as one:
        yield one


def test_an_episode_whose_scene_does_not_load_leaves_no_trajectory() -> None:
    model: Any = SimpleNamespace(obs_mode="text")
    settings: Any = None
    agent = DecidingAgent(model, "m", settings, settings, lambda trajectory: "")
    episode: Any = None
    assert agent.attachments(episode, "stem") == {}


def test_eight_trajectories_with_a_server_that_misbehaves(tmp_path: Path) -> None:
    """The program in benchmarks/checks collects two hundred."""
    more = ("--suite", NAME, "--parts", "imitation", "--types", "single_search", "--workers", "1")
    outcome = collect_with_faults(tmp_path, 8, *more, seed=1, bad=0.5, budget=0.05)
    assert outcome.problems == ()
    assert outcome.trajectories == 8
    assert outcome.thoughts["openai:scripted"] > outcome.thoughts["grounded"] > 0
    assert {"leak", "missing", "tags"} <= set(outcome.refusals)
    assert problems(tmp_path, small().tasks) == []


def test_what_will_not_be_taken_costs_nothing(tmp_path: Path, server: ChatServer) -> None:
    result = with_expert(server.url, tmp_path, "--limit", "3", "--types", "pickup_and_put")
    assert result.return_value == 0, result.output
    taken = trajectories(tmp_path)
    assert len(taken) == 3
    # One request for each turn of what is taken, none for what is not.
    assert server.count == sum(len(each.turns) for each in taken)
    assert server.count == sum(each.cost.requests for each in taken)
    assert all(not list(wrong_thoughts(each)) for each in taken)
    played = list((tmp_path / "parts" / "imitation" / "trajectories").glob("*.json"))
    assert len(played) >= 3
    assert problems(tmp_path, small().tasks) == []


def test_the_manifest_states_the_model_and_no_secret(
    tmp_path: Path, server: ChatServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", "sk-very-secret")
    more = ("--limit", "1", "--types", "single_search", "--places", "model")
    result = with_expert(f"{server.url}?code=very-secret", tmp_path, *more)
    assert result.return_value == 0, result.output
    stated = Collection.open(tmp_path).manifest.settings["expert"]
    assert stated["name"] == "openai:scripted"
    assert (stated["decisions"], stated["places"]) == ("plan", "model")
    assert stated["settings"]["sampling"]["temperature"] == 0.9
    assert len(stated["settings"]["prompts_digest"]) == 64
    assert problems(tmp_path, small().tasks) == []
    everything = b"".join(file.read_bytes() for file in tmp_path.rglob("*") if file.is_file())
    assert b"very-secret" not in everything
    other = with_expert(server.url, tmp_path, *more, "--set", "sampling.temperature=0.1")
    assert "holds another collection" in str(other.exception)


def verified(out: Path, *more: str) -> Any:
    command = ["data", "verify", str(out), "--suite", NAME, "--workers", "1", *more]
    return CliRunner().invoke(cli, command, standalone_mode=False)


def reading(objects_to: str) -> tuple[Fault, list[str]]:
    """A server of two models: one writes thoughts, the other reads them and objects to some words.

    Returns:
        The server's script, and the words of each question to the one that reads.
    """
    asked: list[str] = []

    def say(messages: Messages) -> str:
        if "You check the thoughts" not in text_of(messages[0]):
            return good(messages)
        told = text_of(messages[1])
        asked.append(told)
        parts = told.rsplit("The parts to check, as JSON:", 1)[1]
        verdict = "false" if objects_to in parts else "unknown"
        return json.dumps({"claims": [{"claim": parts, "verdict": verdict, "fact": "F1"}]})

    return answers(say), asked


def test_a_second_model_reads_what_the_rules_leave_open(tmp_path: Path) -> None:
    fault, asked = reading("my second move")
    more = ("--limit", "1", "--types", "single_search", "--critic", "openai:reader")
    with ChatServer(fault) as server:
        result = with_expert(server.url, tmp_path, *more)
        assert result.return_value == 0, result.output
        (one,) = trajectories(tmp_path)
        refused = {code for turn in one.turns for each in turn.thoughts for code in each.refused}
        assert refused == {"reader"}
        assert Collection.open(tmp_path).manifest.settings["expert"]["critic"]["name"]
        assert one.cost.requests >= server.count  # the same question is asked once
        told = " ".join(result.output.split())
        found = re.search(r"The model was asked about (\d+) thoughts", told)
        assert found is not None
        assert int(found[1]) >= len(asked) > 0
        assert "no claim in" in told
        before = server.count
        url = ("--critic", "openai:reader", "--base-url", server.url, *SMALL)
        again = verified(tmp_path, *url)
        assert again.return_value == 0, again.output
        assert server.count - before <= sum(
            each.writer == "grounded" for turn in one.turns for each in turn.thoughts
        )
        assert "The model was asked about" in again.output


def test_a_collection_that_is_there_is_read_by_a_model(tmp_path: Path, server: ChatServer) -> None:
    collect(tmp_path, "--limit", "1", "--types", "single_search", "--no-pictures")
    fault, asked = reading("")
    with ChatServer(fault) as reader:
        url = ("--critic", "openai:reader", "--base-url", reader.url)
        found = verified(tmp_path, "--no-pictures", *url)
    assert asked
    assert found.return_value != 0
    assert "reader: “" in " ".join(found.output.split())
    alone = verified(tmp_path, "--base-url", server.url)
    assert "is for a model: give --critic" in str(alone.exception)


NEEDS_A_MODEL = [
    ("--critic", "openai:m"),
    ("--base-url", "http://127.0.0.1:1/v1"),
    ("--max-usd", "1"),
    ("--set", "sampling.top_p=0.5"),
    ("--places", "model"),
    ("--decisions", "model"),
    ("--hint", "plan"),
    ("--strict-thoughts",),
]
MISFITS = [
    (("--expert", "openai:m"), "there is no key: set OPENAI_API_KEY"),
    (("--expert", "gpt-4o"), "not a model agent; give openai:MODEL"),
    (("--expert", "openai:m", "--hint", "plan"), "--hint plan is for a model that decides"),
    (("--expert", "openai:m", "--strict-thoughts"), "give --decisions model, too"),
    (("--expert", "recorded:x"), "--expert recorded:x is for a model that decides"),
    (("--expert", "openai:m", "--decisions", "model", "--places", "model"), "has no plan"),
    (("--expert", "openai:m", "--decisions", "model", "--kinds", "a"), "plays one kind"),
    (
        ("--expert", "openai:m", "--decisions", "model", "--critic", "openai:r"),
        "is for --decisions",
    ),
    (("--expert", "openai:m", "--critic", "r"), "not a model agent; give openai:MODEL"),
    (("--expert", "openai:m", "--writer", "x:Y"), "give --writer x:Y or --expert"),
    (("--expert", "openai:m", "--max-usd", "1"), "--max-usd needs prices"),
    (("--expert", "openai:m", "--set", "decide=json"), "leave decide out"),
]


@pytest.mark.parametrize("options", NEEDS_A_MODEL, ids=lambda each: each[0])
def test_options_for_a_model_need_one(tmp_path: Path, options: Sequence[str]) -> None:
    result = collect(tmp_path / "x", *options)
    assert "is for a model: give --expert" in str(result.exception)
    assert str(result.exception).startswith(options[0])
    assert not (tmp_path / "x").exists()


@pytest.mark.parametrize(("options", "message"), MISFITS, ids=[each[1] for each in MISFITS])
def test_options_that_do_not_go_together(
    tmp_path: Path, options: Sequence[str], message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("OPENAI_API_KEY", raising=False)
    result = collect(tmp_path / "x", *options)
    assert message in str(result.exception)
    assert not list((tmp_path / "x").glob("*.json"))  # the directory is free for the next try


def test_a_model_that_decides_with_the_plan_as_a_hint(tmp_path: Path, server: ChatServer) -> None:
    more = ("--limit", "4", "--decisions", "model", "--hint", "plan")
    result = with_expert(server.url, tmp_path, *more)
    assert result.return_value == 0, result.output
    taken = trajectories(tmp_path)
    assert len(taken) == 4
    assert problems(tmp_path, small().tasks) == []
    for each in taken:
        assert (each.kind, each.part, each.actor) == ("model", "model", "openai:scripted")
        assert "For you alone" not in each.model_dump_json()
        assert each.cost.requests == len(each.turns)
        assert all(turn.pictures for turn in each.turns)
        writers = {thought.writer for turn in each.turns for thought in turn.thoughts}
        assert writers == {"openai:scripted"}
        assert {thought.kind for turn in each.turns for thought in turn.thoughts} == {"planning"}


def test_with_strict_thoughts_a_lie_is_not_taken(tmp_path: Path) -> None:
    def liar(messages: Sequence[Mapping[str, Any]]) -> str:
        lie = "<Planning>I can see a BaseballBat and a ToiletPaperHanger right in front of me. "
        return good(messages).replace("<Planning>", lie)

    more = ("--limit", "1", "--types", "single_search", "--decisions", "model", "--hint", "plan")
    with ChatServer(answers(liar)) as server:
        with_expert(server.url, tmp_path, *more)
    assert problems(tmp_path, small().tasks) == []
    (one,) = trajectories(tmp_path)
    assert all("unseen" in thought.refused for turn in one.turns for thought in turn.thoughts)
    prompts: Any = None
    factory: Any = None
    assert Deciders(factory, prompts).rejection(one, 30) == ""
    assert "critic" in Deciders(factory, prompts, strict=True).rejection(one, 30)
    assert Deciders(factory, prompts).rejection(one, 1) == "too long"


def test_an_action_that_was_refused_is_not_learnt_from(tmp_path: Path) -> None:
    def clumsy(messages: Sequence[Mapping[str, Any]]) -> str:
        if len(messages) == 2:
            return "<Thinking>Is it here?</Thinking><DecisionMaking>open Fridge</DecisionMaking>"
        return good([*messages[:2], *messages[4:]])

    more = ("--limit", "1", "--types", "single_search", "--decisions", "model", "--hint", "plan")
    with ChatServer(answers(clumsy)) as server:
        result = with_expert(server.url, tmp_path, *more)  # no room of the suite has a fridge
    assert result.return_value == 0, result.output
    assert problems(tmp_path, small().tasks) == []
    (one,) = trajectories(tmp_path)
    assert [turn.train for turn in one.turns] == [turn.success for turn in one.turns]
    assert not one.turns[0].success


def test_a_recorded_run_becomes_trajectories(tmp_path: Path) -> None:
    task = next(each for each in small().tasks if each.type.name == "single_pickup")
    actions = [f"{key.verb} {key.actual_type}".strip() for key in task.key_actions]

    def knows(messages: Sequence[Mapping[str, Any]]) -> str:
        done = sum(message["role"] == "assistant" for message in messages)
        thought = f"<Planning>I go on with my {'very ' * done}first idea.</Planning>"
        return f"{thought}<DecisionMaking>{actions[done]}</DecisionMaking>"

    run = tmp_path / "run"
    with ChatServer(answers(knows)) as server:
        command = [
            "bench", "--suite", NAME, "--task-ids", task.id, "--agent", "openai:scripted",
            "--base-url", server.url, "--out", str(run), *SMALL,
        ]  # fmt: skip
        assert CliRunner().invoke(cli, command, standalone_mode=False).return_value == 0
    more = ("--limit", "1", "--types", "single_pickup", "--scenes", task.scene)
    out = tmp_path / "out"
    decided = ("--expert", f"recorded:{run}", "--decisions", "model", *SMALL)
    result = collect(out, *more, *decided)
    assert result.return_value == 0, result.output
    assert problems(out, small().tasks) == []
    (one,) = trajectories(out)
    assert [str(turn.action) for turn in one.turns] == actions
    assert [turn.thoughts[0].text for turn in one.turns][1] == "I go on with my very first idea."


def test_a_local_model_writes_or_is_stood_in_for(tmp_path: Path) -> None:
    pytest.importorskip("transformers", reason="needs the extra local")
    pytest.importorskip("torch", reason="needs the extra local")
    helper = Path(__file__).parents[1] / "vlm" / "tiny_qwen.py"
    spec = importlib.util.spec_from_file_location("tiny_qwen_here", helper)
    assert spec is not None
    assert spec.loader is not None
    tiny_qwen = importlib.util.module_from_spec(spec)
    sys.modules["tiny_qwen_here"] = tiny_qwen
    spec.loader.exec_module(tiny_qwen)
    model = tiny_qwen.make_tiny_qwen(tmp_path / "model")
    out = tmp_path / "out"
    more = ("--limit", "2", "--kinds", "b", "--types", "single_search", *SMALL)
    result = collect(out, *more, "--expert", f"hf:{model}", "--set", "sampling.max_tokens=8")
    assert result.return_value == 0, result.output
    assert re.search(r"tokens in \d+ replies", result.output)
    thoughts = [t for each in trajectories(out) for turn in each.turns for t in turn.thoughts]
    assert problems(out, small().tasks) == []
    assert {each.writer for each in thoughts} == {"grounded"}  # it speaks at random
    assert all(len(each.refused) >= 3 for each in thoughts)
    settings = AgentSettings.model_validate({"sees": "text", "sampling": {"max_tokens": 8}})
    with closing(ModelSession(f"hf:{model}", reader_settings(settings), out)) as session:
        critic = Critic(session.client)
        one = trajectories(out)[0]
        known = knowledge_at(one.turns, 0, instruction=one.instruction, language="en")
        assert critic.check("How odd this is.", "planning", known, limit=9).refusals == ()
    assert (critic.counts.asked, critic.counts.unread) == (1, 1)
    ledger = (out / "spending.jsonl").read_text().splitlines()
    assert sum(json.loads(line)["completion"] for line in ledger) > 0
