"""What a collection says in several places, compared: its manifests, and its trajectories."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from er_gym.data.collection import PARTS, PLAYED, Collection, CollectionError, CollectionManifest
from er_gym.data.comparing import compared
from er_gym.data.trajectory import Trajectory
from er_gym.rollout.run_directory import MANIFEST, Manifest
from er_gym.tasks.reading import read_bytes
from er_gym.writing import file_stem

_ALIKE = ("suite", "suite_digest", "seed", "er_gym")


def check_manifests(collection: Collection) -> None:
    """Compare the manifests of a collection's parts with its own.

    Raises:
        CollectionError: one is damaged, or says something else.
    """
    for name, part in collection.parts().items():
        for problem in manifest_problems(collection.manifest, name, part.manifest):
            raise CollectionError(
                f"{collection.part_path(name) / MANIFEST}: {problem}; one of the two was changed: "
                "collect anew, into another folder"
            )


def manifest_problems(ours: CollectionManifest, name: str, part: Manifest) -> Iterator[str]:
    """Where a part's manifest differs from what the collection's says of it."""
    by = "the collection's manifest"
    for field in _ALIKE:
        yield from compared(field, getattr(part, field), getattr(ours, field), by)
    yield from compared("agent_settings", part.agent_settings, ours.settings, by)
    if "recipe" in ours.settings:
        yield from compared("env", part.env, _env(ours.settings, name, part), by)


def _env(settings: Mapping[str, Any], name: str, part: Manifest) -> dict[str, Any]:
    """The arguments of a part's environment. What else was observed beside pictures is free."""
    faults = settings["recipe"]["parts"].get(name, {}).get("faults")
    modes = str(part.env.get("obs_mode", "")).split("+")
    if (settings["pictures"] is not None) != ("rgb" in modes):
        modes = [each for each in (*modes, "rgb") if each != "rgb" or settings["pictures"]]
    told = {**settings["env"], "obs_mode": "+".join(modes)}
    return {**told, "faults": faults} if faults else told


def copy_problems(collection: Collection, trajectory: Trajectory) -> Iterator[str]:
    """Where a trajectory differs from the part's own record of it.

    ``er-gym collect`` writes the collection's file from these records. There are none where another
    program wrote the collection.
    """
    folder = collection.part_path(trajectory.part) / PLAYED
    if not folder.is_dir():
        return
    file = f"{PARTS}/{trajectory.part}/{PLAYED}/{file_stem(trajectory.id)}.json"
    try:
        if read_bytes(collection.path / file).decode() == trajectory.model_dump_json() + "\n":
            return
        other = collection.played(trajectory.part, trajectory.id)
    except ValueError as error:
        yield f"{file}, the part's own record of it, cannot be read: {error}"
        return
    for line in compared("", trajectory, other, file):
        yield line.removeprefix(".")
