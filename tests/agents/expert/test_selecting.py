"""``er-gym bench --samples`` and ``er-gym collect --select``: rejection sampling, end to end."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Mapping
from itertools import count
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from sampled_agents import TASKS
from verified import problems

from agents.expert.collect import correction_strata
from agents.expert.players import PlaySettings
from agents.expert.recipe import load_recipe
from agents.expert.recorded_replies import split_speech
from agents.expert.replayed import QuotingAgent, Replayers
from agents.expert.selection import (
    SelectionRules,
    _capped,
    _level,
    count_kept,
    screen,
    selection_strata,
)
from agents.expert.thinker import ThinkingAgent
from agents.expert.thought_kinds import load_thought_kinds
from agents.expert.writers.registry import NamedWriter
from agents.vlm.settings import Pictures
from benchmarks.cli import collect_select
from benchmarks.cli.main import cli
from er_gym.data.collection import Collection
from er_gym.data.dialects import load_dialect
from er_gym.data.trajectory import Trajectory
from er_gym.data.verify import thought_problems
from er_gym.envs.actions import Action
from er_gym.rollout.run_directory import RunDirectory
from er_gym.tasks import load_suite

SAMPLES = 6
ROOT = Path(__file__).resolve().parents[3]
BENCH = ("bench", "--suite", "mini", "--agent", "sampled_agents:Wavering")
CHOSEN = ("--task-ids", ",".join(TASKS))


def er_gym(*words: object) -> Any:
    return CliRunner().invoke(cli, [str(word) for word in words], standalone_mode=False)


def done(*words: object) -> str:
    result = er_gym(*words)
    assert not result.exception, result.exception
    assert not result.return_value, result.output
    return str(result.output)


def refusal(*words: object) -> str:
    result = er_gym(*words)
    assert result.exit_code == 1, result.output
    (line,) = str(result.exception).splitlines()
    return line


def killed(files: str, number: int, out: Path, *words: object) -> None:
    """Run the command until it has written so many files, and kill it."""
    paths = os.pathsep.join((str(ROOT), str(ROOT / "tests")))
    command = [sys.executable, "-m", "benchmarks.cli", *map(str, words), "--out", str(out)]
    with subprocess.Popen(
        command,
        env={**os.environ, "PYTHONPATH": paths},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    ) as process:
        while len([*out.glob(files)]) < number and process.poll() is None:
            time.sleep(0.01)
        assert process.poll() is None, "it ended before it could be killed"
        process.send_signal(signal.SIGKILL)


def trajectories(out: Path) -> list[Trajectory]:
    return list(Collection.open(out).trajectories())


def yields(out: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((out / "yield.json").read_text())["types"]
    return found


def files_of(folder: Path) -> dict[str, bytes]:
    """Everything in a collection but times: run directories note when and how fast."""
    return {
        str(file.relative_to(folder)): file.read_bytes()
        for file in folder.rglob("*")
        if file.is_file() and file.parent.name != "episodes" and file.suffix != ".lock"
        and file.name != "events.jsonl"
    }  # fmt: skip


def timeless(run: Path) -> list[dict[str, Any]]:
    return [
        each.model_copy(update={"seconds": 0.0}).model_dump()
        for each in RunDirectory.open(run).episodes()
    ]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of four tasks, six samples of each."""
    out: Path = tmp_path_factory.mktemp("sampled") / "run"
    done(*BENCH, *CHOSEN, "--samples", SAMPLES, "--out", out)
    return out


