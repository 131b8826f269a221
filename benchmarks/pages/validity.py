"""Make docs/validity.md: whether the suites measure what they say.

    python -m benchmarks.pages.validity

Plays a sample of each suite's tasks with the oracle and with agents that cannot think, and compares
the suites with the training tasks. ``--each 0`` plays all tasks.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import click

from agents import make_agent
from benchmarks.checks.leaks import disagreements, in_unseen_wording, shared, unearned
from benchmarks.cli.errors import bad_input
from benchmarks.cli.options import force_option
from benchmarks.harness.output import ROOT, progress
from benchmarks.harness.samples import sample_of_types
from benchmarks.scoring.metrics import Score, score_episode, summarise
from benchmarks.scoring.report import by_group
from benchmarks.scoring.scorers import CORRECTED
from benchmarks.scoring.tables import NONE, interval, percent, percent_if_told
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout.play import episode_seed, play_episode
from er_gym.tables import Table, as_markdown
from er_gym.tasks.suites import own_tasks
from er_gym.tasks.task import Task
from er_gym.tasks.types import BY_NAME, GROUPS
from er_gym.writing import MARKDOWN_MARK, check_output, write_output

SUITES = ("er-1k", "er-val", "mini", "train")
TEST = ("er-1k", "er-val", "mini")
THOUGHTLESS = (
    *("do-nothing", "always-end", "repeat-last", "random"),
    *("takes-all", "instruction-blind", "mask-reader"),
)
"""From the one that does least to the one that reads most."""
_INSTANCES = ("target", "explore")
_BENCHMARK = "er-1k"


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


def play(suite: str, tasks: Sequence[Task], agent: str, instances: str) -> Played:
    """Play some tasks in this process.

    Raises:
        RuntimeError: an episode crashed.
    """
    played = Played(suite, agent, instances)
    env = EmbodiedEnv((), obs_mode="text", instances=instances)
    try:
        for task in tasks:
            seed = episode_seed(0, task.id)
            record = play_episode(env, make_agent(agent, seed), task, seed, agent_name=agent)
            if record.error:
                raise RuntimeError(f"{agent} in {task.id}: {record.error}")
            played.scores.append(score_episode(record, CORRECTED))
            played.unearned += [f"{task.id}: {words}" for words in unearned(record)]
            played.apart += [f"{task.id}: {words}" for words in disagreements(record)]
    finally:
        env.close()
    return played


def plays(each: int) -> Iterator[Played]:
    """All that the page needs; ``each`` tasks of a type, 0 for all."""
    for suite in SUITES:
        yield play(suite, _sample(suite, each), "oracle", "target")
    tasks = _sample(_BENCHMARK, each)
    for instances in _INSTANCES:
        for agent in THOUGHTLESS:
            yield play(_BENCHMARK, tasks, agent, instances)


def _sample(suite: str, each: int) -> list[Task]:
    tasks = own_tasks(suite)
    return sample_of_types(tasks, (), each) if each else [*tasks]


def page(played: Sequence[Played], each: int, leaks: Table) -> str:
    """The page.

    Args:
        played: all episodes.
        each: how many tasks of a type were played, 0 for all.
        leaks: what tests share with training (:func:`leak_table`).
    """
    oracle = [one for one in played if one.agent == "oracle"]
    others = [one for one in played if one.agent != "oracle"]
    sample = f"{each} tasks of each type" if each else "all tasks"
    parts = [
        _TOP.format(sample=sample),
        "## Every task can be solved\n",
        as_markdown([_solved(oracle)]),
        _SOLVED,
        "## What agents that cannot think score\n",
        as_markdown([_thoughtless([one for one in others if one.instances == name], name)
                     for name in _INSTANCES]),
        as_markdown([_by_type(others)]),
        _THOUGHTLESS,
        "## A reward is earned, and the scorer agrees\n",
        as_markdown([_rewards(played)]),
        _REWARDS,
        "## What tests share with training\n",
        as_markdown([leaks]),
        _LEAKS,
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


def _thoughtless(played: Sequence[Played], instances: str) -> Table:
    rows = []
    for one in played:
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


def _by_type(played: Sequence[Played]) -> Table:
    """Success by type, of the agent that takes all and of the one that guesses."""
    chosen = [one for one in played if one.agent in ("takes-all", "instruction-blind")]
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


def _rewards(played: Sequence[Played]) -> Table:
    rows = [
        (
            one.suite,
            one.agent,
            one.instances,
            str(len(one.scores)),
            str(len(one.unearned)),
            str(len(one.apart)),
        )
        for one in played
    ]
    return Table(
        title="Episodes",
        head=("Suite", "Agent", "Instances", "n", "Reward not earned", "Scorer says otherwise"),
        rows=tuple(rows),
        text_columns=3,
    )


def leak_table() -> Table:
    """What the suites share with the training tasks."""
    train = own_tasks("train")
    found = {name: shared(train, own_tasks(name)) for name in TEST}
    rows = [(what, *(str(found[name][what]) for name in TEST)) for what in found[TEST[0]]]
    held_back = str(in_unseen_wording(train))
    return Table(
        title=f"Tasks that share something with the {len(train):,} tasks of train",
        head=("What", *(f"{name}, of {len(own_tasks(name)):,}" for name in TEST)),
        rows=(*rows, ("wording kept for evaluation", *[held_back] * len(TEST))),
        text_columns=1,
    )


@click.command()
@click.option("--each", default=20, show_default=True, type=click.IntRange(0))
@click.option("--out", type=click.Path(path_type=Path), default=ROOT / "docs" / "validity.md")
@force_option
def main(each: int, out: Path, force: bool) -> None:
    """Write docs/validity.md."""
    with bad_input():
        check_output(out, force=force)
    total = len(SUITES) + len(_INSTANCES) * len(THOUGHTLESS)
    played = [*progress(plays(each), "Playing", total)]
    for one in played:
        for words in (*one.unearned, *one.apart):
            click.echo(f"{one.suite}, {one.agent}, {one.instances}: {words}")
    write_output(out, page(played, each, leak_table()), force=force)
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
