"""The run directory: a manifest that says what is played, and one file per episode.

::

    runs/x/run.json                      the manifest
    runs/x/episodes/<task id>.json       an episode each
    runs/x/conversations/<task id>.json  what was said in it, with an agent that speaks
    runs/x/pictures/<task id>/           and shown

Files are written beside their place and moved there, so that whatever is found under its name is
whole; what a killed run left half-written has another name and is never read. Running again
continues: :meth:`RunStore.episodes` tells what is there.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, ValidationError

from agents.vlm.record import ConversationRecord
from benchmarks.episode import EpisodeRecord
from er_gym.envs.protocol import DEFAULT
from er_gym.tasks.errors import SetAside, Taken

MANIFEST = "run.json"
EPISODES = "episodes"
CONVERSATIONS = "conversations"
PICTURES = "pictures"

_LONGEST_NAME = 120  # characters; file systems take 255 bytes, the temporary name among them


class RunDirectoryError(ValueError):
    """A directory that cannot be used as this run's; the message says why and what to do."""


class Manifest(BaseModel):
    """What a run plays. Two runs with equal manifests may share a directory.

    Attributes:
        format: the version of this layout.
        suite: the suite's name.
        suite_digest: of its tasks' content.
        suite_size: how many tasks it has that can be played; a run need not have played them all.
        agent: the agent's spec.
        agent_settings: of an agent that speaks, what decides what it says.
        env: the keyword arguments of the environment.
        seed: the run's; every episode's is derived from it.
        er_gym: the version of the package.
        set_aside: the suite's tasks that cannot be played, and why; they are not in its size.
        taken: what stands for objects that tasks name and their scenes lack.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    format: Literal["er-gym/run/1"] = "er-gym/run/1"
    suite: str
    suite_digest: str
    suite_size: int
    agent: str
    agent_settings: dict[str, Any] = {}
    env: dict[str, Any]
    seed: int
    er_gym: str
    set_aside: tuple[SetAside, ...] = ()
    taken: tuple[Taken, ...] = ()

    @property
    def protocol(self) -> str:
        """By which rules episodes are played, see :mod:`er_gym.envs.protocol`."""
        return str(self.env.get("protocol", DEFAULT.name))


class RunStore:
    """A run directory, opened with :meth:`create` to play or :meth:`open` to read.

    Attributes:
        path: the directory.
        manifest: what is played in it.
    """

    def __init__(self, path: Path, manifest: Manifest) -> None:
        self.path = path
        self.manifest = manifest

    @classmethod
    def create(cls, path: Path, manifest: Manifest) -> RunStore:
        """Start a run in a directory, or continue it if it is the same run.

        Raises:
            RunDirectoryError: another run's results are there; nothing is changed.
            OSError: the directory cannot be made or written to.
        """
        if (path / MANIFEST).exists():
            other = cls.open(path).manifest
            if other.protocol != manifest.protocol:
                raise RunDirectoryError(
                    f"{path} holds a run under the {other.protocol} protocol, not the "
                    f"{manifest.protocol} one; choose another --out, or continue that run with "
                    f"--protocol {other.protocol}"
                )
            theirs = other.model_dump(mode="json")
            for name, here in manifest.model_dump(mode="json").items():
                there = theirs[name]
                if there != here:
                    raise RunDirectoryError(
                        f"{path} holds another run: its {name} is {there!r}, this one's {here!r}; "
                        "choose another --out, or start that run again as it was"
                    )
        elif any((path / EPISODES).glob("*.json")):
            raise RunDirectoryError(
                f"{path} holds episodes but no {MANIFEST} that tells of which run; "
                "choose another --out"
            )
        else:
            (path / EPISODES).mkdir(parents=True, exist_ok=True)
            _write_whole(path / MANIFEST, manifest.model_dump_json(indent=2) + "\n")
        return cls(path, manifest)

    @classmethod
    def open(cls, path: Path) -> RunStore:
        """Open a run directory to read it.

        Raises:
            RunDirectoryError: there is no run.
        """
        try:
            text = (path / MANIFEST).read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise RunDirectoryError(
                f"{path} is no run directory: {MANIFEST} cannot be read "
                f"({type(error).__name__}); give the directory that was er-gym bench's --out"
            ) from error
        try:
            return cls(path, Manifest.model_validate_json(text))
        except ValidationError as error:
            first = error.errors()[0]
            where = ".".join(map(str, first["loc"])) or "the file"
            raise RunDirectoryError(
                f"{path / MANIFEST} is no run manifest: {where}: {first['msg']}"
            ) from error

    def write(self, episode: EpisodeRecord) -> Path:
        """Keep an episode, in place of an earlier one of the same task."""
        path = self.path / EPISODES / f"{file_stem(episode.task_id)}.json"
        path.parent.mkdir(exist_ok=True)
        _write_whole(path, episode.model_dump_json(indent=1) + "\n")
        return path

    def write_conversation(
        self, conversation: ConversationRecord, pictures: Mapping[str, bytes]
    ) -> None:
        """Keep a conversation, in place of an earlier one of the same task.

        Args:
            conversation: what was said.
            pictures: files by path from the run directory on, all in :func:`picture_folder`.
        """
        task_id = conversation.task_id
        shutil.rmtree(self.path / picture_folder(task_id), ignore_errors=True)
        for name, data in pictures.items():
            path = self.path / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
        place = self.path / CONVERSATIONS / f"{file_stem(task_id)}.json"
        place.parent.mkdir(exist_ok=True)
        _write_whole(place, conversation.model_dump_json(indent=1) + "\n")

    def episodes(self) -> Iterator[EpisodeRecord]:
        """Every episode there is, by file name; files that hold none are passed over."""
        for path in sorted((self.path / EPISODES).glob("*.json")):
            with contextlib.suppress(ValidationError, OSError):
                yield EpisodeRecord.model_validate_json(path.read_bytes())


def picture_folder(task_id: str) -> str:
    """Where the pictures of a conversation are, from the run directory on."""
    return f"{PICTURES}/{file_stem(task_id)}"


def file_stem(task_id: str) -> str:
    """A file name for a task: its id, or, where that is no fit name, a readable unique one."""
    stem = re.sub(r"[^A-Za-z0-9._-]", "_", task_id)[:_LONGEST_NAME]
    if stem == task_id and not stem.startswith("."):
        return stem
    return f"{stem.lstrip('.')}-{hashlib.sha256(task_id.encode()).hexdigest()[:8]}"


def _write_whole(path: Path, text: str) -> None:
    """Write a file so that it is seen whole or not at all, power cuts included."""
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.stem}.", suffix=".tmp")
    try:
        with open(handle, "w", encoding="utf-8") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(temporary, 0o644)  # mkstemp's 0600 would keep the results from one's colleagues
        os.replace(temporary, path)
    except BaseException:  # Ctrl-C too
        with contextlib.suppress(OSError):
            os.unlink(temporary)
        raise
