"""Make docs/validity.md: whether the suites measure what they say.

    python -m benchmarks.pages.validity

Plays a sample of each suite's tasks with the oracle and with agents that cannot think, compares the
suites with the training tasks, and plays some tasks with one thing changed (:mod:`.sensitivity`).
``--each 0`` plays all tasks. The episodes are kept in ``--work``: the same command goes on there,
and after a change to er-gym it is to be given another folder.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import click

from benchmarks.checks.leaks import disagreements, leak_table, unearned
from benchmarks.checks.named_objects import naming_table
from benchmarks.cli.errors import bad_input
from benchmarks.cli.options import force_option
from benchmarks.harness.output import ROOT, progress
from benchmarks.harness.played import played
from benchmarks.harness.samples import sample_of_types
from benchmarks.pages import sensitivity
from benchmarks.scoring.metrics import Score, score_episode, summarise
from benchmarks.scoring.report import by_group
from benchmarks.scoring.scorers import CORRECTED
from benchmarks.scoring.tables import NONE, interval, percent, percent_if_told
from er_gym.tables import Table, as_markdown
from er_gym.tasks.suites import own_tasks, suite_names
from er_gym.tasks.task import Task
from er_gym.tasks.types import BY_NAME, GROUPS
from er_gym.writing import MARKDOWN_MARK, check_output, write_output

SUITES = ("er-1k", "er-val", "mini", "train")
THOUGHTLESS = (
    *("do-nothing", "always-end", "repeat-last", "random"),
    *("takes-all", "instruction-blind", "mask-reader"),
)
"""From the one that does least to the one that reads most."""
_INSTANCES = ("target", "explore")
_BENCHMARK = "er-1k"
_TEST = ("er-1k", "er-val", "mini")


@dataclass
class Played:
    """The episodes of an agent in some tasks.

    Attributes:
        suite, agent, instances: what was played.
        scores: by the corrected scorer.
        unearned, apart: the ids of tasks with a reward that was not earned, and with a scorer that
            says otherwise than the environment, each with the reason.
    """

    suite: str
    agent: str
    instances: str
    scores: list[Score] = field(default_factory=list)
    unearned: list[str] = field(default_factory=list)
    apart: list[str] = field(default_factory=list)


def play(work: Path, suite: str, tasks: Sequence[Task], agent: str, instances: str) -> Played:
    """Play some tasks, or read the episodes that are in ``work``.

    Raises:
        RuntimeError: an episode crashed.
    """
    records = played(work, suite, agent, tasks, env={"instances": instances})
    return Played(
        suite,
        agent,
        instances,
        [score_episode(record, CORRECTED) for record in records],
        [f"{each.task_id}: {words}" for each in records for words in unearned(each)],
        [f"{each.task_id}: {words}" for each in records for words in disagreements(each)],
    )


def plays(work: Path, each: int) -> Iterator[Played]:
    """All that the page needs of the first chapters; ``each`` tasks of a type, 0 for all."""
    for suite in SUITES:
        yield play(work, suite, _sample(suite, each), "oracle", "target")
    tasks = _sample(_BENCHMARK, each)
    for instances in _INSTANCES:
        for agent in THOUGHTLESS:
            yield play(work, _BENCHMARK, tasks, agent, instances)


def _sample(suite: str, each: int) -> list[Task]:
    tasks = own_tasks(suite)
    return sample_of_types(tasks, (), each) if each else [*tasks]


def page(found: Sequence[Played], each: int, naming: Table, leaks: Table, sensitive: str) -> str:
    """The page.

    Args:
        found: all episodes of the first chapters.
        each: how many tasks of a type were played, 0 for all.
        naming: what instructions name (:func:`.named_objects.naming_table`).
        leaks: what tests share with training (:func:`.leaks.leak_table`).
        sensitive: what else success depends on (:func:`.sensitivity.chapter`).
    """
    oracle = [one for one in found if one.agent == "oracle"]
    others = [one for one in found if one.agent != "oracle"]
    sample = f"{each} tasks of each type" if each else "all tasks"
    parts = [
        _TOP.format(sample=sample),
        "## Every task can be solved\n",
        as_markdown([_solved(oracle)]),
        _SOLVED,
        "## An instruction names what is asked\n",
        as_markdown([naming]),
        _NAMING,
        "## What agents that cannot think score\n",
        as_markdown([_thoughtless([one for one in others if one.instances == name], name)
                     for name in _INSTANCES]),
        as_markdown([_by_type(others)]),
        _THOUGHTLESS,
        "## A reward is earned, and the scorer agrees\n",
        as_markdown([_rewards(found)]),
        _REWARDS,
        "## What tests share with training\n",
        as_markdown([leaks]),
        _LEAKS,
        "## What success depends on besides the task\n",
        sensitive,
    ]  # fmt: skip
    return MARKDOWN_MARK + "\n".join(parts)


def _solved(oracle: Sequence[Played]) -> Table:
    rows = []
    for one in oracle:
        whole = summarise(one.scores)
        rows.append(
            (
                one.suite,
                f"{whole.n} of {len(own_tasks(one.suite))}",
                percent(whole["success"].mean, 1),
                interval(whole["success"]),
                percent_if_told(whole.get("tidy_success"), 1),
                percent(whole["search_efficiency"].mean, 1),
            )
        )
    return Table(
        title="The oracle, in %",
        head=("Suite", "Tasks", "Success", "95 %", "Tidy success", "Search efficiency"),
        rows=tuple(rows),
        text_columns=1,
    )


def _thoughtless(found: Sequence[Played], instances: str) -> Table:
    rows = []
    for one in found:
        whole, groups = summarise(one.scores), by_group(one.scores)
        rows.append(
            (
                one.agent,
                percent(whole["success"].mean, 1),
                interval(whole["success"]),
                percent_if_told(whole.get("tidy_success"), 1),
                *(
                    percent(groups[name]["success"].mean, 1) if name in groups else NONE
                    for name in GROUPS
                ),
            )
        )
    return Table(
        title=f"{_BENCHMARK}, instances {instances}, in %",
        head=("Agent", "Success", "95 %", "Tidy success", *GROUPS),
        rows=tuple(rows),
        text_columns=1,
    )


def _by_type(found: Sequence[Played]) -> Table:
    """Success by type, of the agent that takes all and of the one that guesses."""
    chosen = [one for one in found if one.agent in ("takes-all", "instruction-blind")]
    rows = []
    for name, kind in BY_NAME.items():
        cells = []
        for one in chosen:
            mine = [score for score in one.scores if score.task_type == name]
            if mine:
                whole = summarise(mine)
                tidy = percent_if_told(whole.get("tidy_success"), 0)
                cells.append(f"{percent(whole['success'].mean, 0)} ({tidy})")
        if cells:
            rows.append((kind.title, *cells))
    return Table(
        title="By type of task: success, and tidy success in brackets, in %",
        head=("Type", *(f"{one.agent}, {one.instances}" for one in chosen)),
        rows=tuple(rows),
        text_columns=1,
    )


def _rewards(found: Sequence[Played]) -> Table:
    rows = [
        (
            one.suite,
            one.agent,
            one.instances,
            str(len(one.scores)),
            str(len(one.unearned)),
            str(len(one.apart)),
        )
        for one in found
    ]
    return Table(
        title="Episodes",
        head=("Suite", "Agent", "Instances", "n", "Reward not earned", "Scorer says otherwise"),
        rows=tuple(rows),
        text_columns=3,
    )


@click.command()
@click.option("--each", default=20, show_default=True, type=click.IntRange(0))
@click.option(
    "--changed",
    default=10,
    show_default=True,
    type=click.IntRange(1),
    help="Tasks of a type that are played with one thing changed.",
)
@click.option(
    "--of-models",
    default=2,
    show_default=True,
    type=click.IntRange(1),
    help="The same for language models.",
)
@click.option("--work", type=click.Path(path_type=Path), default=Path("runs/validity"))
@click.option("--out", type=click.Path(path_type=Path), default=ROOT / "docs" / "validity.md")
@force_option
def main(each: int, changed: int, of_models: int, work: Path, out: Path, force: bool) -> None:
    """Write docs/validity.md."""
    with bad_input():
        check_output(out, force=force)
    total = len(SUITES) + len(_INSTANCES) * len(THOUGHTLESS)
    found = [*progress(plays(work, each), "Playing", total)]
    for one in found:
        for words in (*one.unearned, *one.apart):
            click.echo(f"{one.suite}, {one.agent}, {one.instances}: {words}")
    ways = sensitivity.plays(work, changed, of_models)
    number = sensitivity.number_of_plays()
    sensitive = sensitivity.chapter(dict(progress(ways, "Changing", number)))
    naming = naming_table(suite_names())
    write_output(out, page(found, each, naming, leak_table(_TEST), sensitive), force=force)
    click.echo(out)


_TOP = """# Validity