@pytest.fixture(scope="module")
def collected(run: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What is selected from it."""
    out: Path = tmp_path_factory.mktemp("collected") / "x"
    table = done("collect", "--select", run, "--out", out, "--workers", "1")
    assert "What became of the samples" in table
    return out


# -- samples ---------------------------------------------------------------------------------------


def test_samples_are_episodes_of_their_own(run: Path, tmp_path: Path) -> None:
    episodes = list(RunDirectory.open(run).episodes())
    assert len(episodes) == len({each.seed for each in episodes}) == SAMPLES * len(TASKS)
    assert Counter(each.task_id for each in episodes) == dict.fromkeys(TASKS, SAMPLES)
    assert {each.sample for each in episodes} == {*range(1, SAMPLES + 1)}
    report = json.loads(done("report", run, "--format", "json"))["runs"][0]
    whole = report["scorers"]["corrected"]["samples"][0]
    by_task = [[e.success for e in episodes if e.task_id == task] for task in TASKS]
    assert whole["tasks"] == len(TASKS)
    assert whole["pass_at"][str(SAMPLES)] == sum(map(any, by_task)) / len(TASKS)
    assert whole["always"] == sum(map(all, by_task)) / len(TASKS)
    mean = report["scorers"]["corrected"]["slices"][0]["success"]["mean"]
    assert whole["pass_at"]["1"] == pytest.approx(mean)


def test_a_run_without_samples_goes_on_with_them_after_a_kill(run: Path, tmp_path: Path) -> None:
    done(*BENCH, *CHOSEN, "--out", tmp_path)
    first = {file.name: file.read_bytes() for file in (tmp_path / "episodes").iterdir()}
    assert all(b'"sample"' not in text for text in first.values())
    assert first.keys() == {f"{task}.json" for task in TASKS}
    words = (*BENCH, *CHOSEN, "--samples", SAMPLES)
    killed("episodes/*.json", len(TASKS) + 2, tmp_path, *words)
    done(*words, "--out", tmp_path)
    after = {file.name: file.read_bytes() for file in (tmp_path / "episodes").glob("*.json")}
    assert first.items() <= after.items()
    assert timeless(tmp_path) == timeless(run)


# -- selection -------------------------------------------------------------------------------------


def test_what_is_taken_and_why_the_rest_is_not(run: Path, collected: Path) -> None:
    episodes = list(RunDirectory.open(run).episodes())
    wanted = {
        (each.task_id, tuple(Action(step.verb, step.object_type) for step in each.steps[1:]))
        for each in episodes
        if each.success and all(step.success for step in each.steps)
    }
    taken = trajectories(collected)
    assert {(each.task_id, tuple(turn.action for turn in each.turns)) for each in taken} == wanted
    assert len(taken) == len(wanted) > len(TASKS)
    seeds = {each.seed for each in episodes}
    for each in taken:
        assert (each.part, each.kind, each.actor) == ("sampled", "played", BENCH[-1])
        assert each.success
        assert each.seed in seeds
        assert all(turn.success and turn.train and turn.thoughts for turn in each.turns)
        assert all(turn.pictures for turn in each.turns)
        assert load_dialect("paper").chat(each).trains_all
    rows = yields(collected)
    assert sum(row["kept"] for row in rows.values()) == len(taken)
    for row in rows.values():
        assert row["played"] == row["kept"] + sum(row["left_out"].values()) == SAMPLES
    reasons = {reason for row in rows.values() for reason in row["left_out"]}
    assert reasons == {"no success", "the same actions", "an action failed"}
    assert problems(collected, load_suite("mini").tasks) == []


def test_two_workers_and_a_kill_change_nothing(run: Path, collected: Path, tmp_path: Path) -> None:
    words = ("collect", "--select", run)
    killed("parts/*/episodes/*.json", 2, tmp_path, *words, "--workers", "1")
    done(*words, "--workers", "2", "--out", tmp_path)
    assert files_of(tmp_path) == files_of(collected)


def test_rules_decide_which_successes_are_taken(run: Path) -> None:
    directory, tasks = RunDirectory.open(run), load_suite("mini").tasks
    sizes = Counter[str]()
    for rules, number in (
        (SelectionRules(), None),
        (SelectionRules(keep_failed=True), None),
        (SelectionRules(keep_failed=True, most_actions=5), None),
        (SelectionRules(keep_failed=True, per_task=1), None),
        (SelectionRules(keep_failed=True, balance=1.0), None),
        (SelectionRules(keep_failed=True, balance="recipe"), None),
        (SelectionRules(keep_failed=True), 2),
    ):
        screening = screen([directory], tasks, rules, seed=0)
        strata = selection_strata(screening, rules, load_recipe(), number)
        for stratum in strata.values():
            stratum.next_chosen()
            stratum.take(stratum.chosen)
        found = count_kept(screening, strata, lambda _: "", limited=number is not None)
        assert all(row.kept + row.left_out.total() == SAMPLES for row in found.values())
        left_out = sum((row.left_out for row in found.values()), Counter())
        sizes[f"{vars(rules)} {number}"] = sum(row.kept for row in found.values())
        assert bool(left_out["an action failed"]) == (not rules.keep_failed)
        assert bool(left_out["too long"]) == (rules.most_actions == 5)
        assert bool(left_out["enough of its task"]) == (rules.per_task == 1)
        assert bool(left_out["enough of its type"]) == (rules.balance in (1.0, "recipe"))
        assert bool(left_out["enough in all"]) == (number is not None)
    clean, everything, short, single, even, shares, two = sizes.values()
    assert max(clean, short, single, even, shares) < everything
    assert (single, two) == (len(TASKS), 2)
    assert even % len(TASKS) == 0
    assert shares > 0


def test_a_replay_that_comes_out_differently_is_left_out(run: Path, tmp_path: Path) -> None:
    """Faults come from the seed of the episode, so that its replay has the same."""
    faulty = tmp_path / "run"
    done(*BENCH, *CHOSEN, "--samples", 3, "--faults", "0.4", "--out", faulty)
    succeeded = [each for each in RunDirectory.open(faulty).episodes() if each.success]
    changed = succeeded[0]
    file = faulty / "episodes" / f"{changed.key}.json"
    record = json.loads(file.read_text())
    record["steps"][1]["feedback"] = "something else"
    file.write_text(json.dumps(record))
    out = tmp_path / "x"
    done("collect", "--select", faulty, "--keep-failed", "--workers", 1, "--out", out)
    rows = yields(out)
    row = rows[changed.task_type]
    assert row["left_out"]["its replay came out differently"] == 1
    assert sum(each["kept"] for each in rows.values()) == len(trajectories(out)) > 0
    turns = [turn for each in trajectories(out) for turn in each.turns]
    assert any(turn.fault for turn in turns)
    assert any(turn.train for turn in turns)
    assert not any(turn.train for turn in turns if not turn.success)


def test_corrections_of_samples_begin_differently(run: Path) -> None:
    directory = RunDirectory.open(run)
    failed = {each.key: each for each in directory.episodes() if not each.success}
    strata, left_out = correction_strata(load_suite("mini").tasks, directory, None)
    (stratum,) = strata.values()
    stratum.next_chosen()
    begun = {(one.task.id, one.beginning.actions) for one in stratum.chosen if one.beginning}
    assert len(begun) == len(stratum.chosen) == stratum.quota
    assert {one.episode for one in stratum.chosen} < failed.keys()
    assert {one.id for one in stratum.chosen} == {f"{c.episode}-corrected" for c in stratum.chosen}
    assert len(begun) + left_out["another sample of its task begins alike"] == len(failed)
    assert left_out["another sample of its task begins alike"] > 0


# -- a model's own words ---------------------------------------------------------------------------


def test_a_models_thoughts_are_its_own(tmp_path: Path) -> None:
    pytest.importorskip("openai", reason="needs the extra vlm")
    from benchmarks.checks.scripted_expert import answers
    from benchmarks.harness.chat_server import ChatServer, Messages, text_of

    tasks = {task.instruction: task for task in load_suite("mini").tasks if task.id in TASKS[:2]}
    numbers = {instruction: count(1) for instruction in tasks}

    def play(messages: Messages) -> str:
        """The second sample does what the first did in other words, and the third looks around."""
        (task,) = (tasks[one] for one in tasks if one in text_of(messages[1]))
        said = [text_of(each) for each in messages if each["role"] == "assistant"]
        sample = int(said[0].split()[1]) if said else next(numbers[task.instruction])
        actions = [Action(key.verb, key.actual_type) for key in task.key_actions]
        if sample == 3:
            actions.insert(0, Action("observe"))
        action = actions[len(said)] if sample < 4 else Action("end")
        if sample == 1:
            thought = f"Sample {sample} sees a ToiletPaperHanger and I am glad of it. "
            speech = f"{thought}Let me make a plan. I will do step {len(said)} now."
        else:
            speech = f"<Planning>Sample {sample} is at step {len(said)}.</Planning>"
            speech = speech if sample < 4 or said else f"Sample {sample} gives up."
        return f"{speech} Fine, let me do that.\n<DecisionMaking>{action}</DecisionMaking>"

    run, out = tmp_path / "run", tmp_path / "x"
    with ChatServer(answers(play)) as server:
        done(
            "bench", "--suite", "mini", "--agent", "openai:scripted", "--base-url", server.url,
            "--task-ids", ",".join(TASKS[:2]), "--samples", 4, "--concurrency", 1, "--out", run,
            "--set", "sees=text", "--set", "sampling.temperature=1",
        )  # fmt: skip
        assert len([*(run / "conversations").iterdir()]) == 8
    done("collect", "--select", run, "--workers", 1, "--out", out)
    assert [row["left_out"] for row in yields(out).values()] == [
        {"no success": 1, "the same actions": 1}
    ] * 2
    taken = {(each.task_id, each.actions): each for each in trajectories(out)}
    assert len(taken) == 4
    for each in taken.values():
        assert each.actor == "openai:scripted"
        assert {one.writer for turn in each.turns for one in turn.thoughts} == {each.actor}
        assert each.cost.requests == len(each.turns)
    spoken = min(taken.values(), key=lambda each: (each.task_id, each.actions)).turns[0]
    assert [(one.kind, one.text) for one in spoken.thoughts] == [
        ("reasoning", "Sample 1 sees a ToiletPaperHanger and I am glad of it."),
        ("planning", "I will do step 0 now."),
    ]
    assert "unseen" in spoken.thoughts[0].refused
    # The record says what the critic has against it; the collection is verified all the same.
    assert not any(problem for each in taken.values() for problem in thought_problems(each))
    assert problems(out, load_suite("mini").tasks) == []

    directory = RunDirectory.open(run)
    screening = screen([directory], load_suite("mini").tasks, SelectionRules(), seed=0)
    chosen = {one.id: one for each in screening.candidates.values() for one in each}
    settings = PlaySettings(load_thought_kinds(), Pictures(), "en")
    writer = NamedWriter("grounded")
    for rewrite, kind in ((False, QuotingAgent), (True, ThinkingAgent)):
        make = Replayers(writer, chosen, rewrite).make(chosen, settings, 36)
        assert {type(make(one.played_task, 0)) for one in chosen.values()} == {kind}

    strict = Replayers(writer, chosen, strict=True)
    reasons = Counter(strict.rejection(each, 36) for each in taken.values())
    assert reasons == {"": 2, "the critic refuses a thought": 2}
    (run / "conversations" / f"{TASKS[0]}.json").write_text("{")
    screening = screen([directory], load_suite("mini").tasks, SelectionRules(), seed=0)
    assert screening.yields["single_search"].left_out["its conversation cannot be read"] == 1
    longest = SelectionRules(most_tokens=1)
    assert not screen([directory], load_suite("mini").tasks, longest, seed=0).candidates


def test_a_correction_may_begin_with_the_words_of_who_failed(tmp_path: Path) -> None:
    """A model that sees what is not there learns to go on from its own mistake."""
    pytest.importorskip("openai", reason="needs the extra vlm")
    from benchmarks.checks.scripted_expert import answers
    from benchmarks.harness.chat_server import ChatServer, Messages

    task = next(one for one in load_suite("mini").tasks if one.id == TASKS[0])

    def play(messages: Messages) -> str:
        number = sum(each["role"] == "assistant" for each in messages)
        words = f"<Observation>There is the Fridge, {number}.</Observation>"
        return f"{words}<DecisionMaking>navigate to Fridge</DecisionMaking>"

    run, plain, out = (tmp_path / name for name in ("run", "plain", "own"))
    with ChatServer(answers(play)) as server:
        done(
            "bench", "--suite", "mini", "--agent", "openai:scripted", "--base-url", server.url,
            "--task-ids", task.id, "--concurrency", 1, "--out", run, "--set", "sees=text",
        )  # fmt: skip
    how = ("--correct-after", "anywhere", "--correct-by", "searcher", "--workers", 1)
    done("collect", "--correct", run, *how, "--out", plain)
    done("collect", "--correct", run, *how, "--own-thoughts", "--out", out)
    rewritten, own = ({one.id: one for one in trajectories(each)} for each in (plain, out))
    assert rewritten.keys() == own.keys()
    assert len(own) > 1
    for name, each in own.items():
        assert each.correction is not None
        after = each.correction.first_wrong + 1
        assert each.correction.agent == "openai:scripted"
        assert each.actions == rewritten[name].actions
        said = [[(one.kind, one.text) for one in turn.thoughts] for turn in each.turns]
        assert said[:after] == [
            [("analysis", f"There is the Fridge, {number}.")] for number in range(after)
        ]
        writers = [{one.writer for one in turn.thoughts} for turn in each.turns]
        assert writers == [{"openai:scripted"}] * after + [{"grounded"}] * len(writers[after:])
        assert not any(turn.train for turn in each.turns[:after])
        for dialect in ("sight", "text", "paper"):
            chat = load_dialect(dialect).chat(each)
            replies = [turn for turn in chat.turns if turn.role == "assistant"]
            for number, reply in enumerate(replies):
                assert ("There is the Fridge" in reply.text) == (number < after)
        for dialect in ("sight", "text"):
            reply = load_dialect(dialect).chat(rewritten[name]).turns[2]
            assert "There is the Fridge" not in reply.text
    chinese = ("--own-thoughts", "--language", "zh", "--out", tmp_path / "zh")
    assert "thought in en, not in zh" in refusal("collect", "--correct", run, *chinese)
    assert problems(out, load_suite("mini").tasks) == []
    told = done("data", "verify", out, "--no-pictures", "--workers", 1)
    repeated = sum(one.correction.first_wrong + 1 for one in own.values() if one.correction)
    assert f"\n{repeated} thoughts were not written anew" in told
    file = out / "trajectories.jsonl"
    kept = file.read_text()
    for old, new, told in (
        ("openai:scripted", "", "correction.agent is ''"),
        ("There is the Fridge, 0", "There is the Mug, 0", "refused"),
    ):
        file.write_text(
            kept.replace(f'"agent":"{old}"', f'"agent":"{new}"').replace(old, new or old)
        )
        assert any(told in line for line in problems(out, load_suite("mini").tasks)), told


def test_own_thoughts_need_thoughts(run: Path, tmp_path: Path) -> None:
    told = refusal("collect", "--correct", run, "--own-thoughts", "--out", tmp_path / "x")
    assert "its agent left no thoughts" in told


@pytest.mark.parametrize("language", ["en", "zh"])
def test_speech_is_split_where_the_dialect_joined_it(collected: Path, language: Any) -> None:
    dialect = load_dialect("paper")
    for trajectory in trajectories(collected):
        chat = dialect.chat(trajectory, language)
        replies = [turn.text for turn in chat.turns if turn.role == "assistant"]
        for turn, reply in zip(trajectory.turns, replies, strict=True):
            speech = reply.rpartition("<DecisionMaking>")[0]
            assert split_speech(speech, "", language) == [
                (each.kind, each.text) for each in turn.thoughts
            ]


# -- how many of each type, and bad input ----------------------------------------------------------


def test_types_are_balanced_and_a_larger_limit_takes_nothing_away() -> None:
    there = {"a": 50, "b": 7, "c": 1}
    assert _capped(there, None) == there
    assert _capped(there, 3) == {"a": 3, "b": 3, "c": 1}
    before = dict.fromkeys(there, 0)
    for limit in range(1, 60):
        wanted = _level(there, limit)
        assert sum(wanted.values()) == min(limit, 58)
        assert all(before[name] <= wanted[name] <= there[name] for name in there)
        before = wanted
    assert _level(there, 9) == {"a": 4, "b": 4, "c": 1}


def test_the_defaults_are_those_of_the_rules() -> None:
    from agents.expert.selection import MOST_ACTIONS, RAREST

    assert float(collect_select._DEFAULT_BALANCE) == RAREST
    assert collect_select._DEFAULT_MOST_ACTIONS == MOST_ACTIONS


def test_bad_input_is_told_in_a_line(run: Path, collected: Path, tmp_path: Path) -> None:
    def select(*more: object) -> str:
        out = tmp_path / "out"
        told = refusal("collect", "--out", out, *more)
        assert not list(out.glob("*.json"))
        return told

    def other(name: str, **changes: Any) -> Path:
        """The run, with another manifest and without episodes."""
        path = tmp_path / name
        (path / "episodes").mkdir(parents=True)
        manifest: dict[str, Any] = json.loads((run / "run.json").read_text())
        env: Mapping[str, Any] = {**manifest["env"], **changes.pop("env", {})}
        (path / "run.json").write_text(json.dumps({**manifest, "env": env, **changes}))
        return path

    assert "is no run: " in select("--select", collected)
    assert "no episode can be taken (none of these tasks)" in select("--select", other("empty"))
    assert "other tasks than those of mini" in select(
        "--select", other("suite", suite_digest="0" * 64)
    )
    assert "with the tasks of mine, which are not found by that name" in select(
        "--select", other("of-a-file", suite="mine")
    )
    unity = other("unity", env={"backend": "unity"})
    assert "does not repeat itself exactly" in select("--select", unity)
    assert "was played with backend 'unity'" in select("--select", run, "--select", unity)
    explore = other("explore", env={"instances": "explore"})
    assert "was played with instances 'explore'" in select("--select", run, "--select", explore)
    strange = other("strange", suite="er-1k", suite_digest="1" * 64)
    assert "was played with the tasks of er-1k" in select("--select", run, "--select", strange)
    nothing = tmp_path / "nothing"
    table = done("collect", "--select", other("bare"), "--out", nothing, "--allow-empty")
    assert "What became of the samples" in table
    assert (nothing / "trajectories.jsonl").read_bytes() == b""
    assert "is given twice" in select("--select", run, "--select", run)
    assert "--correct does not go with --select" in select("--select", run, "--correct", run)
    assert "--kinds does not go with --select" in select("--select", run, "--kinds", "a")
    assert "give that, too" in select("--select", run, "--recipe", "paper")
    assert "--balance is for --select RUN" in select("--suite", "mini", "--balance", "none")
    assert "x too long" in select("--select", run, "--most-actions", "1")
    assert "give a factor from 1, recipe or none" in select("--select", run, "--balance", "0")
