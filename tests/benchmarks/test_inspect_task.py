"""Inspect plays suites with a scripted model; ``make test-inspect`` runs these tests."""

from __future__ import annotations

import base64
import importlib.util
import io
import re
import sys
import zipfile
from pathlib import Path

import anyio
import pytest
from click.testing import CliRunner
from PIL import Image

pytest.importorskip("inspect_ai", reason="needs the extra inspect: make test-inspect")

from inspect_ai import eval as evaluate
from inspect_ai.log import read_eval_log
from inspect_ai.model import ModelAPI, ModelOutput, ModelUsage, get_model, modelapi

from agents.scripted.oracle import OracleAgent
from agents.vlm.parsing.vocabulary import DECISION
from benchmarks.cli.errors import CRASHED
from benchmarks.cli.inspect import inspect
from benchmarks.inspect_task import EPISODE, er_gym
from benchmarks.scoring.metrics import METRICS
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout.play import episode_seed, play_episode
from er_gym.rollout.records import EpisodeRecord
from er_gym.tasks.suites import load_suite

_SERVER = Path(__file__).parents[1] / "agents" / "vlm" / "naughty_server.py"
_spec = importlib.util.spec_from_file_location("naughty_for_inspect", _SERVER)
naughty = importlib.util.module_from_spec(_spec)
sys.modules[_spec.name] = naughty
_spec.loader.exec_module(naughty)

SUITE = load_suite("mini")
TASK = next(
    task for task in SUITE.tasks if task.id == "FloorPlan9-single_pickup_from_closerep-Apple"
)


@pytest.fixture(scope="module")
def right() -> list[str]:
    """The oracle's actions."""
    env = EmbodiedEnv((), obs_mode="text", **SUITE.env)
    played = play_episode(env, OracleAgent(), TASK, episode_seed(0, TASK.id))
    env.close()
    return [step.text for step in played.steps[1:]]


@pytest.fixture
def play(tmp_path):
    """Plays the task, with what a function says to the messages; returns the log with all that is
    in it."""

    def run(say, overrides=("sees=text",), **more):
        model = get_model("mockllm/model", custom_outputs=say)
        log = evaluate(
            er_gym("mini", overrides=overrides),
            model=model,
            sample_id=TASK.id,
            log_dir=str(tmp_path),
            display="none",
            **more,
        )[0]
        return read_eval_log(log.location, resolve_attachments=True)

    return run


def with_usage(output: ModelOutput) -> ModelOutput:
    """Inspect would count the tokens, with an encoding that it fetches from the internet."""
    output.usage = ModelUsage(input_tokens=5, output_tokens=2, total_tokens=7)
    return output


def spoken(text: str) -> ModelOutput:
    return with_usage(ModelOutput.from_content("mockllm", text))


def turn(messages) -> int:
    return sum(message.role == "assistant" for message in messages)


def pictures(message) -> list[str]:
    return [part.image for part in message.content_list if part.type == "image"]


