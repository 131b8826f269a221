"""The columns of the leaderboard: what each says of a submission."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from benchmarks.leaderboard.checking import Checked
from benchmarks.leaderboard.record_checks import HUMAN
from benchmarks.leaderboard.submission import Header
from benchmarks.scoring.metrics import (
    SIDE_EFFECTS,
    TIDY,
    Estimate,
    Score,
    Summary,
    success_rate,
)
from benchmarks.scoring.scorers import CORRECTED
from benchmarks.scoring.splits import SPLITS, STRICT, splits_of_episode
from er_gym.rollout.records import EpisodeRecord
from er_gym.tasks.types import GROUPS

NEW = (*SPLITS[1:], STRICT)
"""The parts of a suite that have a column: what no training has seen."""
REFERENCE, SCRIPT, ZOO, PERSON, SUBMITTED = "reference", "script", "zoo", "person", "agent"
"""The kinds of rows."""
_OWN = {
    "do-nothing": (REFERENCE, "looks about, and does nothing"),
    "always-end": (REFERENCE, "says at once that it is done"),
    "random": (REFERENCE, "legal actions at random"),
    "oracle": (REFERENCE, "knows the key actions of each task"),
    "searcher": (SCRIPT, "reads the instruction, and looks where such things usually are"),
    "spotter": (SCRIPT, "the searcher, which also goes by where it sees things from afar"),
    "mask-reader": (SCRIPT, "reads the instruction and the lists of legal actions"),
    HUMAN: (PERSON, "played by hand"),
}


@dataclass(frozen=True)
class Cell:
    """A cell of the page.

    Attributes:
        text: what is shown.
        value: by which it is sorted; None for words, which are sorted as such.
        more: a second line.
    """

    text: str
    value: float | None = None
    more: str = ""


NOTHING = Cell("-")
"""What a submission does not have."""


@dataclass(frozen=True)
class Facts:
    """What the cells of a submission are made of.

    Attributes:
        header: the submission's.
        checked: its check.
        scores: of its episodes, by the corrected scorer.
        summary: of these.
    """

    header: Header
    checked: Checked
    scores: tuple[Score, ...]
    summary: Summary

    @property
    def env(self) -> Mapping[str, Any]:
        """The arguments of the environment."""
        return self.header.manifest.env

    def part(self, belongs: Callable[[EpisodeRecord, Score], bool]) -> Cell:
        """The success in a part of the episodes, and their number."""
        both = zip(self.checked.episodes, self.scores, strict=True)
        scores = [score for episode, score in both if belongs(episode, score)]
        if not scores:
            return NOTHING
        rate = success_rate([each.task_id for each in scores], [each.success for each in scores])
        return Cell(f"{100 * rate.mean:.1f} ({len(scores)})", 100 * rate.mean)

    def for_each_solved(self, total: float, form: str) -> Cell:
        """A cost by the number of successes."""
        solved = sum(each.success for each in self.scores)
        return _number(total / solved if solved and total else None, form)


# -- columns ---------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Column:
    """A column of the board.

    Attributes:
        title: its head.
        about: what it says, in words.
        cell: that of a submission.
        words: whether it holds words.
    """

    title: str
    about: str
    cell: Callable[[Facts], Cell]
    words: bool = False


def _agent(facts: Facts) -> Cell:
    spec, name = facts.header.manifest.agent, facts.header.name
    return Cell(name, more=_OWN[spec][1] if spec in _OWN else "" if name == spec else spec)


def kind_of(facts: Facts) -> str:
    """Of which kind the agent is."""
    spec = facts.header.manifest.agent
    if spec in _OWN:
        return _OWN[spec][0]
    return ZOO if spec.startswith("zoo:") else SUBMITTED


def _interval(facts: Facts) -> Cell:
    success = facts.summary["success"]
    low, high = 100 * (success.low or 0), 100 * (success.high or 0)
    return Cell(f"{low:.1f} to {high:.1f}", low)


def _group(name: str) -> Column:
    about = f"Success in the group {name}, and the number of episodes."
    return Column(f"{name}, %", about, lambda facts: facts.part(lambda _, each: each.group == name))


def _new(name: str) -> Column:
    about = f"Success in the part “{name}”, which no training has, and the number of episodes."
    return Column(
        f"{name.capitalize()}, %",
        about,
        lambda facts: facts.part(lambda episode, _: name in splits_of_episode(episode)),
    )


def _steps(facts: Facts) -> Cell:
    total = sum(each.num_steps - 1 for each in facts.checked.episodes)
    return _number(total / len(facts.scores), "{:.1f}")


def _tokens(facts: Facts) -> Cell:
    costs = facts.header.costs
    return facts.for_each_solved(costs.prompt_tokens + costs.completion_tokens, "{:,.0f}")


def _tasks(facts: Facts) -> Cell:
    tasks = len({each.task_id for each in facts.checked.episodes})
    samples = len(facts.checked.episodes) // tasks
    return Cell(
        f"{tasks:,} of {facts.header.manifest.suite_size:,}",
        tasks,
        f"{samples} times each" * (samples > 1),
    )


def _faults(facts: Facts) -> Cell:
    faults = facts.env.get("faults", 0)
    if isinstance(faults, Mapping):
        return Cell(", ".join(f"{name} {rate:g}" for name, rate in faults.items()))
    return Cell(f"{faults:g}") if isinstance(faults, float | int) and faults else NOTHING


def _replayed(facts: Facts) -> Cell:
    if not facts.checked.replayed:
        return Cell("no")
    return Cell(f"{facts.checked.replayed:,}{', not the pictures' * bool(facts.checked.notes)}")


def _percent(estimate: Estimate | None) -> Cell:
    return _number(None if estimate is None else 100 * estimate.mean, "{:.1f}")


def _number(value: float | None, form: str) -> Cell:
    return NOTHING if value is None else Cell(form.format(value), value)


SUCCESS = "Success, %"
COLUMNS = (
    Column("Agent", "Its name, and what it is.", _agent, words=True),
    Column(
        "Kind",
        f"{REFERENCE}: shows what figures are worth, and competes with none; {SCRIPT}: has not "
        f"learnt; {ZOO}: a small model that comes with er-gym; {PERSON}: played by hand; "
        f"{SUBMITTED}: any other.",
        lambda facts: Cell(kind_of(facts)),
        words=True,
    ),
    Column(
        SUCCESS,
        f"Episodes that did their task, by version {CORRECTED.version} of the {CORRECTED.name} "
        "scorer.",
        lambda facts: _percent(facts.summary["success"]),
    ),
    Column("95 %", "Wilson's interval of success; sorted by its lower end.", _interval),
    Column(
        "Tidy success, %",
        "Successes that changed nothing in the room that the task did not ask for.",
        lambda facts: _percent(facts.summary.get(TIDY)),
    ),
    *map(_group, GROUPS),
    *map(_new, NEW),
    Column(
        "Side effects",
        "Objects that an episode changed and its task did not ask for, on average.",
        lambda facts: _number(
            None if (told := facts.summary.get(SIDE_EFFECTS)) is None else told.mean, "{:.2f}"
        ),
    ),
    Column(
        "Search efficiency, %",
        "The task's key actions by the steps taken, in a success; 0 in a failure.",
        lambda facts: _percent(facts.summary["search_efficiency"]),
    ),
    Column(
        "Completeness, %",
        "The share of a task's key actions that were done.",
        lambda facts: _percent(facts.summary["completeness"]),
    ),
    Column("Steps", "Of an episode, on average.", _steps),
    Column(
        "US$ per solved task",
        "The submitter's word.",
        lambda facts: facts.for_each_solved(facts.header.costs.usd, "{:.4f}"),
    ),
    Column("Tokens per solved task", "Read and written; the submitter's word.", _tokens),
    Column("Tasks", "How many of the suite's were played.", _tasks),
    Column(
        "Sees",
        "The observation that the agent was given.",
        lambda facts: Cell(str(facts.env.get("obs_mode", "")) or "-"),
        words=True,
    ),
    Column("Faults", "The rate at which the environment made actions fail.", _faults, words=True),
    Column("By", "Who submitted.", lambda facts: Cell(facts.header.by or "-"), words=True),
    Column(
        "er-gym",
        "The version that played.",
        lambda facts: Cell(facts.header.manifest.er_gym),
        words=True,
    ),
    Column(
        "Replayed",
        "How many episodes were played again on the engine to make this page, action by action.",
        _replayed,
        words=True,
    ),
)
"""The columns, the most telling first."""
