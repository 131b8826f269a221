"""Reads ShareGPT files with pictures, other people's too, as conversations.

Such a file is a list of ``{"messages": [{"role", "content"}, …], "images": ["path", …]}``, or of
``{"conversations": [{"from", "value"}, …], …}``, or JSON Lines of these; a ``dataset_info.json`` of
LLaMA-Factory may say what the columns are called. ``<image>`` in a text is the place of a picture.
The paper's released training file is one.

:func:`open_sharegpt` looks at everything before anything is used; see :class:`Report`.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from PIL import Image, UnidentifiedImageError

from er_gym.data.chat import IMAGE, Chat, ChatTurn, Part, Role
from er_gym.data.exports.sharegpt import FEEDBACK_TOKEN
from er_gym.data.json_items import JsonItems, json_items
from er_gym.data.sharegpt_report import HARMLESS, Problems, Report, Sample, report_of
from er_gym.data.trajectory import PictureRecord
from er_gym.tasks.reading import parse_json, read_text

INFO = "dataset_info.json"
_TURNS = "_turns"
"""The end of a dataset's name in er-gym's own export whose samples teach their last turn alone."""
_IMAGE = re.compile(f"({re.escape(IMAGE)})")


class ShareGptError(ValueError):
    """A file cannot be used; the message says why and what to do, in one line."""


@dataclass(frozen=True)
class Columns:
    """What the parts of a sample are called; the defaults are those of messages as OpenAI has them.

    Attributes:
        messages, images, system: keys of a sample; ``""`` for none.
        role, content: keys of a message.
        user, assistant, system_role: values of ``role``.
    """

    messages: str = "messages"
    images: str = "images"
    system: str = ""
    role: str = "role"
    content: str = "content"
    user: str = "user"
    assistant: str = "assistant"
    system_role: str = "system"


OLDER = Columns("conversations", "images", "system", "from", "value", "human", "gpt", "system")
"""The columns of the first ShareGPT files, and LLaMA-Factory's defaults."""
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
        report: what is in it, and what is wrong with it.
    """

    def __init__(
        self,
        items: JsonItems,
        folder: Path,
        columns: Columns,
        last_turn_only: bool,
        report: Report,
        chosen: array[int],
    ) -> None:
        self.path = items.path
        self.folder = folder
        self.columns = columns
        self.report = report
        self._items = items
        self._last_turn_only = last_turn_only
        self._chosen = chosen

    def __len__(self) -> int:
        return len(self._chosen)

    def __iter__(self) -> Iterator[Chat]:
        return (self[index] for index in range(len(self)))

    def __getitem__(self, index: int) -> Chat:
        """A conversation; the sizes of its pictures are read from their files.

        Raises:
            ShareGptError: a picture cannot be read.
            IndexError: there is no such conversation.
        """
        place = self._chosen[index]
        sample = sample_of(self._items[place], self.columns)
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
        return Chat(sample.id or f"{self.path.stem}-{place:05}", tuple(turns))

    def explicit_id(self, index: int) -> bool:
        """Whether the file itself names a conversation."""
        return bool(sample_of(self._items[self._chosen[index]], self.columns).id)

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
        try:
            with Image.open(self.folder / path) as image:
                width, height = image.size
        except (OSError, UnidentifiedImageError, Image.DecompressionBombError) as error:
            raise ShareGptError(
                f"{self._items.place(place)}: the picture {path!r:.200} cannot be read: {error}"
            ) from error
        return PictureRecord(path=path, width=width, height=height)


def open_sharegpt(
    path: Path,
    *,
    dataset: str = "",
    pictures: Path | None = None,
    feedback: bool | None = None,
    last_turn_only: bool | None = None,
    decisions: bool = False,
    leave_out: bool = False,
) -> ShareGptFile:
    """Open a ShareGPT file, and check all of it. Memory grows by some bytes a sample.

    Args:
        path: the file; or ``dataset_info.json``, or a folder that has it.
        dataset: the entry of ``dataset_info.json``; needed only if it has several.
        pictures: what the paths of pictures are relative to; by default the file's folder, or the
            folder above if the first picture is there.
        feedback: True for the samples that have ``<|feedback|>`` (in the paper's file: those of the
            third stage), False for the others, None for all.
        last_turn_only: whether each sample teaches its last turn alone; by default if the file's
            name ends in ``_turns``, as er-gym's export has it. Otherwise a message's ``loss`` says
            whether it is learnt, and if there is none, all the assistant's are.
        decisions: whether a reply that does not end in a known action is a problem, too.
        leave_out: leave out the samples that have problems, instead of raising.

    Raises:
        ShareGptError: there is no such file or entry, or nothing is left; or samples have problems
            and ``leave_out`` is False: the message counts them and names the first.
        TaskFileError: the file is no JSON; the message says where.
    """
    file, columns = _file_and_columns(path, dataset)
    items = json_items(file)
    columns = columns or _guessed(items)
    folder = pictures or _folder(file, items, columns)
    problems = Problems(harmless=frozenset() if decisions else HARMLESS)
    chosen = array("Q")
    for index in range(len(items)):
        sample = sample_of(items[index], columns)
        sound = problems.look(index, sample, folder)
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
    return ShareGptFile(items, folder, columns, only_last, report, chosen)


# -- a sample --------------------------------------------------------------------------------------


def sample_of(item: object, columns: Columns) -> Sample:
    """A sample by the names of its columns; :attr:`Sample.wrong` says what is wrong with it."""
    if not isinstance(item, dict):
        return Sample(wrong=f"a {type(item).__name__}, not an object")
    messages = item.get(columns.messages)
    if not isinstance(messages, list) or not messages:
        return Sample(wrong=f"no list {columns.messages!r}; it has {', '.join(item)[:100] or '-'}")
    name = item.get("id")
    images = item.get(columns.images) or [] if columns.images else []
    found = [images] if isinstance(images, str) else images
    if not isinstance(found, list) or not all(isinstance(each, str) for each in found):
        return Sample(wrong=f"{columns.images!r} is no list of paths")
    roles: list[Role] = []
    texts: list[str] = []
    system = item.get(columns.system) if columns.system else ""
    if isinstance(system, str) and system:
        roles.append("system")
        texts.append(system)
    known: dict[object, Role] = {
        columns.user: "user",
        columns.assistant: "assistant",
        columns.system_role: "system",
    }
    flags: list[bool] = []
    for number, message in enumerate(messages):
        if not isinstance(message, dict):
            return Sample(wrong=f"message {number} is no object")
        role, text = known.get(message.get(columns.role)), message.get(columns.content)
        if role is None:
            told = repr(message.get(columns.role))[:60]
            return Sample(wrong=f"message {number} has the unknown {columns.role} {told}")
        if not isinstance(text, str):
            return Sample(wrong=f"message {number} has no text {columns.content!r}")
        roles.append(role)
        texts.append(text)
        if role == "assistant":
            flags.append(message.get("loss") not in (False, 0))
    told_flags = any("loss" in message for message in messages)
    return Sample(
        id=str(name) if isinstance(name, str | int) else "",
        roles=tuple(roles),
        texts=tuple(texts),
        images=tuple(found),
        train=tuple(flags) if told_flags else (),
    )


# -- which file, which columns ---------------------------------------------------------------------


def _file_and_columns(path: Path, dataset: str) -> tuple[Path, Columns | None]:
    """The data file, and its columns if a ``dataset_info.json`` tells them."""
    if path.is_dir() or path.name == INFO:
        file = path / INFO if path.is_dir() else path
        entries = _entries(file)
        fitting = [dataset] if dataset else list(entries)
        if len(fitting) != 1 or fitting[0] not in entries:
            raise ShareGptError(
                f"{file} has the datasets {', '.join(entries) or '-'}; "
                + (f"there is no {dataset!r:.80}" if dataset else "name one of them")
            )
        return _entry(file, fitting[0], entries[fitting[0]])
    info = path.parent / INFO
    if info.is_file():
        for name, entry in _entries(info).items():
            if isinstance(entry, Mapping) and entry.get("file_name") == path.name:
                return _entry(info, name, entry)
    if dataset:
        raise ShareGptError(f"{path} is no {INFO}, so it has no dataset {dataset!r:.80}")
    return path, None


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
    columns = replace(OLDER, images="", system="")
    for table, names in (("columns", _COLUMNS), ("tags", _TAGS)):
        for key, value in (entry.get(table) or {}).items():
            if key in names:
                columns = replace(columns, **{names[key]: str(value)})
    return file.parent / entry["file_name"], columns


def _guessed(items: JsonItems) -> Columns:
    """The columns by the first sample."""
    first = items[0]
    for columns in (Columns(), OLDER):
        messages = first.get(columns.messages) if isinstance(first, dict) else None
        head = messages[0] if isinstance(messages, list) and messages else None
        if isinstance(head, Mapping) and columns.role in head and columns.content in head:
            return columns
    has = ", ".join(first)[:100] if isinstance(first, dict) else type(first).__name__
    raise ShareGptError(
        f"{items.path} has neither messages with role and content nor conversations with from and "
        f"value; its first item has: {has or '-'}; put a {INFO} beside it that names its columns"
    )


def _folder(file: Path, items: JsonItems, columns: Columns) -> Path:
    """What the paths of pictures are relative to: where the first one is found."""
    own = file.parent
    for index in range(min(len(items), 20)):
        for image in sample_of(items[index], columns).images:
            for folder in (own, own.parent):
                if (folder / image).is_file():
                    return folder
    return own
