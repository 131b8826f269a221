"""The examples run, and the short ones are short."""

from __future__ import annotations

import json
import re
import runpy
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from episodes_by_hand import Episode

from agents import make_agent
from agents.rl.rewards import with_reward
from benchmarks.harness.chat_server import ChatServer, Exchange, completion
from er_gym import EmbodiedEnv, load_suite
from er_gym.rollout.run_directory import RunDirectory

Run = Callable[..., str]

SHORT = (
    "best_first_search",
    "compare_runs",
    "fork_episode",
    "own_agent",
    "own_prompt",
    "own_reward",
    "own_tasks",
    "train_policy",
    "trajectories",
)
"""The scripts for what one does first; the others connect er-gym to other programs."""
OTHERS = ("ai2thor_tutorial",)


@pytest.fixture
def run_example(
    repository: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
) -> Run:
    """Runs an example by name, with arguments, in a folder of its own; returns what it prints."""
    monkeypatch.chdir(tmp_path)

    def run(name: str, *arguments: str) -> str:
        monkeypatch.setattr(sys, "argv", [name, *arguments])
        runpy.run_path(str(repository / "examples" / f"{name}.py"), run_name="__main__")
        return capsys.readouterr().out

    return run


def test_each_example_is_known_and_named_in_the_readme(repository: Path) -> None:
    scripts = {path.stem for path in (repository / "examples").glob("*.py")}
    assert scripts == {*SHORT, *OTHERS}
    readme = (repository / "README.md").read_text(encoding="utf-8")
    assert [name for name in sorted(scripts) if f"`examples/{name}.py`" not in readme] == []


def test_an_example_of_what_one_does_first_has_under_60_lines(repository: Path) -> None:
    for name in SHORT:
        text = (repository / "examples" / f"{name}.py").read_text(encoding="utf-8")
        assert len(text.splitlines()) < 60, name
        assert f"python examples/{name}.py" in text  # says how it is run