def test_an_episode_is_played_scored_and_shown(play, right):
    sent = []

    def say(messages, *more):
        sent.append([len(pictures(message)) for message in messages if message.role == "user"])
        action = right[turn(messages)]
        return spoken(f"<Thinking>Well.</Thinking><{DECISION}>{action}</{DECISION}>")

    log = play(say, overrides=["pictures.keep=0", "pictures.width=320"])
    assert log.status == "success"
    (sample,) = log.samples
    assert sample.input == TASK.instruction
    assert sample.metadata == {
        "type": "single_pickup_from_closerep",
        "group": TASK.type.group,
        "scene": "FloorPlan9",
    }

    score = sample.scores["episode_scores"]
    assert tuple(score.value) == METRICS
    assert score.value["success"] == score.value["completeness"] == 1.0
    assert score.answer == "; ".join(right)
    means = {each.name: each.metrics["mean"].value for each in log.results.scores}
    assert means == score.value

    record = EpisodeRecord.model_validate(sample.store[EPISODE])
    assert record.success
    assert record.agent == "mockllm/model"
    assert "Well." in record.steps[1].thought

    roles = [message.role for message in sample.messages]
    assert roles == ["system", *["user", "assistant"] * len(right)]
    for message in sample.messages[1::2]:
        assert pictures(message)
        for url in pictures(message):
            head, letters = url.split(",")
            assert head == "data:image/jpeg;base64"
            assert Image.open(io.BytesIO(base64.b64decode(letters))).width >= 300
    # Earlier pictures were not sent again, but stay in the log.
    assert [counts[-1] > 0 for counts in sent] == [True] * len(right)
    assert [sum(counts[:-1]) for counts in sent] == [0] * len(right)

    asked = [event for event in sample.events if event.event == "model"]
    assert [len(event.input) for event in asked] == [2 * n + 2 for n in range(len(right))]
    # An earlier message keeps its object.
    assert asked[0].input[0].id == asked[-1].input[0].id == sample.messages[0].id
    assert asked[1].input[2].id == sample.messages[2].id


def test_by_tool_with_the_settings_way_of_choosing_words(play):
    seen = []

    def say(messages, tools, tool_choice, config):
        seen.append((config.seed, [message.role for message in messages]))
        assert (config.temperature, config.top_p, config.max_tokens) == (0.3, None, 77)
        assert (tools[0].name, tool_choice.name) == ("act", "act")
        verb = ("observe", "end")[turn(messages)]
        call = {"action": verb, "object": ""}
        return with_usage(ModelOutput.for_tool_call("mockllm", "act", call))

    overrides = ["sees=text", "decide=tools", "sampling.temperature=0.3", "sampling.max_tokens=77"]
    log = play(say, overrides=overrides, epochs=2, max_samples=1)
    assert log.status == "success"
    assert [sample.scores["episode_scores"].answer for sample in log.samples] == [
        "observe; end"
    ] * 2
    roles = ["system", "user", "assistant", "user"]
    assert [each for _, each in seen] == [roles[:2], roles] * 2
    seeds = [seed for seed, _ in seen]
    assert seeds[0] == seeds[1] == episode_seed(0, TASK.id)
    assert seeds[2] == seeds[3] == episode_seed(1, TASK.id)


def test_as_json_with_the_command_lines_way_of_choosing_words(play):
    def say(messages, tools, tool_choice, config):
        assert (config.temperature, config.top_p) == (0.9, 0.5)
        assert config.response_schema.json_schema.required == ["thoughts", "action", "object"]
        return spoken('{"thoughts": "Enough.", "action": "end", "object": ""}')

    log = play(say, overrides=["sees=text", "decide=json"], temperature=0.9, top_p=0.5)
    (score,) = [sample.scores["episode_scores"] for sample in log.samples]
    assert score.answer == "end"
    assert score.value["success"] == 0.0
    assert "not done: " in score.explanation


# -- what goes wrong -----------------------------------------------------------------------------


def test_what_the_model_raises_is_the_samples_error(play):
    def say(messages, *more):
        if turn(messages):
            raise OverflowError("no more of this")
        return spoken(f"<{DECISION}>observe</{DECISION}>")

    log = play(say)
    assert log.status == "error"
    assert "no more of this" in log.samples[0].error.message
    assert "OverflowError" in log.samples[0].error.traceback


def test_a_limit_ends_an_episode_which_is_scored(play):
    log = play(lambda *given: spoken(f"<{DECISION}>observe</{DECISION}>"), message_limit=7)
    assert log.status == "success"
    (sample,) = log.samples
    assert sample.limit.type == "message"
    assert re.fullmatch("observe(; observe)+", sample.scores["episode_scores"].answer)
    assert sample.scores["episode_scores"].value["success"] == 0.0


