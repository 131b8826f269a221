"""What the pages say of a training run: its curves, its settings and how far it has come."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from benchmarks.monitor.charts import as_svg
from benchmarks.monitor.curve_tail import CurveTail, last_line
from benchmarks.monitor.directories import Directory
from benchmarks.monitor.fingerprint import changed, in_use
from benchmarks.monitor.followed import Followed
from benchmarks.monitor.language import Translator
from benchmarks.scoring.series import Axis, Chart, Series
from er_gym.tasks.errors import TaskFileError
from er_gym.tasks.reading import parse_json, read_text, read_yaml

_FRESH_SECONDS = 120.0
"""A log that grew so lately is taken to be growing, whoever writes it."""
_MOST_KEPT = 32
"""The curves of no more runs are kept."""
CURVED = ("policy", "finetuning", "reinforcement")
"""The kinds of directories that have curves."""
_OVER = {"policy": "steps", "finetuning": "update", "reinforcement": "update"}
_LOG = {
    "policy": "curve.jsonl",
    "finetuning": "metrics.jsonl",
    "reinforcement": "metrics.jsonl",
}
_MANIFESTS = {
    "finetuning": ("finetune.json", ("model", "data", "settings")),
    "reinforcement": ("reinforce.json", ("model", "suite", "settings")),
}
"""The file of a run of each kind that says what is made, and what of it a page shows."""
_REWARD = "reward/"
"""What the names of rewards begin with."""
_TYPES = "success/"
"""What the names of figures by task type begin with."""


@dataclass(frozen=True)
class Trained:
    """A training run at a moment.

    Attributes:
        directory: where it is.
        state: ``running``, ``finished``, ``stopped`` or ``waiting``.
        done, wanted: steps or updates; ``wanted`` is None where it cannot be known.
        last: of each figure the last value.
        settings: as the run was given them; "" if they cannot be read.
        problem: why they cannot be.
        about: facts of its settings that a list shows, such as the algorithm.
        changed: when it changed last, seconds since the epoch.
    """

    directory: Directory
    state: str
    done: int
    wanted: int | None
    last: Mapping[str, Any]
    settings: str
    problem: str
    about: str
    changed: float

    @property
    def share(self) -> float | None:
        """How much of it is done, as a fraction; None if unknown."""
        return min(1.0, self.done / self.wanted) if self.wanted else None

    @property
    def types(self) -> Sequence[tuple[str, float]]:
        """The last success for each task type, as a fraction."""
        return [(k.removeprefix(_TYPES), v) for k, v in self.last.items() if k.startswith(_TYPES)]


def trained(directory: Directory, last: Mapping[str, Any] | None = None) -> Trained:
    """A training run of the kind ``policy``, ``finetuning`` or ``reinforcement``.

    Args:
        directory: where it is.
        last: of each figure the last value; None to look them up in the last line of the log.
    """
    last = last_line(directory.path / _LOG[directory.kind]) if last is None else last
    done = last.get(_OVER[directory.kind], 0)
    done = int(done) if isinstance(done, (int, float)) else 0
    settings, problem = _settings(directory)
    wanted, about = _told(directory, settings, done, last)
    finished = (
        done >= wanted
        if directory.kind == "policy" and wanted
        else (directory.path / "model").is_dir()
    )
    state = _state(directory, done, bool(finished))
    return Trained(
        directory=directory,
        state=state,
        done=done,
        wanted=done if state == "finished" and directory.kind == "finetuning" else wanted,
        last=last,
        settings=yaml.safe_dump(settings, allow_unicode=True, sort_keys=False) if settings else "",
        problem=problem,
        about=about,
        changed=changed(directory),
    )


def _state(directory: Directory, done: int, finished: bool) -> str:
    if in_use(directory.path):
        return "running"
    if finished:
        return "finished"
    if done and time.time() - _written(directory.path / _LOG[directory.kind]) < _FRESH_SECONDS:
        return "running"
    return "stopped" if done else "waiting"


def _written(file: Path) -> float:
    try:
        return file.stat().st_mtime
    except OSError:
        return 0.0


def _settings(directory: Directory) -> tuple[dict[str, Any], str]:
    """The settings, and why they cannot be read."""
    try:
        if directory.kind == "policy":
            told = read_yaml(directory.path / "config.yaml")
        else:
            name, shown = _MANIFESTS[directory.kind]
            file = directory.path / name
            told = parse_json(read_text(file), file)
            if isinstance(told, dict):
                told = {key: told.get(key) for key in shown}
    except (TaskFileError, ValueError, OSError) as error:
        return {}, str(error).splitlines()[0]
    return (told, "") if isinstance(told, dict) else ({}, "its settings are no mapping")


def _told(
    directory: Directory, settings: Mapping[str, Any], done: int, last: Mapping[str, Any]
) -> tuple[int | None, str]:
    """How many steps or updates are wanted, and what a list says of the run."""
    try:
        if directory.kind == "policy":
            name = str(settings["algorithm"]["name"])
            types = ", ".join(map(str, settings["env"]["types"]))
            return int(settings["total_steps"]), " · ".join(filter(None, (name, types)))
        if directory.kind == "reinforcement":
            chosen = settings["settings"]
            return int(chosen["training"]["updates"]), str(chosen["advantage"]["row"])
        epochs = float(settings["settings"]["training"]["epochs"])
        stage = str(settings["settings"]["stage"] or "")
        epoch = float(last.get("epoch") or 0.0)
        return (round(done * max(epochs / epoch, 1.0)) if epoch else None), stage
    except (KeyError, TypeError, ValueError, OverflowError):
        return None, ""


def policy_charts(tail: CurveTail, t: Translator) -> list[tuple[str, Any]]:
    """The charts of a policy, each with its title."""
    steps = Axis(t("environment_steps"), low=0.0)
    success = [
        Series(t("while_training"), tail.points("rollout/success_rate", 100)),
        Series(t("evaluation"), tail.points("eval/success_rate", 100)),
    ]
    returns = [
        Series(t("while_training"), tail.points("rollout/ep_rew_mean")),
        Series(t("evaluation"), tail.points("eval/mean_reward")),
    ]
    wanted = (
        ("success", t("success"), Axis("%", 0.0, 100.0), success),
        ("return", t("return"), Axis(""), returns),
        ("length", t("episode_length"), Axis(t("steps"), low=0.0),
         [Series(t("while_training"), tail.points("rollout/ep_len_mean")),
          Series(t("evaluation"), tail.points("eval/mean_ep_length"))]),
        ("loss", t("value_loss"), Axis(""), [Series(t("value_loss"), tail.points("train/value_loss")
                                                    or tail.points("train/loss"))]),
        ("entropy", t("entropy"), Axis(""),
         [Series(t("entropy"), [point._replace(y=-point.y, low=-point.high, high=-point.low)
                                for point in tail.points("train/entropy_loss")])]),
        ("speed", t("steps_per_second"), Axis("", low=0.0),
         [Series(t("steps_per_second"), tail.points("time/fps"))]),
    )  # fmt: skip
    drawn = [
        (title, as_svg(name, Chart(title, steps, y, lines))) for name, title, y, lines in wanted
    ]
    return [(title, picture) for title, picture in drawn if picture]


def finetuning_charts(tail: CurveTail, t: Translator) -> list[tuple[str, Any]]:
    """The charts of a fine-tuning, each with its title."""
    updates = Axis(t("updates"), low=0.0)
    wanted = (
        ("loss", Axis("", log=True)),
        ("learning_rate", Axis("", low=0.0)),
        ("tokens_per_second", Axis("", low=0.0)),
        ("gradient_norm", Axis("", low=0.0)),
    )
    drawn = [
        (t(name), as_svg(name, Chart(t(name), updates, y, [Series(t(name), tail.points(name))])))
        for name, y in wanted
    ]
    return [(title, picture) for title, picture in drawn if picture]


def reinforcement_charts(tail: CurveTail, t: Translator) -> list[tuple[str, Any]]:
    """The charts of a reinforcement, each with its title."""
    updates = Axis(t("updates"), low=0.0)
    success = [
        Series(t("while_training"), tail.points("success", 100)),
        Series(t("evaluation"), tail.points("validation/success", 100)),
    ]
    rewards = [Series(t("reward"), tail.points("reward"))] + [
        Series(name.removeprefix(_REWARD), tail.points(name))
        for name in tail.series
        if name.startswith(_REWARD)
    ]
    wanted = (
        ("success", Axis("%", 0.0, 100.0), success),
        ("reward", Axis(""), rewards),
        ("episode_length", Axis(t("steps"), low=0.0),
         [Series(t("episode_length"), tail.points("turns"))]),
        *((name, Axis("", low=0.0), [Series(t(name), tail.points(name))])
          for name in ("entropy", "kl", "clipped", "gradient_norm", "learning_rate")),
    )  # fmt: skip
    drawn = [(t(name), as_svg(name, Chart(t(name), updates, y, lines)))
             for name, y, lines in wanted]  # fmt: skip
    return [(title, picture) for title, picture in drawn if picture]


def over_of(directory: Directory) -> str:
    """The key of the words for what a training's curves are drawn over."""
    return "environment_steps" if directory.kind == "policy" else "updates"


def curves() -> Followed[CurveTail]:
    """The curves of the runs that were looked at last."""
    return Followed(
        lambda directory: CurveTail(directory.path / _LOG[directory.kind], _OVER[directory.kind]),
        _MOST_KEPT,
    )
