"""The training data of printed files: conversations of a collection or of a ShareGPT file."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import er_gym
from agents.finetune.other_wordings import as_learnt
from agents.finetune.samples import drawn
from agents.finetune.settings import DataSettings, Mask
from er_gym.data.chat import Chat
from er_gym.data.collection import MANIFEST, Collection, CollectionManifest
from er_gym.data.dialects import Dialect, load_dialect
from er_gym.data.exports.base import ExportError, ExportJob, ExportOptions, Split
from er_gym.data.exports.sharegpt import FEEDBACK_TOKEN
from er_gym.data.sharegpt_files import open_sharegpt
from er_gym.data.trajectory import PictureRecord

PicturesToTokens = Callable[[PictureRecord], int]
_MESSAGE_TOKENS = 5
"""What a chat template adds to a message, and two for the marks around a picture."""
_WORD = re.compile(r"[A-Za-z]+|\d|[^\sA-Za-z\d]")
_LETTERS_A_TOKEN = 6


@dataclass(frozen=True)
class Source:
    """Conversations.

    Attributes:
        path: what the user gave.
        collection: where pictures are looked up; for a ShareGPT file it stands for its folder.
        dialect: of a collection's texts.
        chats: makes the conversations anew, in order.
    """

    path: Path
    collection: Collection
    dialect: Dialect
    chats: Callable[[], Iterator[Chat]]


@dataclass(frozen=True)
class DataFacts:
    """What is in the conversations.

    Attributes:
        chats: how many are learnt from; ``left_out``: how many have no turn to learn.
        partly: whether some turns of the assistant get no loss.
        feedback: whether ``<|feedback|>`` occurs.
        pictures: how many are shown.
        longest: the id of the longest, ``tokens`` about how many it has, and ``picture_tokens`` how
            many of these are pictures'; ``shown`` how many pictures it has.
    """

    chats: int
    left_out: int
    partly: bool
    feedback: bool
    pictures: int
    longest: str
    tokens: int
    picture_tokens: int
    shown: int


def open_source(path: Path, settings: DataSettings) -> Source:
    """Open what is to be trained on.

    Args:
        path: a collection's directory; else a ShareGPT file, ``dataset_info.json``, or a folder
            with one.
        settings: which parts, in which dialect, with which loss.

    Raises:
        ValueError: it is neither, or damaged, or lacks a part.
    """
    dialect = load_dialect(settings.dialect)
    if (path / MANIFEST).is_file():
        collection = Collection.open(path)
        settings.check_choice(str(collection.path), collection.trajectories())
        return Source(path, collection, dialect, lambda: _of_collection(collection, settings))
    settings.refuse_other_words(path)
    if path.is_dir() and not (path / "dataset_info.json").is_file():
        raise ValueError(
            f"{path} holds neither a collection ({MANIFEST}) nor dataset_info.json; give what "
            "er-gym collect wrote, or a ShareGPT file"
        )
    file = open_sharegpt(path)
    manifest = CollectionManifest(
        suite=file.path.name, suite_digest="", seed=0, er_gym=er_gym.__version__
    )
    return Source(
        path,
        Collection(file.folder, manifest),
        dialect,
        lambda: _masked(iter(drawn(file, settings.limit)), settings.mask),
    )


def data_facts(source: Source, count: PicturesToTokens) -> DataFacts:
    """Go through the conversations once.

    Raises:
        ValueError: there is none with a turn to learn.
    """
    chats = left_out = pictures = 0
    partly = feedback = False
    longest, most, most_pictures, shown = "", 0, 0, 0
    for chat in source.chats():
        if not any(chat.train):
            left_out += 1
            continue
        chats += 1
        partly |= not chat.trains_all
        feedback |= any(FEEDBACK_TOKEN in turn.text for turn in chat.turns)
        pictures += len(chat.pictures)
        seen = sum(count(picture) + 2 for picture in chat.pictures)
        tokens = seen + sum(_about(turn.text) + _MESSAGE_TOKENS for turn in chat.turns)
        if tokens > most:
            longest, most, most_pictures, shown = chat.id, tokens, seen, len(chat.pictures)
    if not chats:
        raise ValueError(
            f"{source.path}: none of its {left_out:,} conversations has a turn to learn; choose "
            "other data or other data.parts"
        )
    return DataFacts(
        chats, left_out, partly, feedback, pictures, longest, most, most_pictures, shown
    )


@dataclass
class SourceJob(ExportJob):
    """An export of conversations instead of trajectories."""

    source_chats: Callable[[], Iterator[Chat]] | None = None

    @classmethod
    def of(cls, source: Source, folder: Path, *, per_turn: bool, copy: bool) -> SourceJob:
        """The job that writes a source's conversations into a folder."""
        return cls(
            collection=source.collection,
            folder=folder,
            options=ExportOptions(per_turn=per_turn, copy=copy),
            dialect=source.dialect,
            held_out=frozenset(),
            total=0,
            progress=lambda done, total: None,
            source_chats=source.chats,
        )

    def chats(self, under: object = None) -> Iterator[tuple[Split, Chat]]:
        """The conversations with a turn to learn, all in the split ``train``."""
        folder = under.get("train", "") if isinstance(under, dict) else ""
        for chat in self.source_chats() if self.source_chats else ():
            if any(chat.train):
                yield "train", self.with_pictures(chat, folder)

    def source(self, picture: PictureRecord) -> Path:
        """The file of a picture, which may lie anywhere."""
        file = self.collection.path / picture.path
        if not file.is_file():
            raise ExportError(f"the picture {file} is missing; copy or collect the data again")
        return file


def released(chat: Chat) -> Chat:
    """The conversation with loss on all turns after the first ``<|feedback|>``, or all if there is
    none: the mask of the paper's released code."""
    first = next(
        (
            place
            for place, turn in enumerate(chat.turns)
            if turn.role == "user" and FEEDBACK_TOKEN in turn.text
        ),
        -1,
    )
    turns = (
        replace(turn, train=turn.role == "assistant" and place > first)
        for place, turn in enumerate(chat.turns)
    )
    return replace(chat, turns=tuple(turns))


def _of_collection(collection: Collection, settings: DataSettings) -> Iterator[Chat]:
    dialect = load_dialect(settings.dialect)
    taken = (
        as_learnt(each, settings)
        for each in collection.trajectories()
        if each.turns and settings.takes(each.part, each.kind)
    )
    chats = (dialect.chat(each, settings.language) for each in drawn(taken, settings.limit))
    return _masked(chats, settings.mask)


def _masked(chats: Iterator[Chat], mask: Mask) -> Iterator[Chat]:
    return map(released, chats) if mask == "released" else chats


def _about(text: str) -> int:
    """About how many tokens a text has; no tokenizer is at hand.

    A token for each sign and figure and six letters; other scripts, a token for each character.
    """
    return sum(1 + (len(word) - 1) // _LETTERS_A_TOKEN for word in _WORD.findall(text))
