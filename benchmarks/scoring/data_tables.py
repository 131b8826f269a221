"""Statistics of a collection as tables, beside the paper's figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from benchmarks.scoring.tables import NONE
from er_gym.data import paper_figures as paper
from er_gym.data.statistics import STATES, Statistics, mean_and_most
from er_gym.data.trajectory import THOUGHT_KINDS
from er_gym.tables import Table


def statistics_tables(found: Statistics) -> list[Table]:
    """All tables of a collection's statistics."""
    every = [
        _overview(found),
        _parts(found),
        _thoughts(found),
        _transitions(found),
        _compared(f"{found.name}: types of tasks", "Type", found.task_types, paper.TASK_TYPES),
        _compared(f"{found.name}: actions by verb", "Verb", found.verbs, paper.VERBS),
        _texts(found),
    ]
    if found.refused:
        every.append(_counted(f"{found.name}: the critic's refusals", "Reason", found.refused))
    if faults := _sum([part.faults for part in found.parts.values()]):
        every.append(_counted(f"{found.name}: faults", "Kind", faults))
    return every


def _overview(found: Statistics) -> Table:
    rows = (
        ("trajectories", f"{found.trajectories:,}"),
        ("succeeded", f"{found.succeeded:,} ({_percent(found.succeeded, found.trajectories)} %)"),
        ("turns", f"{found.turns:,}"),
        ("turns to be learnt from", f"{found.trained_turns:,}"),
        ("thoughts", f"{found.all_thoughts:,}"),
        *(("in language " + name, f"{number:,}") for name, number in found.languages.items()),
        *(("thoughts by " + name, f"{number:,}") for name, number in found.writers.items()),
        ("thoughts by grounded after a refusal", f"{found.replaced:,}"),
        ("requests to models", f"{found.requests:,}"),
        ("tokens of prompts", f"{found.prompt_tokens:,}"),
        ("tokens of replies", f"{found.completion_tokens:,}"),
        ("cost, US dollars", f"{found.usd:,.2f}"),
    )
    return Table(f"{found.name}: collection", ("", "Number"), rows, 1)


def _parts(found: Statistics) -> Table:
    rows = []
    for name, part in found.parts.items():
        actions, most_actions = mean_and_most(part.actions)
        pictures, most_pictures = mean_and_most(part.pictures)
        kinds = ", ".join(f"{kind} {number:,}" for kind, number in sorted(part.kinds.items()))
        rows.append(
            (
                name or NONE,
                kinds,
                f"{part.trajectories:,}",
                _percent(part.succeeded, part.trajectories),
                f"{actions:.2f}",
                f"{most_actions}",
                f"{pictures:.2f}",
                f"{most_pictures}",
            )
        )
    stages = {paper.STAGE_OF_PART[name] for name in found.parts if name in paper.STAGE_OF_PART}
    for one in paper.SETS:
        if one.stage in stages or not stages:
            rows.append(
                (
                    f"the paper's set {one.stage}",
                    NONE,
                    f"{one.trajectories:,}",
                    NONE,
                    f"{one.actions:.2f}",
                    NONE,
                    f"{one.pictures / one.trajectories:.2f}",
                    f"{one.most_pictures}",
                )
            )
    head = (
        *("Part", "Kinds", "Trajectories", "Success %"),
        *("Actions, mean", "most", "Pictures, mean", "most"),
    )
    return Table(f"{found.name}: trajectories by part", head, tuple(rows), 2)


def _thoughts(found: Statistics) -> Table:
    of_paper = sum(paper.THOUGHTS.values())
    rows = tuple(
        (
            kind,
            f"{found.thoughts[kind]:,}",
            _percent(found.thoughts[kind], found.all_thoughts),
            _percent(paper.THOUGHTS[kind], of_paper),
            f"{found.words[kind] / found.thoughts[kind]:.1f}" if found.thoughts[kind] else NONE,
        )
        for kind in THOUGHT_KINDS
    )
    head = ("Kind", "Thoughts", "%", "Paper %", "Words each")
    return Table(f"{found.name}: thoughts by kind", head, rows, 1)


def _transitions(found: Statistics) -> Table:
    shares = found.transition_shares()
    rows = tuple(
        (state, *(_both(shares, state, after) for after in STATES[1:])) for state in STATES
    )
    return Table(
        f"{found.name}: what follows what, in % of the row (the paper's in brackets)",
        ("After", *STATES[1:]),
        rows,
        1,
        may_turn=True,
    )


def _both(shares: Mapping[str, Mapping[str, float]], state: str, after: str) -> str:
    ours = shares.get(state, {}).get(after, 0.0)
    theirs = paper.TRANSITIONS[state].get(after, 0)
    return f"{ours:.0f} ({theirs:.0f})" if ours or theirs else NONE


def _compared(title: str, what: str, ours: Mapping[str, int], theirs: Mapping[str, int]) -> Table:
    """Counts and shares beside the paper's shares, in its order."""
    names = [*theirs, *sorted(ours.keys() - theirs.keys())]
    mine, its = sum(ours.values()), sum(theirs.values())
    rows = tuple(
        (
            name,
            f"{ours.get(name, 0):,}",
            _percent(ours.get(name, 0), mine),
            _percent(theirs[name], its) if name in theirs else NONE,
        )
        for name in names
    )
    return Table(title, (what, "Number", "%", "Paper %"), rows, 1)


def _texts(found: Statistics) -> Table:
    rows = (
        ("sentences", f"{found.sentences:,}"),
        ("distinct sentences, %", _percent(found.distinct_sentences, found.sentences)),
        ("distinct thoughts, %", _percent(found.distinct_thoughts, found.all_thoughts)),
        ("the most used thought, %", _percent(found.most_used_count, found.all_thoughts, 2)),
    )
    note = f"The most used thought: {found.most_used}" if found.most_used else ""
    notes = (note,) if note else ()
    return Table(f"{found.name}: wording", ("", "Number"), rows, 1, notes)


def _counted(title: str, what: str, counts: Mapping[str, int]) -> Table:
    every = sum(counts.values())
    ordered = sorted(counts.items(), key=lambda item: (-item[1], item[0]))
    rows = tuple((name, f"{number:,}", _percent(number, every)) for name, number in ordered)
    return Table(title, (what, "Number", "%"), rows, 1)


def _sum(counts: Sequence[Mapping[str, int]]) -> dict[str, int]:
    total: dict[str, int] = {}
    for one in counts:
        for name, number in one.items():
            total[name] = total.get(name, 0) + number
    return total


def _percent(number: float, of: float, digits: int = 1) -> str:
    return f"{100 * number / of:.{digits}f}" if of else NONE
