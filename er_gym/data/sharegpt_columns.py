"""The samples of a ShareGPT file, whatever its parts are called and wherever its pictures stand."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import NoneType
from typing import Any

from er_gym.data.chat import IMAGE, Role
from er_gym.data.sharegpt_report import Sample

PICTURE_KEYS = ("images", "image")
"""Where the pictures of a sample stand, in files that do not say what their parts are called."""
_PATH_KEYS = ("path", "image", "image_url", "url", "file_name")
"""What the path of a picture is called where it stands in an object of its own."""
_ALSO: Mapping[str, Role] = {
    "user": "user", "human": "user", "assistant": "assistant", "gpt": "assistant",
    "system": "system",
}  # fmt: skip
"""How speakers are called, beside what the columns say."""
_LIKE_PICTURES = re.compile(r"im(?:age|g)|pic(?:ture)?|photo|frame|visual", re.IGNORECASE)
_MOST_KEYS = 100
_KINDS: Mapping[type, str] = {
    NoneType: "null", bool: "true or false", str: "a text", list: "a list",
}  # fmt: skip
"""What else a sample may be, but for numbers."""


@dataclass(frozen=True)
class Columns:
    """What the parts of a sample are called; the defaults are those of messages as OpenAI has them.

    Attributes:
        messages, system: keys of a sample; ``""`` for none.
        images: keys of a sample's pictures; the first that has as many as the texts have places
            counts. Empty if it has none.
        role, content: keys of a message.
        user, assistant, system_role: values of ``role``.
        told_by: the file that says so; ``""`` if they are guessed.
    """

    messages: str = "messages"
    images: tuple[str, ...] = PICTURE_KEYS
    system: str = ""
    role: str = "role"
    content: str = "content"
    user: str = "user"
    assistant: str = "assistant"
    system_role: str = "system"
    told_by: str = ""


OLDER = Columns("conversations", PICTURE_KEYS, "system", "from", "value", "human", "gpt")
"""The columns of the first ShareGPT files, and LLaMA-Factory's defaults."""


def guessed_columns(first: object) -> Columns | None:
    """The columns of a file, by its first sample; None if it has none that are known."""
    if not isinstance(first, dict):
        return None
    for messages in ("messages", "conversations"):
        talk = first.get(messages)
        head = talk[0] if isinstance(talk, list) and talk else None
        for one in (Columns(), OLDER):
            if isinstance(head, dict) and one.role in head and one.content in head:
                return Columns(
                    messages, one.images, one.system, one.role, one.content, one.user, one.assistant
                )
    return None


def sample_of(item: object, columns: Columns) -> Sample:
    """A sample by the names of its columns; :attr:`Sample.wrong` says what is wrong with it."""
    if not isinstance(item, dict):
        return Sample(wrong=f"{_KINDS.get(type(item), 'a number')}, not an object")
    name = item.get("id")
    told = str(name) if isinstance(name, str | int) else ""
    try:
        return _read(item, columns, told)
    except _Wrong as wrong:
        return Sample(id=told, wrong=str(wrong))


class _Wrong(Exception):
    """What is wrong with a sample."""


def _read(item: Mapping[str, Any], columns: Columns, told: str) -> Sample:
    messages = item.get(columns.messages)
    if not isinstance(messages, list) or not messages:
        raise _Wrong(f"no list {columns.messages!r:.60}; it has {_keys(item)}")
    known: dict[str, Role] = {
        **_ALSO,
        columns.user: "user",
        columns.assistant: "assistant",
        columns.system_role: "system",
    }
    roles: list[Role] = []
    texts: list[str] = []
    shown: list[str] = []
    system = item.get(columns.system) if columns.system else ""
    if isinstance(system, str) and system:
        roles.append("system")
        texts.append(system)
    flags: list[bool] = []
    for number, message in enumerate(messages):
        if not isinstance(message, dict):
            raise _Wrong(f"message {number} is no object")
        said = message.get(columns.role)
        role = known.get(said) if isinstance(said, str) else None
        if role is None:
            raise _Wrong(f"message {number} has the unknown {columns.role:.60} {repr(said)[:60]}")
        text, within = _text(message.get(columns.content), number, columns.content)
        roles.append(role)
        texts.append(text)
        shown += within
        if role == "assistant":
            loss = message.get("loss")
            if loss not in (True, False, None):  # 1 and 0 are equal to the first two
                raise _Wrong(f"message {number} has the loss {repr(loss)[:60]}; give true or false")
            flags.append(loss in (True, None))
    places = sum(text.count(IMAGE) for text in texts)
    found, key = (shown, columns.content) if shown else _images(item, columns, places)
    return Sample(
        id=told,
        roles=tuple(roles),
        texts=tuple(texts),
        images=tuple(found),
        train=tuple(flags) if any("loss" in message for message in messages) else (),
        images_in=key or _no_images(item, columns),
    )


def _text(content: object, number: int, name: str) -> tuple[str, list[str]]:
    """The text of a message, with the places of its pictures, and the paths that stand in it."""
    if isinstance(content, str):
        return content, []
    if not isinstance(content, list):
        raise _Wrong(f"message {number} has no text {name!r:.60}")
    parts, paths = [], []
    for part in content:
        kind = part.get("type") if isinstance(part, dict) else ""
        if isinstance(part, dict) and kind == "text" and isinstance(part.get("text"), str):
            parts.append(part["text"])
        elif isinstance(part, dict) and kind in ("image", "image_url"):
            parts.append(IMAGE)
            if path := _path({key: value for key, value in part.items() if key != "type"}):
                paths.append(path)
        else:
            raise _Wrong(f"message {number} has a part that is neither text nor image")
    return "".join(parts), paths


def _images(item: Mapping[str, Any], columns: Columns, places: int) -> tuple[Sequence[str], str]:
    """The paths of the pictures, and the key under which they stand."""
    there = {key: item[key] for key in columns.images if item.get(key) not in (None, "", [])}
    found: dict[str, list[str]] = {}
    for key, value in there.items():
        paths = [_path(each) for each in (value if isinstance(value, list) else [value])]
        if None in paths:
            raise _Wrong(f"{key!r:.60} is no list of paths")
        found[key] = [path for path in paths if path is not None]
    fitting = (key for key, paths in found.items() if len(paths) == places)
    key = next(fitting, next(iter(found), ""))
    return found.get(key, []), key


def _path(told: object) -> str | None:
    """The path of a picture, told as a text or in an object; None if there is none."""
    if isinstance(told, str):
        return told
    if isinstance(told, dict):
        for key in _PATH_KEYS:
            if found := _path(told.get(key)):
                return found
    return None


def _no_images(item: Mapping[str, Any], columns: Columns) -> str:
    """Why a sample has no pictures."""
    if not columns.images:
        why = f"{columns.told_by} names no column of pictures"
    else:
        why = f"nothing in {' or '.join(map(repr, columns.images)):.100}"
    like = [key for key in _first(item) if _LIKE_PICTURES.search(key) and item[key]]
    return f"{why}; the sample has {', '.join(map(repr, like))[:100] or _keys(item)}"


def _keys(item: Mapping[str, Any]) -> str:
    return ", ".join(_first(item))[:100] or "-"


def _first(item: Mapping[str, Any]) -> Iterator[str]:
    return (key for _, key in zip(range(_MOST_KEYS), item, strict=False))
