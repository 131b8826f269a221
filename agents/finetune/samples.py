"""Training data: conversations with pictures, from collections, frames or ShareGPT files."""

from __future__ import annotations

import hashlib
import random
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

from agents.finetune.other_wordings import as_learnt
from agents.finetune.settings import DataSettings
from er_gym.data.chat import Chat, ChatTurn
from er_gym.data.collection import MANIFEST, Collection
from er_gym.data.dialects import load_dialect
from er_gym.data.frame_chat import frame_chat
from er_gym.data.frames import FrameSet, is_frame_set
from er_gym.data.sharegpt_files import open_sharegpt
from er_gym.data.trajectory import PictureRecord
from er_gym.tasks.splits import EVALUATION_SCENES
from er_gym.writing import inside

Item = TypeVar("Item")


@dataclass(frozen=True)
class Samples:
    """Training conversations.

    Attributes:
        chats: the conversations; each has a turn that is learnt. The paths of their pictures are
            absolute.
        digest: sha256 in hex of all words, flags, and names and sizes of pictures.
        prompts: settings of a model agent's prompts, by which the agent converses as here
            (``prompts`` of :class:`agents.vlm.settings.AgentSettings`).
        recorded: the settings of the collection that their pictures were recorded with.
        left_out: how many conversations have no turn that is learnt, and are not among them.
    """

    chats: tuple[Chat, ...]
    digest: str
    prompts: Mapping[str, str]
    recorded: Mapping[str, Any] = field(default_factory=dict)
    left_out: int = 0

    @property
    def sees(self) -> str:
        """``pictures``, or ``text`` if no conversation has a picture."""
        return "pictures" if any(chat.pictures for chat in self.chats) else "text"


@dataclass(frozen=True)
class _Source:
    """The conversations of one place; the paths of their pictures are relative to ``folder``, and
    lead out of it only where they may be ``anywhere``."""

    chats: tuple[Chat, ...]
    folder: Path
    prompts: Mapping[str, str]
    recorded: Mapping[str, Any] = field(default_factory=dict)
    anywhere: bool = False


def open_samples(paths: Sequence[Path], settings: DataSettings) -> Samples:
    """Open training data; pictures are only looked up, not read.

    Args:
        paths: each is a collection of ``er-gym collect``, what ``er-gym data frames`` drew, or a
            ShareGPT file with pictures.
        settings: which part of it, and how it is put into words.

    Raises:
        ValueError: there is nothing to learn from in it, a picture is missing, or the sources are
            in different words.
    """
    every_source = {path: _opened(path, settings) for path in paths}
    _check_choice(paths, settings)
    sources = {path: source for path, source in every_source.items() if source.chats}
    if not sources:
        names = ", ".join(map(str, paths))
        raise ValueError(f"{names}: there are no trajectories; give other data")
    (first_path, first), *others = sources.items()
    for path, source in others:
        if source.prompts != first.prompts:
            raise ValueError(
                f"{path} is in other words than {first_path}: {_told(source.prompts)}, not "
                f"{_told(first.prompts)}; set data.dialect and data.language, or train with one "
                "after the other"
            )
    every = [(chat, source) for source in sources.values() for chat in source.chats]
    every = [*drawn(every, settings.limit)]
    found = every
    if settings.mask == "turns":
        found = [(chat, source) for chat, source in every if any(chat.train)]
    names = ", ".join(map(str, paths))
    if not found:
        raise ValueError(
            f"{names}: no turn of its {len(every):,} conversations is to be learnt; give "
            "other data or other data.parts"
        )
    digest = _digest(chat for chat, _ in found)
    chats = tuple(_with_paths(chat, source) for chat, source in found)
    _check_pictures(chats)
    return Samples(chats, digest, first.prompts, first.recorded, len(every) - len(found))


def drawn(items: Iterable[Item], limit: int | None) -> Iterable[Item]:
    """All items, or so many of them, drawn at random: data is often ordered by task type.

    The draw is always the same, a smaller one is part of a larger one, and the items keep their
    order.

    Args:
        items: what is drawn from; read at once only if there is a limit.
        limit: how many at most; None for all.
    """
    if limit is None:
        return items
    every = list(items)
    places = list(range(len(every)))
    random.Random(0).shuffle(places)
    return [every[place] for place in sorted(places[:limit])]


