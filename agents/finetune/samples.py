"""What is learnt from: conversations with pictures, whatever they are made of."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path
from typing import Any

from agents.finetune.settings import DataSettings
from er_gym.data.chat import Chat
from er_gym.data.collection import Collection
from er_gym.data.dialects import load_dialect
from er_gym.data.trajectory import Trajectory


@dataclass(frozen=True)
class Samples:
    """Training conversations.

    Attributes:
        chats: the conversations; each has a turn that is learnt.
        folder: what the paths of their pictures are relative to.
        prompts: settings of a model agent's prompts, by which the agent converses as here
            (``prompts`` of :class:`agents.vlm.settings.AgentSettings`).
        recorded: the settings of the collection that their pictures were recorded with.
        left_out: how many conversations have no turn that is learnt, and are not among them.
    """

    chats: tuple[Chat, ...]
    folder: Path
    prompts: Mapping[str, str]
    recorded: Mapping[str, Any] = field(default_factory=dict)
    left_out: int = 0

    @property
    def digest(self) -> str:
        """sha256 in hex of all words, flags, and names and sizes of pictures."""
        told = hashlib.sha256()
        for chat in self.chats:
            told.update(repr((chat.id, chat.turns)).encode(errors="surrogatepass"))
        return told.hexdigest()

    @property
    def sees(self) -> str:
        """``pictures``, or ``text`` if no conversation has a picture."""
        return "pictures" if any(chat.pictures for chat in self.chats) else "text"


def open_samples(path: Path, settings: DataSettings) -> Samples:
    """Open training data; pictures are only looked up, not read.

    Args:
        path: a collection of ``er-gym collect``.
        settings: which part of it, and how it is put into words.

    Raises:
        ValueError: there is nothing to learn from in it, or a picture is missing.
    """
    # The one place where other kinds of data join: whatever gives Samples.
    samples = _of_collection(Collection.open(path), settings)
    chats = samples.chats
    if settings.mask == "turns":
        chats = tuple(chat for chat in chats if any(chat.train))
    if not chats:
        raise ValueError(
            f"{path}: no turn of its {len(samples.chats):,} conversations is to be learnt; give "
            "other data or other data.parts"
        )
    _check_pictures(chats, samples.folder)
    return replace(samples, chats=chats, left_out=len(samples.chats) - len(chats))


def _of_collection(collection: Collection, settings: DataSettings) -> Samples:
    dialect = load_dialect(settings.dialect)
    trajectories = list(_taken(collection, settings))
    missing = set(settings.parts) - {each.part for each in trajectories}
    if missing:
        there = sorted({each.part for each in collection.trajectories()})
        raise ValueError(
            f"{collection.path} has no trajectories of the part {', '.join(sorted(missing))}; it "
            f"has: {', '.join(there) or 'none'}; set data.parts, such as --set "
            f"'data.parts=[{', '.join(there)}]'"
        )
    trajectories = list(islice(trajectories, settings.limit))
    if not trajectories:
        raise ValueError(f"{collection.path} has no trajectories; give another collection")
    try:
        chats = tuple(dialect.chat(each, settings.language) for each in trajectories)
    except ValueError as error:
        raise ValueError(f"{collection.path}: {error}; set data.dialect or data.language") from None
    languages = Counter(each.language for each in trajectories)
    language = settings.language or languages.most_common(1)[0][0]
    prompts = {"dialect": settings.dialect, "language": language}
    return Samples(chats, collection.path, prompts, collection.manifest.settings)


def _taken(collection: Collection, settings: DataSettings) -> Sequence[Trajectory]:
    wanted = set(settings.parts)
    return [each for each in collection.trajectories() if not wanted or each.part in wanted]


def _check_pictures(chats: Sequence[Chat], folder: Path) -> None:
    paths = {picture.path for chat in chats for picture in chat.pictures}
    missing = sorted(path for path in paths if not (folder / path).is_file())
    if missing:
        raise ValueError(
            f"{len(missing):,} of {len(paths):,} pictures are missing, such as "
            f"{folder / missing[0]}; copy or collect the whole data again"
        )
