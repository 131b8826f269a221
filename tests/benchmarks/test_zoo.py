"""``er-gym zoo``: lists, shows and adds models; figures are read from runs."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("sb3_contrib", reason="needs the extra rl")

from episodes_by_hand import make_episode
from untrained_policy import write_untrained_run

from agents import packing
from agents.rl.config import config_file, load_config
from agents.zoo import index
from agents.zoo.card import Card, read_card
from benchmarks.cli.zoo import DTYPES
from er_gym.rollout.events import EventLog, RunBegun
from er_gym.rollout.run_directory import Manifest, RunDirectory
from er_gym.rollout.selection import select
from er_gym.tasks.suites import load_suite
from er_gym.tasks.task import Task

Command = Callable[..., tuple[int, str, str]]
MINI = load_suite("mini")
TITLE = ("--title", "Walks about")


@pytest.fixture
def models(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty zoo."""
    monkeypatch.setattr(index, "FOLDER", tmp_path / "models")
    return tmp_path / "models"


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("policy") / "run"
    write_untrained_run(load_config(config_file("single_search")), path)
    return path


def played(
    path: Path,
    agent: str,
    tasks: Sequence[Task],
    env: dict[str, Any] | None = None,
    won: int = 1,
    **changes: Any,
) -> Path:
    """The run directory of an agent that has played tasks of the suite, the first ones with
    success."""
    told = {
        "suite": "mini", "suite_digest": MINI.digest, "suite_size": len(MINI.tasks),
        "agent": agent, "seed": 0, "er_gym": "0.1.0",
        "env": {"backend": "embedded", **MINI.env, "obs_mode": "state", **(env or {})},
    }  # fmt: skip
    run = RunDirectory.create(path, Manifest.model_validate({**told, **changes}))
    log = EventLog(path)
    log(RunBegun(time=86_400.0, suite="mini", agent=agent, tasks=len(tasks), done=0))
    log.close()
    for number, task in enumerate(tasks):
        steps = ("pickup Egg", "end") if number < won else ("end",)
        keys = ("pickup Egg", "end")
        run.write(make_episode(keys, steps, task_id=task.id, task_type=task.type.name))
    return path


PICKUPS = [task for task in MINI.tasks if task.type.name == "single_pickup"]


def added(models: Path, name: str = "walker") -> Card:
    return read_card(models / name / "card.yaml")


def test_an_empty_zoo_says_so(er_gym: Command, models: Path) -> None:
    assert er_gym("zoo")[0] == 0
    code, shown, err = er_gym("zoo", "walker")
    assert (code, shown) == (2, "")
    assert "there is no model 'walker' in the zoo; give one of: none" in err


def test_a_model_is_added_measured_listed_and_shown(
    er_gym: Command, models: Path, trained: Path, tmp_path: Path
) -> None:
    add = ("zoo", "add", trained, "--name", "walker", *TITLE, "--into", models)
    code, shown, err = er_gym(*add)
    assert (code, err) == (0, "")
    assert re.search(r"models/walker: \d\d kB, 38,634 parameters", shown)
    assert not added(models).figures
    assert "walker  Walks about" in er_gym("zoo")[1]
    run = played(tmp_path / "run", "zoo:walker", PICKUPS, {"instances": "explore"}, won=2)
    assert er_gym(*add, "--figures", run)[0] == 0
    (figure,) = added(models).figures
    assert figure.options == "--types single_pickup --instances explore"
    assert (figure.suite, figure.played_by, str(figure.date)) == (
        "mini",
        "zoo:walker",
        "1970-01-02",
    )
    n = len(PICKUPS)
    assert (figure.success.successes, figure.success.n) == (2, n)
    assert figure.success.percent == pytest.approx(200 / n, abs=0.05)
    assert figure.success.low < figure.success.percent < figure.success.high
    assert figure.groups == {"Manipulate": figure.success}
    listed, card = er_gym("zoo")[1], er_gym("zoo", "walker")[1]
    assert f"{figure.success.percent:.1f}  {figure.success.low:.1f} to" in listed
    for words in (
        "walker: Walks about",
        "er-gym bench --suite mini --types single_pickup --instances explore --agent zoo:walker",
        "er-gym train-rl --config single_search --seed 0",
        "pip install 'er-gym[rl]'",
        "Apache-2.0",
    ):
        assert words in card
    assert "| walker | Walks about | rl | mini --types" in er_gym("zoo", "--format", "md")[1]