def _opened(path: Path, settings: DataSettings) -> _Source:
    if (path / MANIFEST).is_file():
        return _of_collection(Collection.open(path), settings)
    if is_frame_set(path):  # it has no instructions, so other words change nothing in it
        return _of_frames(FrameSet.open(path), settings)
    settings.refuse_other_words(path)
    if not path.exists():
        raise ValueError(
            f"{path} does not exist; give what er-gym collect wrote, or a ShareGPT file"
        )
    if path.is_dir() and not (path / "dataset_info.json").is_file():
        raise ValueError(
            f"{path} holds neither a collection ({MANIFEST}) nor dataset_info.json; give what "
            "er-gym collect wrote, or a ShareGPT file"
        )
    file = open_sharegpt(path)
    chats = tuple(file)
    return _Source(chats, file.folder, {"dataset": str(file.path.resolve())}, anywhere=True)


def _of_collection(collection: Collection, settings: DataSettings) -> _Source:
    dialect = load_dialect(settings.dialect)
    trajectories = [
        as_learnt(each, settings)
        for each in collection.trajectories()
        if settings.takes(each.part, each.kind)
    ]
    try:
        chats = tuple(dialect.chat(each, settings.language) for each in trajectories)
    except ValueError as error:
        raise ValueError(f"{collection.path}: {error}; set data.dialect or data.language") from None
    languages = Counter(each.language for each in trajectories) or Counter(en=1)
    language = settings.language or languages.most_common(1)[0][0]
    prompts = {"dialect": settings.dialect, "language": language}
    return _Source(chats, collection.path, prompts, collection.manifest.settings)


def _of_frames(frames: FrameSet, settings: DataSettings) -> _Source:
    kept = sorted({*frames.manifest.settings["scenes"]} & {*EVALUATION_SCENES})
    if kept:
        raise ValueError(
            f"{frames.path} shows rooms that are kept for evaluation, such as {kept[0]}; learn "
            "from frames of the suite train, and measure with these: "
            "python -m benchmarks.vision_probe"
        )
    dialect, language = load_dialect(settings.dialect), settings.language or "en"
    try:
        chats = tuple(frame_chat(dialect, each, language) for each in frames.frames())
    except ValueError as error:
        raise ValueError(f"{frames.path}: {error}; set data.dialect or data.language") from None
    prompts = {"dialect": settings.dialect, "language": language}
    return _Source(chats, frames.path, prompts, frames.manifest.settings)


def _check_choice(paths: Sequence[Path], settings: DataSettings) -> None:
    """Refuse parts and kinds that none of the collections has, and other words where there is none.
    A ShareGPT file has neither parts nor kinds."""
    collections = [Collection.open(path) for path in paths if (path / MANIFEST).is_file()]
    if not collections:
        settings.refuse_other_words(paths[0])
    else:
        names = ", ".join(str(each.path) for each in collections)
        settings.check_choice(names, (one for each in collections for one in each.trajectories()))


def _told(prompts: Mapping[str, str]) -> str:
    return ", ".join(f"{name} {value}" for name, value in prompts.items())


def _digest(chats: Iterable[Chat]) -> str:
    told = hashlib.sha256()
    for chat in chats:
        told.update(repr((chat.id, chat.turns)).encode(errors="surrogatepass"))
    return told.hexdigest()


def _with_paths(chat: Chat, source: _Source) -> Chat:
    """The conversation with absolute paths of its pictures."""
    folder = source.folder.resolve()

    def path_of(picture: PictureRecord) -> Path:
        return folder / picture.path if source.anywhere else inside(folder, picture.path)

    def placed(turn: ChatTurn) -> ChatTurn:
        if not turn.pictures:
            return turn
        parts = (
            part.model_copy(update={"path": str(path_of(part))})
            if isinstance(part, PictureRecord)
            else part
            for part in turn.parts
        )
        return replace(turn, parts=tuple(parts))

    return replace(chat, turns=tuple(map(placed, chat.turns)))


def _check_pictures(chats: Sequence[Chat]) -> None:
    paths = {picture.path for chat in chats for picture in chat.pictures}
    missing = sorted(path for path in paths if not Path(path).is_file())
    if missing:
        raise ValueError(
            f"{len(missing):,} of {len(paths):,} pictures are missing, such as {missing[0]}; copy "
            "or collect the whole data again"
        )
