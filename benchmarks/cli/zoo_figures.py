"""The figures of a model of the zoo, read from run directories of ``er-gym bench``."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import yaml

from agents.factory import comparable_settings, load_settings
from agents.vlm.prompts import prompts_for
from agents.vlm.tuned_model import AGENT
from agents.zoo.card import Figure, Rate
from agents.zoo.index import PLAYERS, PREFIX
from benchmarks.cli.suites import fresh_suite
from benchmarks.leaderboard.months import fresh_of
from benchmarks.scoring.metrics import Summary
from benchmarks.scoring.report import RunReport, by_group, slices
from benchmarks.scoring.scorers import CORRECTED
from er_gym.envs.protocol import DEFAULT
from er_gym.rollout.events import read_events
from er_gym.rollout.selection import select
from er_gym.tasks.suites import Suite, load_suite, suite_names
from er_gym.writing import YAML_MARK, write_atomic

RUN = "run"
"""The player of a figure that was measured with the training run's weights."""
_NOT_COMPARED = ("obs_mode", "instances", "faults", "protocol")
"""Arguments of the environment that the agent or an option of the command states."""


def figure_of(report: RunReport, name: str, source: Path) -> Figure:
    """The figure that a run gives.

    Args:
        report: the run.
        name: of the model in the zoo.
        source: the directory from which the model is packed.

    Raises:
        ValueError: another agent played, an episode crashed or is missing, or the command line
            cannot say which tasks were played.
        BadInput, click.exceptions.Exit: fresh tasks that are no longer there cannot be made again.
    """
    scores = report.scores[CORRECTED.name]
    if report.crashed or report.unusable or not scores:
        raise ValueError(
            f"{report.path} has {len(scores)} episodes, of which {report.crashed} crashed, and "
            f"{len(report.unusable)} files that are none; give a whole run: the same command of "
            "er-gym bench plays what is missing"
        )
    played_by = _player(report, name, source)
    suite_name, fresh, suite = _suite(report)
    ended = max((event.time for event in read_events(report.path)), default=0.0)
    return Figure(
        suite=suite_name,
        options=shlex.join([*fresh, *_tasks(report, suite), *_rules(report, suite)]),
        played_by=played_by,
        date=datetime.fromtimestamp(ended, timezone.utc).date(),
        er_gym=report.manifest.er_gym,
        success=_rate(slices(scores)[0][2]),
        groups={group: _rate(summary) for group, summary in by_group(scores).items()},
    )


def _rate(summary: Summary) -> Rate:
    success = summary["success"]
    assert success.low is not None
    assert success.high is not None
    return Rate(
        n=summary.n,
        successes=round(success.mean * summary.n),
        percent=round(100 * success.mean, 1),
        low=round(100 * success.low, 1),
        high=round(100 * success.high, 1),
    )


def _player(report: RunReport, name: str, source: Path) -> str:
    """Who played: the model of the zoo, or the run that it is packed from."""
    agent = report.manifest.agent
    if agent == f"{PREFIX}{name}":
        return agent
    for player in PLAYERS.values():
        played = Path(agent.removeprefix(player.prefix)).resolve()
        if agent.startswith(player.prefix) and source.resolve() in (played, played.parent):
            return RUN
    raise ValueError(
        f"{report.path} was played by {agent}, not by {source} or {PREFIX}{name}; give runs of "
        "this model"
    )


def _suite(report: RunReport) -> tuple[str, list[str], Suite]:
    """The name of the suite that was played, the option that makes its tasks anew, and the tasks.

    Fresh tasks that are no longer there are made again.
    """
    manifest = report.manifest
    name, seed = fresh_of(manifest.suite) or (manifest.suite, None)
    if name not in suite_names():
        raise ValueError(
            f"{report.path} plays {manifest.suite}, which does not come with er-gym; give runs of "
            f"{', '.join(suite_names())}, or of their fresh tasks"
        )
    suite = load_suite(name) if seed is None else fresh_suite(name, seed, workers=1)
    if suite.digest != manifest.suite_digest:
        raise ValueError(
            f"{report.path} was played with other tasks than the suite {suite.name} has now; "
            "play it again"
        )
    return name, [] if seed is None else ["--fresh", str(seed)], suite