Do the suites measure what they say? `python -m benchmarks.pages.validity` makes this page. It
plays {sample} with each agent, in this version; success is that of the corrected scorer, and tidy
success is without side effects ([agents.md](agents.md#runs)).
"""
_SOLVED = """\
Each task was played by the generator's verifier before it was kept, so this must be 100 %; and
each can be done without touching anything else. The oracle knows the key actions, and plays with
`instances="target"`.
"""
_NAMING = """\
An instruction must name each type of thing that the goal and the key actions are about, with the
places where things must end up, and no other type, in any of the names that instructions are made
from; where one object is meant among others of its type, it also names the place where that one
lies. Each suite was read as it is told and in Chinese. `python -m benchmarks.checks.named_objects`
prints those that do not name exactly. It does not look at how the types are joined: *put the mug in
the bowl* names the same types as *put the bowl in the mug*.
"""
_THOUGHTLESS = """\
`do-nothing` looks about; `always-end` says that it is done; `repeat-last` does a random legal
action three times, then another; `random` draws legal actions; `takes-all` toggles, takes, puts
and opens whatever it may, never reads the instruction, and ends; `instruction-blind` is the
searcher with an instruction that it makes up about something in view; `mask-reader` reads the
instruction, and goes through the lists of legal actions from A to Z.

What `takes-all` gains is not chance. A task that asks to switch on the one lamp in a room is done
by whoever switches everything, since success looks at what was asked for and at nothing else, as
the paper's does. In a search it gathers things: in 20 tasks of each of the two types, 11 to 12
types were within reach when it ended, on average, and in 13 of its 24 successes it had carried the
target there itself. Its *tidy* success is what such an agent is worth, so compare agents by that,
too. With `instances="target"` it also meets what was asked for more often, since there a type name
means the task's own object first. The mask reader reads the instruction, so it is no measure of
chance: it shows what the lists of legal actions give away to agents that get them as words.
"""
_REWARDS = """\
*Reward not earned*: a step earned a reward although as many key actions were left after it as
before, an episode earned more than the task has, or all of it without success. *Scorer says
otherwise*: success or reward by the corrected scorer, from the record alone, is not what the
environment said live. `python -m benchmarks.checks.one_judge` compares them in every task of a
suite.
"""
_LEAKS = """\
`er-1k` plays in rooms that no training task has. `er-val` and most of `mini` play in training
rooms, for choices between models and for quick tries; nearly half of `mini` are tasks that `train`
has, too, so a figure on `mini` says nothing of an agent that was trained. Short instructions of the
same words are told in many rooms, so a match to the letter says little alone; with the room it
would. The last row counts tasks of `train` in a wording that is kept for evaluation.
"""

if __name__ == "__main__":
    main()
