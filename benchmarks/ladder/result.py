"""What a ladder has come to: a table, beside the paper's."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from agents.finetune.settings import STAGES
from benchmarks.ladder.paper_rungs import PAPER
from benchmarks.ladder.phases import Rung, rungs
from benchmarks.ladder.settings import CONTROLS, LadderSettings
from benchmarks.scoring.metrics import Estimate, Score, Summary, summarise, summarise_by
from benchmarks.scoring.paired import paired_change, paired_difference
from benchmarks.scoring.report import by_group, load_run
from benchmarks.scoring.scorers import CORRECTED
from benchmarks.scoring.tables import Table, interval, percent, signed
from er_gym.rollout.records import EpisodeRecord
from er_gym.rollout.run_directory import CONVERSATIONS, MANIFEST
from er_gym.tasks.types import GROUPS
from er_gym.writing import file_stem

MOST_KEY_ACTIONS = 9
"""Tasks with as many key actions or more are counted together, as in the paper's figure."""
_NONE = "-"


@dataclass(frozen=True)
class RungResult:
    """A rung that was measured.

    Attributes:
        rung: which.
        summary: over all episodes, by the corrected scorer.
        groups: for each group of tasks that was played.
        by_key_actions: success by the number of key actions.
        tokens: tokens of the model's replies in an episode; None if there are no conversations.
        gain: the difference in success to the rung before, paired over tasks; None for the first.
            Of a control, that to the last rung.
        change: with faults, the difference in success to the same rung without them, paired over
            tasks; None without.
        spared: how much smaller a loss that is than the rung's before; None for the first.
        more_repeats: the difference in :func:`~benchmarks.scoring.metrics.repeat_rate` to the first
            stage measured with as many faults, paired over tasks; None for that stage, the base and
            the controls.
        more_revisits: the same of :func:`~benchmarks.scoring.metrics.revisit_rate`.
    """

    rung: Rung
    summary: Summary
    groups: dict[str, Summary]
    by_key_actions: dict[int, Summary]
    tokens: float | None
    gain: Estimate | None
    change: Estimate | None
    spared: Estimate | None
    more_repeats: Estimate | None
    more_revisits: Estimate | None


def read_results(settings: LadderSettings, root: Path) -> list[RungResult]:
    """The rungs that have been measured so far.

    Raises:
        RunDirectoryError: a run directory is damaged.
    """
    found: list[RungResult] = []
    before: dict[float, Sequence[Score]] = {}
    first_stages: dict[float, Sequence[Score]] = {}
    plain: dict[str, Sequence[Score]] = {}
    pairs: dict[float, tuple[Sequence[Score], Sequence[Score]]] = {}
    for rung in rungs(settings):
        path = root / rung.run
        if not (path / MANIFEST).exists():
            continue
        run = load_run(path)
        scores = run.scores[CORRECTED.name]
        if not scores:
            continue
        last = before.get(rung.faults)
        more_repeats = more_revisits = None
        if rung.name in STAGES:
            first = first_stages.setdefault(rung.faults, scores)
            if first is not scores:
                more_repeats = paired_difference(first, scores, "repeat_rate")
                more_revisits = paired_difference(first, scores, "revisit_rate")
        change = spared = None
        if not rung.faults:
            plain[rung.name] = scores
        elif rung.name in plain:
            pair = plain[rung.name], scores
            change = paired_difference(*pair)
            if rung.faults in pairs:
                spared = paired_change(pairs[rung.faults], pair)
            pairs[rung.faults] = pair
        found.append(
            RungResult(
                rung=rung,
                summary=summarise(scores),
                groups=by_group(scores),
                by_key_actions=_by_key_actions(scores, run.episodes),
                tokens=_tokens(path, run.episodes),
                gain=None if last is None else paired_difference(last, scores),
                change=change,
                spared=spared,
                more_repeats=more_repeats,
                more_revisits=more_revisits,
            )
        )
        if rung.name not in CONTROLS:
            before[rung.faults] = scores
    return found


def _by_key_actions(
    scores: Sequence[Score], episodes: Sequence[EpisodeRecord]
) -> dict[int, Summary]:
    numbers = {each.task_id: min(len(each.key_actions), MOST_KEY_ACTIONS) for each in episodes}
    names = summarise_by(
        scores,
        lambda each: str(numbers[each.task_id]),
        map(str, range(MOST_KEY_ACTIONS + 1)),
    )
    return {int(name): summary for name, summary in names.items()}


def _tokens(path: Path, episodes: Sequence[EpisodeRecord]) -> float | None:
    """Tokens of the model's replies in an episode, on average."""
    counts = []
    for episode in episodes:
        file = path / CONVERSATIONS / f"{file_stem(episode.key)}.json"
        if file.is_file():
            counts.append(json.loads(file.read_text(encoding="utf-8"))["completion_tokens"])
    return sum(counts) / len(counts) if counts else None