def _tasks(report: RunReport, suite: Suite) -> list[str]:
    """The options that choose the tasks that were played."""
    played = [episode.task_id for episode in report.episodes]
    types = sorted({episode.task_type for episode in report.episodes})
    number = len(played)
    ways: list[tuple[list[str], dict[str, Any]]] = [
        ([], {}),
        (["--types", ",".join(types)], {"types": types}),
        (["--limit", str(number)], {"limit": number}),
        (["--limit", str(number), "--spread"], {"limit": number, "spread": True}),
        (
            ["--types", ",".join(types), "--limit", str(number), "--spread"],
            {"types": types, "limit": number, "spread": True},
        ),
    ]
    for options, selection in ways:
        chosen = [task.id for task in select(suite.tasks, **selection)]
        if sorted(played) == sorted(chosen):
            return options
    raise ValueError(
        f"{report.path} has {number} episodes of {len(suite.tasks)} tasks, which are neither all, "
        "nor all of some types, nor those of --limit; play each task once, and chosen so"
    )


def _rules(report: RunReport, suite: Suite) -> list[str]:
    """The options that say by which rules they were played."""
    env, manifest = report.manifest.env, report.manifest
    others = {"backend": "embedded", **suite.env}
    for key in (others.keys() | env.keys()) - {*_NOT_COMPARED, "width", "height"}:
        if env.get(key) != others.get(key):
            raise ValueError(
                f"{report.path} was played with {key} {env.get(key)!r}, and {suite.name} has "
                f"{others.get(key)!r}; play it as the suite says"
            )
    found = []
    if env.get("instances") != suite.env.get("instances"):
        found += ["--instances", str(env["instances"])]
    if faults := env.get("faults"):
        told = faults if isinstance(faults, Mapping) else {"": faults}
        found += ["--faults", ",".join(f"{k}={v:g}" if k else f"{v:g}" for k, v in told.items())]
    if manifest.protocol != DEFAULT.name:
        found += ["--protocol", manifest.protocol]
    if manifest.seed:
        found += ["--seed", str(manifest.seed)]
    return found


def take_over_settings(reports: Sequence[RunReport], folder: Path) -> None:
    """Let a language model's folder state the settings with which its runs were played.

    Raises:
        ValueError: the runs have different settings, or no settings make the model play as it did.
    """
    if not reports:
        return
    report, *others = reports
    for other in others:
        if other.manifest.agent_settings != report.manifest.agent_settings:
            raise ValueError(
                f"{report.path} and {other.path} were played with different settings; "
                "play all runs of a model with the same"
            )
    wanted = report.manifest.agent_settings
    file = folder / AGENT
    beneath = file if file.is_file() else None
    now = load_settings(None, (), beneath)
    differ = [
        f"{path}={yaml.safe_dump(value, default_flow_style=True).splitlines()[0]}"
        for path, value in _differences(comparable_settings(now, ""), wanted)
        if path != "prompts_digest"
    ]
    tuned = load_settings(None, differ, beneath)
    if comparable_settings(tuned, prompts_for(tuned).digest) != wanted:
        raise ValueError(
            f"{report.path} was played with other prompts than {folder.name} has now; play it again"
        )
    if differ:
        told = tuned.model_dump(mode="json", exclude_defaults=True)
        write_atomic(file, YAML_MARK + yaml.safe_dump(told, sort_keys=False, allow_unicode=True))


def _differences(
    one: Mapping[str, Any], other: Mapping[str, Any], path: str = ""
) -> list[tuple[str, Any]]:
    """The fields of the other table, by their paths, that differ in the one."""
    found: list[tuple[str, Any]] = []
    for name, value in other.items():
        mine = one.get(name)
        if isinstance(value, Mapping) and isinstance(mine, Mapping):
            found += _differences(mine, value, f"{path}{name}.")
        elif value != mine:
            found.append((f"{path}{name}", value))
    return found