def test_a_model_of_the_package_plays_in_a_run(er_gym: Command, tmp_path: Path) -> None:
    out = tmp_path / "run"
    bench = ("bench", "--suite", "mini", "--types", "single_search", "--limit", "1")
    assert er_gym(*bench, "--agent", "zoo:single-search", "--out", out)[0] == 0
    run = RunDirectory.open(out)
    assert run.manifest.agent == "zoo:single-search"
    assert [each.agent for each in run.episodes()] == ["zoo:single-search"]


def test_figures_of_other_weights_are_refused(
    er_gym: Command, models: Path, trained: Path, tmp_path: Path
) -> None:
    add = ("zoo", "add", trained, "--name", "walker", *TITLE, "--into", models)
    run = played(tmp_path / "run", "zoo:walker", PICKUPS)
    assert er_gym(*add)[0] == 0
    code, _, err = er_gym(*add, "--figures", run, "--dtype", "bfloat16")
    assert code == 2
    assert "had other files than" in err
    assert added(models).dtype == "float16"
    own = played(tmp_path / "own", f"rl:{trained}", PICKUPS)
    assert er_gym(*add, "--figures", own, "--dtype", "bfloat16")[0] == 0
    assert [each.played_by for each in added(models).figures] == ["run"]
    assert "played with the training run's weights" in er_gym("zoo", "walker")[1]


WAYS: dict[str, tuple[list[Task], dict[str, Any], str]] = {
    "all": (list(MINI.tasks), {}, ""),
    "the first": (list(MINI.tasks[:5]), {}, "--limit 5"),
    "spread": (select(MINI.tasks, limit=5, spread=True), {}, "--limit 5 --spread"),
    "some types, spread": (
        select(MINI.tasks, types=["single_pickup", "single_search"], limit=5, spread=True),
        {},
        "--types single_pickup,single_search --limit 5 --spread",
    ),
    "faults": (list(MINI.tasks), {"faults": 0.1}, "--faults 0.1"),
    "some faults": (
        PICKUPS, {"faults": {"open": 0.25}}, "--types single_pickup --faults open=0.25",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("tasks", "env", "options"), WAYS.values(), ids=WAYS)
def test_the_options_of_a_run_are_found(
    trained: Path, tmp_path: Path, tasks: list[Task], env: dict[str, Any], options: str
) -> None:
    from benchmarks.cli.zoo_figures import figure_of
    from benchmarks.scoring.report import load_run

    run = load_run(played(tmp_path / "run", f"rl:{trained}", tasks, env))
    assert figure_of(run, "walker", trained).options == options


def test_fresh_tasks_give_a_figure(
    trained: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, repository: Path
) -> None:
    from benchmarks.cli.zoo_figures import figure_of
    from benchmarks.scoring.report import load_run

    monkeypatch.setenv("ER_GYM_HOME", str(tmp_path / "home"))
    (tmp_path / "home" / "suites").mkdir(parents=True)
    mini = repository / "er_gym" / "tasks" / "data" / "mini.jsonl.gz"
    shutil.copy(mini, tmp_path / "home" / "suites" / "mini-fresh-5.jsonl.gz")
    name, faults = "mini-fresh-5", {"faults": 0.1}
    run = load_run(played(tmp_path / "a", f"rl:{trained}", PICKUPS, faults, suite=name))
    figure = figure_of(run, "walker", trained)
    told = (figure.suite, figure.options)
    assert told == ("mini", "--fresh 5 --types single_pickup --faults 0.1")
    other = played(tmp_path / "b", f"rl:{trained}", PICKUPS, suite=name, suite_digest="abc")
    with pytest.raises(ValueError, match="other tasks than the suite mini-fresh-5 has now"):
        figure_of(load_run(other), "walker", trained)


WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "another agent": ({"agent": "random"}, "was played by random, not by"),
    "another model": ({"agent": "zoo:runner"}, "was played by zoo:runner, not by"),
    "another suite": ({"suite": "mine"}, "plays mine, which does not come with er-gym"),
    "fresh tasks of another suite": ({"suite": "mine-fresh-5"}, "or of their fresh tasks"),
    "other tasks": ({"suite_digest": "abc"}, "other tasks than the suite mini has now"),
    "another room": ({"env": {"grid_size": 0.5}}, "played with grid_size 0.5, and mini has"),
    "picked tasks": ({"tasks": PICKUPS[1:3]}, "neither all, nor all of some types"),
    "nothing": ({"tasks": []}, "has 0 episodes"),
}


