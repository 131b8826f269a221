"""What a collection is to hold: its settings, its manifest and its candidates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks.cli.collect_expert import ExpertRun
from benchmarks.cli.collect_options import CollectOptions
from benchmarks.cli.collect_select import Selection
from benchmarks.cli.errors import BadInput

if TYPE_CHECKING:
    from agents.expert.collect import CollectSettings, Stratum
    from agents.expert.recipe import Recipe
    from er_gym.data.collection import CollectionManifest
    from er_gym.tasks.suites import Suite
    from er_gym.tasks.task import Task


def _name_of(run: Path) -> str:
    """The name of a run directory with the digest of what it plays."""
    from er_gym.rollout.run_directory import RunDirectory

    return f"{run.resolve().name} ({RunDirectory.open(run).manifest.digest})"


def _corrector(options: CollectOptions) -> str:
    """Who takes over failed episodes."""
    from agents.expert.successors import EXPERT, check_corrector

    return EXPERT if options.correct_by is None else check_corrector(options.correct_by)


def _stated_corrections(options: CollectOptions) -> dict[str, Any]:
    """How it is corrected, for the manifest, which does not state the paper's way."""
    from agents.expert.successors import EXPERT
    from agents.zoo.index import weights_of

    by = _corrector(options)
    stated = {
        "correct_after": options.correct_after,
        "correct_by": by,
        "own_thoughts": options.own_thoughts,
    }
    usual = (None, "wrong", EXPERT, False)
    weights = {f"corrector_{name}": digest for name, digest in weights_of(by).items()}
    return {**{name: given for name, given in stated.items() if given not in usual}, **weights}


def settings_of(
    suite: Suite,
    tasks: Sequence[Task],
    env: Mapping[str, Any],
    recipe: Recipe | None,
    options: CollectOptions,
    seed: int,
    model: ExpertRun | None,
    selection: Selection | None,
) -> tuple[CollectSettings, CollectionManifest]:
    """What decides the trajectories, and the manifest that states it."""
    from agents.expert.collect import CollectSettings, corrections_recipe
    from agents.expert.players import PlaySettings
    from agents.expert.successors import EXPERT, successor
    from agents.expert.thought_kinds import load_thought_kinds
    from agents.vlm.settings import Pictures
    from er_gym import __version__
    from er_gym.data.collection import CollectionManifest
    from er_gym.envs.embodied_env import EmbodiedEnv

    if model is not None:
        env = {**env, **model.env}
    if options.correct_steps is not None:
        env = {**env, "max_steps": options.correct_steps}
    EmbodiedEnv((), **env)  # so that bad arguments are found before any worker starts
    kinds = load_thought_kinds(options.thoughts)
    pictures = None
    if not options.no_pictures:
        pictures = Pictures(quality=80, min_pixels=1, max_pixels=2**24)
    stated = corrections_recipe(options.correct_steps) if recipe is None else recipe
    if model is not None and model.options.decides:
        from agents.expert.decider import model_recipe

        stated = model_recipe(stated)
    manifest = CollectionManifest(
        suite=suite.name,
        suite_digest=suite.digest,
        settings={
            "recipe": stated.model_dump(mode="json", exclude={"description"}),
            "tasks": sorted({task.type.name for task in suite.tasks}),
            "scenes": sorted({task.scene for task in suite.tasks}),
            "thoughts": kinds.model_dump(mode="json"),
            "writer": options.writer,
            "language": options.language,
            "env": dict(env),
            "pictures": pictures and pictures.model_dump(include={"format", "quality"}),
            **({} if options.correct is None else {"corrects": _name_of(options.correct)}),
            **({} if model is None else {"expert": model.stated}),
            **({} if selection is None else selection.stated),
            **_stated_corrections(options),
        },
        seed=seed,
        er_gym=__version__,
    )
    by = _corrector(options)
    settings = CollectSettings(
        recipe=stated,
        tasks=tasks,
        env=env,
        play=PlaySettings(kinds, pictures, options.language),
        seed=seed,
        manifest=manifest.model_dump(mode="json"),
        corrector_observes="" if by == EXPERT else successor(by).observes,
    )
    return settings, manifest


def candidates(
    settings: CollectSettings, options: CollectOptions, model: ExpertRun | None
) -> tuple[dict[tuple[str, str], Stratum], dict[str, int]]:
    """The candidates, and how many failed episodes are left out, by the reason."""
    from agents.expert.collect import correction_strata, recipe_strata
    from er_gym.rollout.run_directory import RunDirectory

    correct = options.correct
    if correct is None:
        wanted = recipe_strata(settings, options.limit)
        if model is not None and model.options.decides:
            from agents.expert.decider import ModelCandidates

            for stratum in wanted.values():
                stratum.sequence = ModelCandidates(stratum.sequence, model.run.name)
        return wanted, {}
    after, by = options.correct_after or "wrong", _corrector(options)
    run = RunDirectory.open(correct)
    if after == "refusal" and run.manifest.env.get("faults"):
        raise BadInput(
            f"{correct} was played with faults, and what a fault refused succeeds in a correction: "
            "give a run without --faults, or --correct-after anywhere"
        )
    strata, left_out = correction_strata(
        settings.tasks,
        run,
        options.limit,
        after,
        by,
        options.correct_steps,
        options.language if options.own_thoughts else None,
    )
    if not (strata or options.allow_empty):
        why = "; ".join(f"{number} x {reason}" for reason, number in left_out.items())
        raise BadInput(f"{correct} has no episode that can be corrected ({why or 'it is empty'})")
    return strata, left_out
