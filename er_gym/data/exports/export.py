"""The table of formats, and :func:`export`, which writes a collection in one of them."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

from er_gym.data.collection import Collection
from er_gym.data.dialects import load_dialect
from er_gym.data.exports.base import (
    SPLITS,
    ExportError,
    ExportFormat,
    ExportJob,
    ExportOptions,
    ExportSummary,
    Progress,
    room,
)
from er_gym.data.exports.hf import HF
from er_gym.data.exports.minari import MINARI
from er_gym.data.exports.ms_swift import MS_SWIFT
from er_gym.data.exports.paper import PAPER
from er_gym.data.exports.sharegpt import SHAREGPT
from er_gym.data.exports.trl import TRL, TRL_TURNS
from er_gym.data.exports.verl import VERL
from er_gym.plugins import Registry
from er_gym.tasks import splits
from er_gym.thor import SCENE_NAMES
from er_gym.writing import MARKDOWN_MARK, check_folder, whole_folder, write_atomic

EXPORTS: Registry[ExportFormat] = Registry(
    kind="export format",
    group="er_gym.exports",
    own={row.name: row for row in (SHAREGPT, MS_SWIFT, TRL, TRL_TURNS, VERL, HF, MINARI, PAPER)},
    expected=f"an {ExportFormat.__module__}.ExportFormat",
    fits=lambda row: isinstance(row, ExportFormat),
)
"""All formats by name."""
MANIFEST = "export.json"


def _ignore(done: int, total: int) -> None:
    """The progress callback that does nothing."""


def export(
    collection: Collection,
    format: str,
    out: Path,
    options: ExportOptions | None = None,
    progress: Progress = _ignore,
) -> ExportSummary:
    """Write a collection as training files.

    All of it is written, or nothing (:func:`er_gym.writing.whole_folder`). Memory does not grow
    with the collection.

    Args:
        collection: what to export.
        format: a name of :data:`EXPORTS`.
        out: the output folder; it may be there if it is empty.
        options: dialect, language, held-out rooms and so on.
        progress: is called after each trajectory with the number done and the total.

    Raises:
        ForeignFile: ``out`` is not empty.
        ExportError: a picture is missing, there is nothing to export, or a library is not
            installed.
        ValueError: there is no such format, dialect or room; the message lists the known ones.
        CollectionError: the collection is damaged.
        OSError: something cannot be written.
    """
    options = options or ExportOptions()
    row = EXPORTS.get(format)
    dialect = load_dialect(options.dialect)
    check_folder(out)
    scenes = _count_rooms(collection)
    held_out = _held_out(scenes, options.held_out)
    with whole_folder(out) as draft:
        job = ExportJob(
            collection, draft, options, dialect, held_out, sum(scenes.values()), progress
        )
        row.write(job)
        if not job.samples:
            raise ExportError(
                f"{collection.path} has nothing to export as {row.name}: its "
                f"{sum(scenes.values())} trajectories are left out: {_told(job.left_out)}"
            )
        summary = ExportSummary(
            format=row.name,
            trajectories=job.counts["trajectories"],
            left_out=dict(job.left_out),
            samples=dict(job.samples),
            turns=job.counts["turns"],
            trained_turns=job.counts["trained_turns"],
            pictures=job.picture_folder.pictures,
            shown=job.counts["shown"],
            linked=job.picture_folder.linked,
            outside=job.picture_folder.outside,
        )
        write_atomic(draft / "README.md", _readme(row, summary, options, collection))
        write_atomic(draft / MANIFEST, _manifest(summary, options, held_out, collection))
    return summary


def _count_rooms(collection: Collection) -> dict[str, int]:
    """How many trajectories each room has."""
    rooms: dict[str, int] = {}
    for trajectory in collection.trajectories():
        name = room(trajectory.scene)
        rooms[name] = rooms.get(name, 0) + 1
    if not rooms:
        raise ExportError(f"{collection.path} has no trajectories; collect some first")
    return rooms


def _held_out(rooms: Mapping[str, int], wanted: tuple[str, ...] | float) -> frozenset[str]:
    """The rooms that are held out. A share of the rooms is drawn by their names, so that the same
    collection always gives the same rooms."""
    if not isinstance(wanted, tuple):
        if not 0 <= wanted < 1:
            raise ValueError(f"the share of held-out rooms is {wanted:g}; give 0 to less than 1")
        ranked = sorted(rooms, key=lambda name: hashlib.sha256(name.encode()).digest())
        count = max(1, round(wanted * len(rooms))) if wanted else 0
        if count >= len(rooms):
            raise ExportError(
                f"the collection has {len(rooms)} rooms, so that none would be left to train on if "
                f"{count} are held out; name rooms instead"
            )
        return frozenset(ranked[:count])
    found: set[str] = set()
    for name in wanted:
        if name not in splits.SCENES and name not in (*SCENE_NAMES, *rooms):
            raise ValueError(
                f"there is no room {name!r:.80}; give names such as FloorPlan1, a share such as "
                f"0.1, or one of the sets {', '.join(splits.SCENES)}"
            )
        found |= set(splits.SCENES.get(name, (name,)))
    return frozenset(found)


def _told(counts: Mapping[str, int]) -> str:
    return "; ".join(f"{why}: {count}" for why, count in counts.items()) or "none"


_ONLY_HELD_OUT = re.compile(r"\[\[(.*?)\]\]", re.DOTALL)
_ALL_IN_ONE = (
    "There is no split `validation`, since no room of these was held out: `--held-out` does that."
)


def _readme(
    row: ExportFormat, summary: ExportSummary, options: ExportOptions, collection: Collection
) -> str:
    """What a person finds in the output: what it is, and how to load it."""
    files = "\n".join(
        f"  - split: {split}\n    path: data/{split}-*.parquet"
        for split in SPLITS
        if split in summary.samples
    )
    samples = ", ".join(f"{name} {count:,}" for name, count in sorted(summary.samples.items()))
    held_out = "validation" in summary.samples
    told = "`validation` holds the rooms that `train` does not." if held_out else _ALL_IN_ONE
    usage = _ONLY_HELD_OUT.sub(r"\1" if held_out else "", row.usage)
    left_out = f"\nLeft out: {_told(summary.left_out)}.\n" if summary.left_out else ""
    return (
        f"{row.card.replace('{data_files}', files)}{MARKDOWN_MARK}"
        f"# Trajectories of {collection.manifest.suite}\n\n"
        "Episodes of household tasks in AI2-THOR rooms, with what was seen, thought and done at "
        f"every step, collected and exported by er-gym {collection.manifest.er_gym} "
        f"(format `{row.name}`, dialect `{options.dialect}`).\n\n"
        f"- samples: {samples}\n"
        f"- trajectories: {summary.trajectories:,}, with {summary.turns:,} turns, of which "
        f"{summary.trained_turns:,} are to be learnt\n"
        f"- pictures: {summary.pictures:,}\n{left_out}\n"
        f"{told}\n\n## How to load it\n\n{usage}"
    )


def _manifest(
    summary: ExportSummary,
    options: ExportOptions,
    held_out: frozenset[str],
    collection: Collection,
) -> str:
    told = asdict(summary)
    del told["outside"]  # it names places of this machine
    content = {
        "format": "er-gym/export/1",
        "summary": told,
        "dialect": options.dialect,
        "language": options.language,
        "per_turn": options.per_turn,
        "held_out": sorted(held_out),
        "collection": collection.manifest.model_dump(mode="json"),
    }
    return json.dumps(content, indent=2) + "\n"