def result_tables(results: Sequence[RungResult]) -> list[Table]:
    """The results as tables: the rungs beside the paper's, and success by key actions."""
    if not results:
        return []
    figures = ("success", "95 %", "gain", "95 %", "SE", "TC", *GROUPS, "repeated", "tokens")
    head = ("rung", "faults", "n", *figures)
    rows = [_row(each) for each in results]
    names = [each.rung.name for each in results if not each.rung.faults]
    rows += [_paper_row(name) for name in names if name in PAPER]
    by_length = Table(
        title="Success by the number of key actions, in %",
        head=("rung", "faults", *map(str, range(1, MOST_KEY_ACTIONS)), f"{MOST_KEY_ACTIONS}+"),
        rows=tuple(_length_row(each) for each in results),
        text_columns=1,
    )
    with_faults = Table(
        title="What faults cost, in %",
        head=("rung", "faults", "success", "change", "95 %", "spared", "95 %", "repeated"),
        rows=tuple(_faults_row(each) for each in results if each.change is not None),
        text_columns=1,
        notes=(
            "change: in success by the faults, paired over tasks",
            "spared: how much smaller the loss is than that of the rung before",
        ),
    )
    repeats = Table(
        title="Repeated exploration, in %",
        head=("rung", "faults", "repeated", "more", "95 %", "revisited", "more", "95 %"),
        rows=tuple(_repeats_row(each) for each in results if each.more_repeats is not None),
        text_columns=1,
        notes=(
            "repeated: the share of navigations to a type visited before; revisited: to an object "
            "visited before, so that another cabinet is new",
            "more: than after the first stage measured with as many faults, paired over tasks",
        ),
    )
    return [
        Table(
            title="The ladder, in %",
            head=head,
            rows=tuple(rows),
            text_columns=1,
            notes=(
                "gain: in success over the rung above it, paired over tasks; of random and blind, "
                "over the last rung",
                "SE: search efficiency; TC: task completeness; repeated: the share of navigations "
                "to a type visited before; tokens: of the replies in an episode",
                "paper: arXiv 2503.21696, other tasks, in Unity's rooms",
            ),
            may_turn=True,
        ),
        *(table for table in (with_faults, repeats) if table.rows),
        by_length,
    ]


def _row(result: RungResult) -> tuple[str, ...]:
    summary, groups = result.summary, result.groups
    return (
        result.rung.name,
        f"{100 * result.rung.faults:g}",
        str(summary.n),
        percent(summary["success"].mean, 1),
        interval(summary["success"]),
        *signed(result.gain),
        percent(summary["search_efficiency"].mean, 1),
        percent(summary["completeness"].mean, 1),
        *(percent(groups[each]["success"].mean, 1) if each in groups else _NONE for each in GROUPS),
        percent(summary["repeat_rate"].mean, 1),
        _NONE if result.tokens is None else f"{result.tokens:,.0f}",
    )


def _faults_row(result: RungResult) -> tuple[str, ...]:
    return (
        result.rung.name,
        f"{100 * result.rung.faults:g}",
        percent(result.summary["success"].mean, 1),
        *signed(result.change),
        *signed(result.spared),
        percent(result.summary["repeat_rate"].mean, 1),
    )


def _repeats_row(result: RungResult) -> tuple[str, ...]:
    return (
        result.rung.name,
        f"{100 * result.rung.faults:g}",
        percent(result.summary["repeat_rate"].mean, 1),
        *signed(result.more_repeats),
        percent(result.summary["revisit_rate"].mean, 1),
        *signed(result.more_revisits),
    )


def _paper_row(name: str) -> tuple[str, ...]:
    paper = PAPER[name]
    figures = (paper.search_efficiency, paper.completeness, *paper.groups)
    return (
        f"paper: {paper.name}",
        "0",
        "809",
        f"{paper.success:.1f}",
        *[_NONE] * 3,
        *(f"{each:.1f}" for each in figures),
        *[_NONE] * 2,
    )


def _length_row(result: RungResult) -> tuple[str, ...]:
    lengths = range(1, MOST_KEY_ACTIONS + 1)
    return (
        result.rung.name,
        f"{100 * result.rung.faults:g}",
        *(
            percent(result.by_key_actions[each]["success"].mean, 1)
            if each in result.by_key_actions
            else _NONE
            for each in lengths
        ),
    )


def as_json(results: Sequence[RungResult]) -> str:
    """All figures, as fractions with their intervals."""
    return json.dumps(
        {"format": "er-gym/ladder-result/1", "rungs": list(map(_json, results))}, indent=1
    )


def _json(result: RungResult) -> dict[str, Any]:
    return {
        **asdict(result.rung),
        **_figures(result.summary),
        **{
            name: None if one is None else asdict(one)
            for name, one in (
                ("gain", result.gain),
                ("change", result.change),
                ("spared", result.spared),
                ("more_repeats", result.more_repeats),
                ("more_revisits", result.more_revisits),
            )
        },
        "tokens": result.tokens,
        "groups": {name: _figures(each) for name, each in result.groups.items()},
        "by_key_actions": {str(n): _figures(each) for n, each in result.by_key_actions.items()},
    }


def _figures(summary: Summary) -> dict[str, Any]:
    return {"n": summary.n, **{name: asdict(each) for name, each in summary.metrics.items()}}
