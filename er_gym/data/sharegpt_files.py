"""Reads ShareGPT files with pictures, other people's too, as conversations.

Such a file is a list of ``{"messages": [{"role", "content"}, …], "images": ["path", …]}``, or of
``{"conversations": [{"from", "value"}, …], …}``, or JSON Lines of these; a ``dataset_info.json`` of
LLaMA-Factory may say what the columns are called. ``<image>`` in a text is the place of a picture.
The paper's released training file is one.

:func:`open_sharegpt` checks the whole file before it is used; see :class:`Report`.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from er_gym.data.chat import IMAGE, Chat, ChatTurn, Part
from er_gym.data.exports.sharegpt import FEEDBACK_TOKEN
from er_gym.data.json_items import JsonItems, json_items
from er_gym.data.pictures import UnusablePicture, picture_size
from er_gym.data.sharegpt_columns import OLDER, Columns, guessed_columns, sample_of
from er_gym.data.sharegpt_pictures import PicturePlaces, find_pictures
from er_gym.data.sharegpt_report import (
    HARMLESS,
    Problems,
    Report,
    Sample,
    report_of,
)
from er_gym.data.trajectory import PictureRecord
from er_gym.tasks.reading import parse_json, read_text

INFO = "dataset_info.json"
_TURNS = "_turns"
"""The end of a dataset's name in er-gym's own export whose samples teach their last turn alone."""
_IMAGE = re.compile(f"({re.escape(IMAGE)})")
_LOOKED_AT = 20
"""Samples, and pictures, by which it is found out where the pictures are."""


class ShareGptError(ValueError):
    """A file cannot be used; the message says why and what to do, in one line."""


_COLUMNS = {"messages": "messages", "images": "images", "system": "system"}
_TAGS = {
    "role_tag": "role",
    "content_tag": "content",
    "user_tag": "user",
    "assistant_tag": "assistant",
    "system_tag": "system_role",
}
"""The names in ``dataset_info.json``, and the fields of :class:`Columns`."""


class ShareGptFile:
    """The conversations of a file, each read when it is asked for.

    It can be sent to other processes: it holds the places of the samples, not an open file.

    Attributes:
        path: the file.
        folder: what the paths of pictures are relative to.
        columns: what its parts are called.
        places: where its pictures are.
        report: what is in it, and what is wrong with it.
    """

    def __init__(
        self,
        items: JsonItems,
        places: PicturePlaces,
        columns: Columns,
        last_turn_only: bool,
        problems: Problems,
        report: Report,
        chosen: array[int],
    ) -> None:
        self.path = items.path
        self.folder = places.folder
        self.columns = columns
        self.places = places
        self.report = report
        self._problems = problems
        self._items = items
        self._last_turn_only = last_turn_only
        self._chosen = chosen

    def __len__(self) -> int:
        return len(self._chosen)

    def __iter__(self) -> Iterator[Chat]:
        return (self[index] for index in range(len(self)))

    def __getitem__(self, index: int) -> Chat:
        """A conversation.

        Raises:
            ShareGptError: a picture cannot be read.
            IndexError: there is no such conversation.
        """
        place = self._chosen[index]
        sample = _sample(self._items, place, self.columns)
        turns: list[ChatTurn] = []
        images = iter(sample.images)
        for role, text in zip(sample.roles, sample.texts, strict=True):
            turns.append(ChatTurn(role, self._parts(text, images, place)))
        flags = self._flags(sample)
        learnt = iter(flags)
        turns = [
            replace(turn, train=next(learnt)) if turn.role == "assistant" else turn
            for turn in turns
        ]
        return Chat(self._id(sample, place), tuple(turns))

    def ids(self) -> Iterator[str]:
        """The id of each conversation, in order."""
        for place in self._chosen:
            yield self._id(_sample(self._items, place, self.columns), place)

    def left_out(self) -> Iterator[dict[str, Any]]:
        """Of each sample that has problems: its number in the file, its id, and all problems."""
        chosen = {*self._chosen}
        for index in range(len(self._items)):
            if index not in chosen:
                sample = _sample(self._items, index, self.columns)
                why = self._problems.of(sample, self.places)
                if not self.report.harmless.issuperset(why):
                    yield {"item": index, "id": sample.id, "why": why}

    def _id(self, sample: Sample, place: int) -> str:
        return sample.id or f"{self.path.stem}-{place:05}"

    def _flags(self, sample: Sample) -> list[bool]:
        count = sum(role == "assistant" for role in sample.roles)
        if self._last_turn_only:
            return [False] * (count - 1) + [True]
        return list(sample.train) or [True] * count

    def _parts(self, text: str, images: Iterator[str], place: int) -> tuple[Part, ...]:
        parts: list[Part] = []
        for part in _IMAGE.split(text):
            if part == IMAGE:
                parts.append(self._picture(next(images), place))
            elif part:
                parts.append(part)
        return tuple(parts)

    def _picture(self, path: str, place: int) -> PictureRecord:
        path = self.places.path_of(path)
        try:
            width, height = picture_size(self.folder / path)
        except UnusablePicture as error:
            raise ShareGptError(f"{self._items.place(place)}: {error}") from error
        return PictureRecord(path=path, width=width, height=height)


def open_sharegpt(
    path: Path,
    *,
    dataset: str = "",
    pictures: Path | None = None,
    feedback: bool | None = None,
    last_turn_only: bool | None = None,
    decisions: bool = False,
    decode: bool = False,
    leave_out: bool = False,
) -> ShareGptFile:
    """Open a ShareGPT file, and check all of it. Memory grows by some bytes a sample.

    Args:
        path: the file; or ``dataset_info.json``, or a folder that has it.
        dataset: the entry of ``dataset_info.json``, which may be the one beside the file; needed
            only if it has several, or several for the file that name its parts differently.
        pictures: what the paths of pictures are relative to; by default the file's folder, or one
            above or below it where the first pictures are
            (:mod:`er_gym.data.sharegpt_pictures`).
        feedback: True for the samples that have ``<|feedback|>`` (in the paper's file: those of the
            third stage), False for the others, None for all.
        last_turn_only: whether each sample teaches its last turn alone; by default if the file's
            name ends in ``_turns``, as er-gym's export has it. Otherwise a message's ``loss`` says
            whether it is learnt, and if there is none, all the assistant's are.
        decisions: whether a reply that does not end in a known action is a problem, too.
        decode: decode each picture once, so that one that is cut off is a problem, too; it takes
            some milliseconds a picture. Otherwise only the beginnings of their files are read.
        leave_out: leave out the samples that have problems, instead of raising.

    Raises:
        ShareGptError: there is no such file or entry, or nothing is left; or samples have problems
            and ``leave_out`` is False: the message counts them and names the first.
        TaskFileError: the file is no list of JSON values; the message says where.
    """
    file, columns = _file_and_columns(path, dataset)
    items = json_items(file)
    columns = columns or _guessed(items)
    places = find_pictures(file, _first_pictures(items, columns), pictures)
    problems = Problems(harmless=frozenset() if decisions else HARMLESS, decode=decode)
    chosen = array("Q")
    for index in range(len(items)):
        sample = _sample(items, index, columns)
        sound = problems.look(index, sample, places)
        if (sound or not leave_out) and (feedback is None or feedback == sample.has_feedback):
            chosen.append(index)
    report = report_of(items, problems)
    if report.unsound and not leave_out:
        raise ShareGptError(f"{report.in_one_line()}; mend the file, or leave such samples out")
    if not chosen:
        kind = {True: f" with {FEEDBACK_TOKEN}", False: f" without {FEEDBACK_TOKEN}", None: ""}
        raise ShareGptError(
            f"{file}: none of the {len(items):,} samples is left{kind[feedback]}; "
            f"{report.in_one_line()}"
        )
    only_last = file.stem.endswith(_TURNS) if last_turn_only is None else last_turn_only
    return ShareGptFile(items, places, columns, only_last, problems, report, chosen)


def _sample(items: JsonItems, index: int, columns: Columns) -> Sample:
    """A sample of a file; :attr:`Sample.wrong` says so if it cannot be read."""
    value, wrong = items.look(index)
    return Sample(wrong=wrong) if wrong else sample_of(value, columns)


# -- which file, which columns ---------------------------------------------------------------------


def _file_and_columns(path: Path, dataset: str) -> tuple[Path, Columns | None]:
    """The data file, and its columns if a ``dataset_info.json`` tells them."""
    is_table = path.is_dir() or path.name == INFO
    info = (path if path.is_dir() else path.parent) / INFO
    if not is_table and not info.is_file():
        if dataset:
            raise ShareGptError(f"{path} has no {INFO} beside it, so no dataset {dataset!r:.80}")
        return path, None
    entries = _entries(info)
    fitting = [
        name
        for name, entry in entries.items()
        if is_table or (isinstance(entry, Mapping) and entry.get("file_name") == path.name)
    ]
    if dataset and dataset not in fitting:
        has = f"the datasets {_listed(fitting)}" + ("" if is_table else f" for {path.name}")
        raise ShareGptError(f"{info} has {has}; there is no {dataset!r:.80}")
    names = [dataset] if dataset else fitting
    if not is_table:
        if not names:
            return path, None
        if all(_how(entries[name]) == _how(entries[names[0]]) for name in names):
            names = names[:1]
    if len(names) != 1:
        of = "" if is_table else f" for {path.name}, which name its parts differently"
        raise ShareGptError(f"{info} has the datasets {_listed(names)}{of}; name one of them")
    return _entry(info, names[0], entries[names[0]])


def _listed(names: Iterable[str]) -> str:
    return ", ".join(names)[:300] or "-"


def _how(entry: Mapping[str, Any]) -> list[Any]:
    """What an entry says of its file, but for its name."""
    return [entry.get(key) for key in ("formatting", "columns", "tags")]


def _entries(file: Path) -> Mapping[str, Any]:
    data = parse_json(read_text(file), file)
    if not isinstance(data, dict):
        raise ShareGptError(f"{file}: a table of datasets is expected")
    return data


def _entry(file: Path, name: str, entry: Any) -> tuple[Path, Columns]:
    if not isinstance(entry, Mapping) or not isinstance(entry.get("file_name"), str):
        raise ShareGptError(f"{file}: the dataset {name!r:.80} has no file_name")
    kind = entry.get("formatting", "alpaca")
    if kind not in ("sharegpt", "openai"):
        raise ShareGptError(
            f"{file}: the dataset {name!r:.80} has the formatting {kind!r:.40}; er-gym reads "
            "sharegpt"
        )
    told: dict[str, Any] = {"images": (), "system": "", "told_by": file.name}
    for table, names in (("columns", _COLUMNS), ("tags", _TAGS)):
        given = entry.get(table)
        if not isinstance(given, Mapping | None):
            raise ShareGptError(
                f"{file}: the {table} of the dataset {name!r:.80} are {given!r:.60}; give an object"
            )
        for key, value in (given or {}).items():
            if key in names and value is not None:
                if not isinstance(value, str):
                    raise ShareGptError(
                        f"{file}: {table}.{key} of the dataset {name!r:.80} is {value!r:.60}; give "
                        "a name"
                    )
                told[names[key]] = (value,) if key == "images" else value
    return file.parent / entry["file_name"], replace(OLDER, **told)


def _guessed(items: JsonItems) -> Columns:
    """The columns by the first sample that has known ones."""
    looked_at = (items.look(index)[0] for index in range(min(len(items), _LOOKED_AT)))
    columns = next(filter(None, map(guessed_columns, looked_at)), None)
    if columns is None:
        first = items[0]
        has = ", ".join(first)[:100] if isinstance(first, dict) else type(first).__name__
        raise ShareGptError(
            f"{items.path} has neither messages with role and content nor conversations with from "
            f"and value; its first item has: {has or '-'}; put a {INFO} beside it that names its "
            "columns"
        )
    return columns


def _first_pictures(items: JsonItems, columns: Columns) -> list[str]:
    """The paths of pictures by which it is found out where they are."""
    paths = (
        path
        for index in range(min(len(items), _LOOKED_AT))
        for path in _sample(items, index, columns).images
    )
    return list(dict.fromkeys(paths))[:_LOOKED_AT]