def test_a_time_limit_ends_a_reply_that_does_not_come(play):
    async def say(*given):
        await anyio.sleep(600)

    log = play(say, time_limit=1)
    (sample,) = log.samples
    assert sample.limit.type == "time"
    assert sample.scores["episode_scores"].value["success"] == 0.0


# -- the command `er-gym inspect` ----------------------------------------------------------------


@modelapi(name="mute")
class Mute(ModelAPI):
    """A model that does not know what to do, or even less."""

    async def generate(self, input, tools, tool_choice, config):
        if self.model_name == "dumb":
            raise OverflowError("not a word")
        return spoken("I do not know.")


def run_command(model: str, tmp_path, *more: str) -> int:
    given = ["--limit", "1", "--set", "sees=text", "--log-dir", str(tmp_path), *more]
    return inspect.main(["--model", model, *given], standalone_mode=False)


def test_the_command(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("INSPECT_DISPLAY", "none")
    assert run_command("mute/model", tmp_path) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "success: 0.000"
    assert [line.split(":")[0] for line in lines[:-1]] == list(METRICS)
    log = read_eval_log(lines[-1])
    assert log.eval.task == "er_gym"
    assert log.eval.task_args["suite"] == "mini"


def test_the_command_says_what_went_wrong(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("INSPECT_DISPLAY", "none")
    assert run_command("mute/dumb", tmp_path) == CRASHED
    out, err = capsys.readouterr()
    assert read_eval_log(out.splitlines()[-1]).status == "error"
    assert err.splitlines()[-1].startswith("er-gym: the evaluation ended early: ")
    assert "not a word" in err


KEY, CODE = "sk-inspect-0a1b2c3d4e", "query-secret-0a1b2c"


@pytest.mark.parametrize("status", [200, 400, 401])
def test_no_secret_that_a_server_repeats_is_logged(status, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("INSPECT_DISPLAY", "none")
    monkeypatch.setenv("LOCAL_API_KEY", KEY)
    said = naughty.completion({"content": f"<{DECISION}>end</{DECISION}> {KEY} {CODE}"})
    told = said if status == 200 else {"error": {"message": f"wrong: {KEY} {CODE}"}}
    with naughty.NaughtyServer(script=[naughty.Raw(told, status)]) as server:
        url = f"{server.url}?code={CODE}"
        code = run_command("openai-api/local/m", tmp_path, "--model-base-url", url)
    assert code == (0 if status == 200 else CRASHED)
    assert server.seen[0].path.endswith(f"/chat/completions?code={CODE}")
    (log,) = tmp_path.iterdir()
    with zipfile.ZipFile(log) as file:
        everything = b"".join(file.read(name) for name in file.namelist())
    out, err = capsys.readouterr()
    assert b"***" in everything
    for secret in (KEY, CODE):
        assert secret.encode() not in everything
        assert secret not in out + err


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--model", "mockllm/model", "--suite", "maxi"], "unknown suite 'maxi'"),
        (
            ["--model", "mockllm/model", "--model-base-url", "http://me:pw@host/v1"],
            "holds a user or a password",
        ),
        (
            ["--model", "mockllm/model", "--model-base-url", "http://host/v1?a=b"],
            "mockllm/model does not accept a query in --model-base-url",
        ),
        (["--model", "mockllm/model", "--set", "sees=all"], "sees"),
        (["--model", "openai/gpt-4o"], "OPENAI_API_KEY"),
    ],
)
def test_bad_input(arguments, says, monkeypatch, tmp_path):
    monkeypatch.delenv("OPENAI_API_KEY", raising=False)
    monkeypatch.setenv("INSPECT_DISPLAY", "none")
    result = CliRunner().invoke(inspect, [*arguments, "--log-dir", str(tmp_path)])
    assert result.exit_code == 2, result.output
    assert says in result.stderr
    assert "[bold]" not in result.stderr
    assert result.stderr.count("\n") == 1
