"""Settings of vision-language agents, and the agents made from them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("openai", reason="needs the extra vlm")

from naughty_server import NaughtyServer

from agents import configs, make_agent
from agents.factory import (
    AgentFactory,
    comparable_settings,
    is_model_agent,
    load_settings,
    settings_file,
)
from agents.vlm.agent import VLMAgent
from agents.vlm.chat import Message
from agents.vlm.clients.budget import Budget
from agents.vlm.settings import AgentSettings
from er_gym.rollout.run_directory import REPLIES, SPENDING

HELLO = [Message("user", ("Hello.",))]


@pytest.mark.parametrize("name", configs.names("agents"))
def test_settings_that_come_with_er_gym_can_be_used(name: str) -> None:
    settings = load_settings(name, ("server.base_url=http://127.0.0.1:1/v1",))
    agent = AgentFactory("openai:m", settings).agent(0)
    assert agent.obs_mode == settings.obs_mode


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (("pictures.keep=-1",), "wrong field 'pictures.keep'"),
        (("pictures.min_pixels=999999",), "min_pixels 999999 is more than max_pixels"),
        (("server.key=abc",), "wrong field 'server.key'"),
        (("sees",), "'sees' is not an override"),
    ],
)
def test_wrong_settings_are_reported(overrides: tuple[str, ...], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        load_settings(None, overrides)


def test_a_missing_file_is_reported() -> None:
    with pytest.raises(ValueError, match="there is no agent 'genius'; give a YAML file, or one of"):
        load_settings("genius")


@pytest.mark.parametrize(
    ("name", "answer"),
    [("openai:m", True), ("hf:a/b", True), ("openai:", False), ("oracle", False), ("rl:x", False)],
)
def test_who_speaks(name: str, answer: bool) -> None:
    assert is_model_agent(name) is answer


def test_what_makes_two_runs_differ() -> None:
    one = AgentSettings()
    elsewhere = load_settings(None, ("server.base_url=http://127.0.0.1:1/v1", "local.batch=3"))
    warmer = load_settings(None, ("sampling.temperature=0.5",))
    assert comparable_settings(one, "d") == comparable_settings(elsewhere, "d")
    assert comparable_settings(one, "d") != comparable_settings(warmer, "d")
    blind = one.model_copy(update={"pictures": one.pictures.model_copy(update={"noise": True})})
    assert comparable_settings(blind, "d")["pictures"]["noise"] is True
    assert "noise" not in comparable_settings(one, "d")["pictures"], "older runs lack it"
    assert comparable_settings(one, "d") != comparable_settings(one, "e")


def test_settings_that_a_model_was_tuned_for_hold_beneath_the_others(tmp_path: Path) -> None:
    run, own = tmp_path / "run", tmp_path / "own.yaml"
    (run / "model").mkdir(parents=True)
    tuned = run / "model" / "agent.yaml"
    tuned.write_text("prompts: {dialect: paper, language: zh}\npictures: {max_pixels: 50000}\n")
    own.write_text("pictures: {quality: 70}\nprompts: {language: en}\n")
    assert settings_file("openai:m") is None
    assert settings_file(f"hf:{tmp_path}") is None
    assert settings_file(f"hf:{run / 'model'}") == tuned
    (run / "finetune.json").write_text("{}")
    assert settings_file(f"hf:{run}") == tuned
    settings = load_settings(str(own), ("sampling.top_p=0.5",), tuned)
    assert (settings.prompts.dialect, settings.prompts.language) == ("paper", "en")
    assert (settings.pictures.max_pixels, settings.pictures.quality) == (50_000, 70)
    assert settings.sampling.top_p == 0.5
    assert load_settings(None, ("prompts.dialect=tags",), tuned).prompts.dialect == "tags"
    tuned.write_text("prompts: {dialekt: paper}\n")
    with pytest.raises(ValueError, match=r"agent\.yaml: the agent has a wrong field 'prompts\.dia"):
        load_settings(None, (), tuned)
    (run / "model").rename(run / "draft")
    with pytest.raises(ValueError, match="is a fine-tuning run that is not finished"):
        settings_file(f"hf:{run}")


def test_replies_are_kept_and_counted_in_the_run_directory(tmp_path: Path) -> None:
    with NaughtyServer("Good day.") as server:
        settings = load_settings(None, (f"server.base_url={server.url}", "prices.completion=1000"))
        for kept in (False, True):
            speaker = AgentFactory("openai:naughty-1", settings, tmp_path, Budget(max_usd=1))
            reply = speaker.client.reply(HELLO, 0)
            assert (reply.text, reply.from_cache) == ("Good day.", kept)
            assert "tokens in 1 replies, $" in str(speaker.cost)
            speaker.close()
        assert server.count == 1
    assert (tmp_path / SPENDING).read_text().count("\n") == 1
    assert (tmp_path / REPLIES).is_dir()


def test_by_name_it_is_an_agent_like_any_other(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", "sk-test")
    agent = make_agent("openai:gpt-4o", seed=3)
    assert isinstance(agent, VLMAgent)
    assert agent.obs_mode == "rgb"


def test_agents_are_imported_without_what_models_need() -> None:
    program = (
        "import sys, agents\n"
        "print([n for n in ('openai', 'torch', 'jinja2', 'rapidfuzz') if n in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout.strip() == "[]", done.stderr
