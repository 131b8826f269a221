"""The rows of the leaderboard."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from benchmarks.leaderboard.checking import Checked
from benchmarks.leaderboard.record_checks import HUMAN
from benchmarks.leaderboard.submission import Submission
from benchmarks.scoring.metrics import SIDE_EFFECTS, TIDY, Estimate, score_episode, summarise
from benchmarks.scoring.scorers import CORRECTED
from benchmarks.scoring.splits import SPLITS, STRICT, splits_of_episode
from benchmarks.study.paper_rungs import PAPER
from er_gym.tasks.suites import suite_names

NEW = (*SPLITS[1:], STRICT)
"""The parts of a suite that have a column: what no training has seen."""
_OWN = {
    "do-nothing": "a script that looks about",
    "always-end": "a script that says it is done",
    "random": "random legal actions",
    "searcher": "a script that reads the instruction",
    "mask-reader": "a script that reads the lists of legal actions",
    "oracle": "knows the key actions",
    HUMAN: "a person",
}


@dataclass(frozen=True)
class Cell:
    """A cell of the page.

    Attributes:
        text: what is shown.
        value: by which it is sorted; None for words, which are sorted as such.
    """

    text: str
    value: float | None = None


HEAD = (
    *("Agent", "By", "Suite", "Instances", "Sees", "Faults", "Tasks", "Success, %", "95 %"),
    *("Tidy success, %", "Side effects", "Search efficiency, %", "Completeness, %"),
    *(f"{name.capitalize()}, %" for name in NEW),
    *("US$ per solved task", "Tokens per solved task", "Steps", "er-gym", "Replayed"),
)
"""The columns."""
WORDS = frozenset({"Agent", "By", "Suite", "Instances", "Sees", "95 %", "er-gym", "Replayed"})
"""Those of words."""


def row(checked: Checked, months: Mapping[str, str]) -> tuple[Cell, ...]:
    """The row of a submission that has no problem.

    Args:
        checked: it.
        months: the name of a suite of fresh tasks to the month of which it is.
    """
    submission = checked.submission
    assert submission is not None
    scores = [score_episode(each, CORRECTED) for each in submission.episodes]
    whole = summarise(scores)
    parts: dict[str, list[bool]] = {name: [] for name in NEW}
    for episode, score in zip(submission.episodes, scores, strict=True):
        for name in splits_of_episode(episode):
            if name in parts:
                parts[name].append(score.success)
    header = submission.header
    manifest, solved = header.manifest, sum(score.success for score in scores)
    tokens = header.costs.prompt_tokens + header.costs.completion_tokens
    tasks = len({each.task_id for each in submission.episodes})
    success = whole["success"]
    return (
        Cell(_agent(submission)),
        Cell(header.by or "-"),
        Cell(_suite(manifest.suite, months)),
        Cell(str(manifest.env.get("instances", "target"))),
        Cell(str(manifest.env.get("obs_mode", ""))),
        Cell(_faults(manifest.env.get("faults", 0))),
        Cell(f"{tasks}/{manifest.suite_size}", tasks),
        _percent(success),
        Cell(f"{100 * (success.low or 0):.1f} to {100 * (success.high or 0):.1f}"),
        _percent(whole.get(TIDY)),
        _number(None if (effects := whole.get(SIDE_EFFECTS)) is None else effects.mean, "{:.2f}"),
        _percent(whole["search_efficiency"]),
        _percent(whole["completeness"]),
        *(_rate(parts[name]) for name in NEW),
        _number(header.costs.usd / solved if solved and header.costs.usd else None, "{:.4f}"),
        _number(tokens / solved if solved and tokens else None, "{:,.0f}"),
        _number(sum(each.num_steps - 1 for each in submission.episodes) / len(scores), "{:.1f}"),
        Cell(manifest.er_gym),
        Cell(_replayed(checked)),
    )


def _replayed(checked: Checked) -> str:
    if not checked.replayed:
        return "no"
    return f"{checked.replayed} episodes{', not the pictures' * bool(checked.notes)}"


def _agent(submission: Submission) -> str:
    header = submission.header
    spec = header.manifest.agent
    about = _OWN.get(spec, "" if header.name == spec else spec)
    return f"{header.name} ({about})" if about else header.name


def _suite(name: str, months: Mapping[str, str]) -> str:
    if name in months:
        return f"{name} (held out, {months[name]})"
    return name if name.removesuffix("-zh") in suite_names() else f"{name} (no month's)"


def _faults(faults: object) -> str:
    if isinstance(faults, Mapping):
        return ", ".join(f"{name} {rate:g}" for name, rate in faults.items())
    return f"{faults:g}" if isinstance(faults, float | int) else "-"


def _percent(estimate: Estimate | None) -> Cell:
    return _number(None if estimate is None else 100 * estimate.mean, "{:.1f}")


def _rate(successes: Sequence[bool]) -> Cell:
    if not successes:
        return Cell("-")
    rate = 100 * sum(successes) / len(successes)
    return Cell(f"{rate:.1f} of {len(successes)}", rate)


def _number(value: float | None, form: str) -> Cell:
    return Cell("-") if value is None else Cell(form.format(value), value)


PAPER_HEAD = (
    *("Model", "Success, %", "Search efficiency, %", "Completeness, %"),
    *("Search, %", "Manipulate, %", "Transport, %", "Composite, %"),
)


def paper_rows() -> list[tuple[Cell, ...]]:
    """The paper's published table, which was measured elsewhere."""
    return [
        (
            Cell(rung.name),
            *(
                Cell(f"{figure:.2f}", figure)
                for figure in (
                    *(rung.success, rung.search_efficiency, rung.completeness),
                    *rung.groups,
                )
            ),
        )
        for rung in PAPER.values()
    ]
