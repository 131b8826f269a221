"""The options of ``er-gym collect`` for what is collected."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from benchmarks.cli.collect_expert import ExpertOptions
from benchmarks.cli.collect_select import SelectOptions
from benchmarks.cli.errors import BadInput
from benchmarks.cli.options import (
    EXISTING_FILE,
    EXISTING_FOLDER,
    FOLDER,
    LANGUAGES,
    OptionGroup,
    Words,
    option,
    shared_option,
    size_option,
)

if TYPE_CHECKING:
    from agents.expert.corrections import CorrectAfter
    from er_gym.data.trajectory import Language


@dataclass(frozen=True)
class CollectOptions(OptionGroup):
    """What is collected, how it is recorded, and where."""

    suite: str | None = option(help="Take the tasks of a suite; `er-gym suites` lists them.")
    tasks_file: Path | None = option(type=EXISTING_FILE, help="Take the tasks of a file.")
    out: Path = option(type=FOLDER, required=True, help="The directory of the collection.")
    limit: int | None = option(
        type=click.IntRange(min=1), help="How many trajectories.  [default: the recipe's]"
    )
    recipe: str | None = option(
        metavar="NAME",
        help="What is collected: a YAML file, or the name of one of er-gym's own.  "
        "[default: paper]",
    )
    parts: str | None = option(metavar="PART,…", help="Collect only these parts of the recipe.")
    kinds: str | None = option(
        metavar="a,b,c", help="Only these kinds of the expert's trajectories."
    )
    types: str | None = option(metavar="TYPE,…", help="Only tasks of these types.")
    scenes: str | None = option(metavar="SCENE,…", help="Only tasks in these scenes.")
    instances: str | None = option(
        type=click.Choice(("target", "explore")),
        help="Which object a type name means.  [default: the suite's]",
    )
    writer: str = option(
        type=Words(),
        default="grounded",
        show_default=True,
        help="Who writes the thoughts: grounded, or package.module:Class. For a model, give "
        "--expert.",
    )
    thoughts: str = option(
        default="transitions",
        show_default=True,
        metavar="NAME",
        help="The transitions between kinds of thoughts: a YAML file, or the name of one of "
        "er-gym's own.",
    )
    language: Language = option(
        type=click.Choice(LANGUAGES),
        default="en",
        show_default=True,
        help="The language of the thoughts.",
    )
    no_pictures: bool = option(
        is_flag=True,
        help="Record the view as text only, for models without vision: many times as fast.",
    )
    width: int | None = shared_option(size_option("--width"))
    height: int | None = shared_option(size_option("--height"))
    correct: Path | None = option(
        type=EXISTING_FOLDER,
        metavar="RUN",
        help="Correct the failed episodes of a run of er-gym bench; give no --recipe.",
    )
    correct_after: CorrectAfter | None = option(
        type=click.Choice(("wrong", "failure", "anywhere", "refusal")),
        help="With --correct: where the expert takes over. wrong: after the first action that did "
        "no key action; failure: after the first that failed since the last key action; anywhere: "
        "after up to six actions drawn at random, refused ones first; refusal: after up to six "
        "refused ones.  [default: wrong, as in the paper]",
    )
    correct_by: str | None = option(
        metavar="[expert|searcher|spotter|zoo:NAME]",
        help="With --correct: which agent takes over; zoo:NAME is a policy of the zoo, such as "
        "zoo:all-sightings (er-gym zoo lists them), and needs er-gym[rl]. All but the expert know "
        "only what the failed episode has seen, and a policy which actions are possible.  "
        "[default: expert]",
    )
    correct_steps: int | None = option(
        type=click.IntRange(min=1),
        help="With --correct: the step limit of corrections, what they repeat included. One that "
        "begins late needs more steps than the episode had.  [default: the task type's own]",
    )
    own_thoughts: bool = option(
        is_flag=True,
        help="With --correct: what a correction repeats keeps the thoughts of the agent that "
        "failed, so that a model learns to go on from what it wrongly believed. Else --writer "
        "writes them anew, too.",
    )
    allow_empty: bool = option(
        is_flag=True,
        help="With --select or --correct: exit with 0 even if no episode can be taken.",
    )


def refuse_misfits(
    options: CollectOptions, select_options: SelectOptions, expert_options: ExpertOptions
) -> None:
    """Refuse options that do not go together."""
    given = [*options.given, *expert_options.given]

    def refuse(flags: Sequence[str], why: str) -> None:
        misfit = next((flag for flag in given if flag in flags), None)
        if misfit is not None:
            raise BadInput(f"{misfit} {why}")

    if select_options.select:
        why = "does not go with --select: leave one of them out"
        refuse(("--correct", "--parts", "--kinds", "--expert"), why)
    expert = expert_options.expert
    if expert is not None:
        if options.no_pictures:
            raise BadInput("--no-pictures is for scripted writers; leave it or --expert out")
        if options.writer != "grounded":
            raise BadInput(f"give --writer {options.writer} or --expert {expert}, not both")
        if expert_options.decides and options.correct is not None:
            raise BadInput("--correct follows a plan: leave out --decisions model")
        if expert_options.decides and options.kinds is not None:
            raise BadInput("--kinds is for --decisions plan: a model that decides plays one kind")
    if options.correct is None:
        refuse(
            ("--correct-after", "--correct-by", "--correct-steps", "--own-thoughts"),
            "is for --correct RUN; leave it out",
        )
    else:
        why = "is for a recipe; --correct RUN collects without one"
        refuse(("--recipe", "--parts", "--kinds"), why)
    if select_options.select or options.correct is not None:
        refuse(("--instances",), "is that of the run; leave it out")