@pytest.mark.parametrize(("changes", "message"), WRONG.values(), ids=WRONG)
def test_a_run_that_gives_no_figure(
    er_gym: Command,
    models: Path,
    trained: Path,
    tmp_path: Path,
    changes: dict[str, Any],
    message: str,
) -> None:
    told = {"agent": f"rl:{trained}", "tasks": PICKUPS, **changes}
    run = played(tmp_path / "run", **told)
    code, _, err = er_gym(
        "zoo", "add", trained, "--name", "walker", *TITLE, "--into", models, "--figures", run
    )
    assert code == 2
    assert message in err
    assert err.count("\n") == 1
    assert not list(models.glob("*"))


@pytest.mark.parametrize("name", ["add", "Walker", "a/b", "..", "", "a_b"])
def test_a_bad_name(er_gym: Command, models: Path, trained: Path, name: str) -> None:
    code, _, err = er_gym("zoo", "add", trained, "--name", name, *TITLE)
    assert code == 2
    assert "is no name for a model; give lower-case letters" in err
    assert not models.exists()


def test_a_model_too_many(
    er_gym: Command, models: Path, trained: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(packing, "MOST_BYTES", 100_000)
    add = ("zoo", "add", trained, *TITLE, "--into", models, "--name")
    assert er_gym(*add, "one")[0] == 0
    code, _, err = er_gym(*add, "two")
    assert code == 2
    assert "and 100,000 are allowed: one 79," in err
    assert [folder.name for folder in models.iterdir()] == ["one"]


def test_the_options_name_the_types_of_weights() -> None:
    assert tuple(packing.DTYPES) == DTYPES


def test_a_language_model_takes_over_the_settings_that_it_was_measured_with(
    er_gym: Command, models: Path, tmp_path: Path
) -> None:
    pytest.importorskip("transformers", reason="needs the extra local")
    from agents.factory import load_settings
    from agents.finetune.architecture import load_architecture
    from agents.finetune.new_model import make_model

    tiny = ["vocabulary=256", "text.hidden_size=32", "text.num_hidden_layers=1"]
    made = make_model(load_architecture("tiny-text", tiny), (), tmp_path / "model")
    (made / "agent.yaml").write_text("sees: text\n")
    bench = ("bench", "--suite", "mini", "--limit", "2", "--set", "local.device_map=cpu")
    short = ("--set", "sampling.max_tokens=6")
    assert er_gym(*bench, *short, "--agent", f"hf:{made}", "--out", tmp_path / "run")[0] == 0
    add = ("zoo", "add", made, "--name", "talker", *TITLE, "--into", models)
    code, _, err = er_gym(*add, "--figures", tmp_path / "run")
    assert code == 2
    assert "does not say which command made it; give each with --made-by" in err
    add = (*add, "--made-by", "er-gym new-model tiny-text")
    assert er_gym(*add, "--figures", tmp_path / "run")[0] == 0
    card = added(models, "talker")
    assert (card.kind, card.dtype) == ("language model", "float16")
    assert [each.options for each in card.figures] == ["--limit 2"]
    settings = load_settings(None, (), models / "talker" / "agent.yaml")
    assert (settings.sees, settings.sampling.max_tokens) == ("text", 6)

    again = tmp_path / "again"
    assert er_gym(*bench, "--agent", "zoo:talker", "--out", again)[0] == 0
    one, other = (RunDirectory.open(tmp_path / each) for each in ("run", "again"))
    assert one.manifest.agent_settings == other.manifest.agent_settings
    assert other.manifest.agent == "zoo:talker"
    # A run with other settings than those of the model is no figure of it.
    longer = tmp_path / "longer"
    told = (*bench, "--set", "sampling.max_tokens=7", "--agent", "zoo:talker", "--out", longer)
    assert er_gym(*told)[0] == 0
    code, _, err = er_gym(*add, "--figures", again, "--figures", longer)
    assert code == 2
    assert "were played with different settings" in err