def test_the_own_agent_does_most_tasks(
    run_example: Run, repository: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Two instructions name the thing by another word than its type; one thing is not found.
    assert "9 of 12 tasks done" in run_example("own_agent")
    monkeypatch.syspath_prepend(str(repository))
    assert make_agent("examples.own_agent:Fetcher").obs_mode == "text"


def test_the_own_reward_is_paid_once_for_each_type(
    run_example: Run, repository: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said = run_example("own_reward")
    assert any(float(paid) > 0 for paid in re.findall(r": (\d\.\d\d)$", said, re.MULTILINE))

    monkeypatch.syspath_prepend(str(repository))
    plain = EmbodiedEnv("mini", obs_mode="text")
    env = with_reward(EmbodiedEnv("mini", obs_mode="text"), "examples.own_reward:Curiosity")
    *_, before = env.reset(seed=0)
    plain.reset(seed=0)
    seen = before["visible_mask"].astype(bool)
    for action in ("observe", "move forward", "navigate to Sink", "end"):
        reward, *_, info = env.step(action)[1:]
        new = info["visible_mask"].astype(bool) & ~seen
        seen |= new
        assert reward == pytest.approx(plain.step(action)[1] + 0.05 * new.sum())
    for each in (env, plain):
        each.close()


def test_the_own_tasks_are_written_and_can_be_done(run_example: Run, tmp_path: Path) -> None:
    said = run_example("own_tasks", "mine.jsonl")
    assert "3 of 3 points" in said
    assert "6 of 6 points" in said
    header, *tasks = map(json.loads, (tmp_path / "mine.jsonl").read_text().splitlines())
    assert header["format"] == "er-gym/tasks/1"
    assert [task["id"] for task in tasks] == ["lamp", "cold-apple"]


def test_the_own_prompt_reaches_the_model(run_example: Run) -> None:
    asked: list[list[dict[str, str]]] = []

    def answer(exchange: Exchange) -> None:
        asked.append(json.loads(exchange.body)["messages"])
        said = "<Thinking>Let me see.</Thinking><DecisionMaking>end</DecisionMaking>"
        exchange.send(json.dumps(completion(choices__0__message__content=said)).encode())

    with ChatServer(answer) as server:
        said = run_example("own_prompt", server.url, "a-model")
    assert said.count("Thinking: Let me see.\n    end -> ") == 3
    assert said.count("success: False") == 3
    played = [messages for messages in asked if messages[0]["role"] == "system"]
    assert len(played) == 3
    for (system, first), task in zip(played, load_suite("mini").tasks, strict=False):
        assert "Think in one short sentence" in str(system["content"])
        assert "- navigate to <object>: " in str(system["content"])
        assert task.instruction in str(first["content"])


@pytest.mark.parametrize("name", ["compare_runs", "own_prompt"])
def test_a_lacking_argument_is_answered_with_the_usage(run_example: Run, name: str) -> None:
    with pytest.raises(SystemExit, match=f"python examples/{name}.py"):
        run_example(name, "one")


def test_the_policy_is_trained(run_example: Run) -> None:
    pytest.importorskip("torch", reason="needs pip install 'er-gym[rl]'")
    (line,) = run_example("train_policy", "1").splitlines()
    assert re.fullmatch(r"update 1: mean return 0\.\d\d", line)


def test_the_trajectories_are_collected_and_read(run_example: Run, tmp_path: Path) -> None:
    said = run_example("trajectories", "mine")
    assert (tmp_path / "mine" / "trajectories.jsonl").is_file()
    assert said.count("success: True") == 2
    assert "[800 x 450 picture, ahead]" in said
    assert re.search(r"^  (analysis|reasoning|planning): \w", said, re.MULTILINE)
    assert said.count("=> end") == 2


def test_runs_are_compared(run_example: Run, run_directory: RunDirectory, episode: Episode) -> None:
    said = run_example("compare_runs")
    assert re.search(r"^random: .* of 22 episodes$", said, re.MULTILINE)
    assert re.search(r"^searcher: .* of 22 episodes$", said, re.MULTILINE)
    low = re.search(r"^difference: \d+\.\d% \((\d+\.\d)% to ", said, re.MULTILINE)
    assert low is not None  # not below 0: the searcher is better
    for task_id in ("one", "another"):
        run_directory.write(episode(("pickup Egg", "end"), ("pickup Egg", "end"), task_id=task_id))
    said = run_example("compare_runs", *[str(run_directory.path)] * 2)
    assert f"{run_directory.path}: 100.0% (34.2% to 100.0%) of 2 episodes" in said
    assert "difference: 0.0% (0.0% to 0.0%)" in said


def test_an_episode_is_saved_and_forked(run_example: Run, tmp_path: Path) -> None:
    said = run_example("fork_episode", "mine.snapshot")
    right, wrong = re.findall(r"success: (\w+)", said)
    assert (right, wrong) == ("True", "False")
    saved = EmbodiedEnv(obs_mode="text")
    saved.restore((tmp_path / "mine.snapshot").read_bytes())
    assert saved.step("observe")[-1]["steps"] == 3  # the placing of the agent, one action, this
    saved.close()


def test_a_search_solves_tasks(run_example: Run) -> None:
    said = run_example("best_first_search", "2")
    assert len(re.findall(r"^    .*, end$", said, re.MULTILINE)) == 2
    assert "not solved" not in said


def test_the_ai2thor_tutorial_runs_on_our_engine(
    repository: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))  # where the client keeps its logs
    script = repository / "examples" / "ai2thor_tutorial.py"
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "FloorPlan1_physics: 77 objects" in done.stdout
    assert "the apple is in ['Fridge|-02.10|+00.00|+01.07'], cold" in done.stdout


def test_the_notebook_runs_from_top_to_bottom(
    repository: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    notebook = json.loads((repository / "examples" / "first_steps.ipynb").read_text("utf-8"))
    names: dict[str, object] = {}
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            assert not cell["outputs"]  # they would be those of another version
            exec("".join(cell["source"]), names)
    said = capsys.readouterr().out
    assert "success: True" in said
    assert re.search(r"oracle +4 of 4", said)
