"""Turns ShareGPT files into a collection of trajectories: for statistics, for looking at them, and
to export them again.

Such a file has no poses, views, key actions, object ids and rewards. These fields stay empty, so
the trajectories cannot be replayed.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

import er_gym
from er_gym.data.chat import Chat, ChatTurn
from er_gym.data.collection import Collection, CollectionManifest
from er_gym.data.exports.paper_reader import PURPOSE
from er_gym.data.parse_conversation import UserMessage, language_of, thoughts_of, user_message
from er_gym.data.picture_folder import PictureFolder, PicturesElsewhere, picture_name
from er_gym.data.sharegpt_files import ShareGptFile
from er_gym.data.sharegpt_report import decision
from er_gym.data.trajectory import Language, PictureRecord, Trajectory, Turn
from er_gym.tasks import verbs
from er_gym.tasks.types import BY_NAME
from er_gym.writing import file_stem, replaced, whole_folder

SOURCE = "imported"
"""The name of the suite of imported collections, and the key of their settings."""
PLAIN, FEEDBACK = "plain", "feedback"
"""The parts: trajectories without and with ``<|feedback|>``; in the paper's file the latter are
those of the third stage."""
LEFT_OUT = "left_out.jsonl"
"""The file of an imported collection that names each sample that was left out, and why."""
_AROUND = ("right", "behind", "left")
_ROOM = re.compile(r"FloorPlan\d+(?!\d)")
_KIND = re.compile(r"_([abc])(?:/|\Z)")
Progress = Callable[[int, int], None]


class ImportFailed(ValueError):
    """A file cannot be imported; the message says why and what to do, in one line."""


@dataclass(frozen=True)
class ImportSummary:
    """What was imported.

    Attributes:
        samples, trajectories: how many samples were read, and how many trajectories they gave: the
            samples of er-gym's export that repeat the beginning of a trajectory give one.
        parts: part to the number of trajectories.
        turns, trained_turns, pictures: of the trajectories.
        without_scene: how many name no room.
        left_out: how many samples had problems; the collection's :data:`LEFT_OUT` names each.
        outside: how many pictures lie outside the folder that their paths are relative to, links
            resolved, and where the first of them does.
    """

    samples: int
    trajectories: int
    parts: dict[str, int]
    turns: int
    trained_turns: int
    pictures: int
    without_scene: int
    left_out: int
    outside: PicturesElsewhere


def import_sharegpt(
    file: ShareGptFile,
    out: Path,
    *,
    copy: bool = False,
    progress: Progress = lambda done, total: None,
) -> ImportSummary:
    """Write the conversations of a file as a collection.

    All of it is written, or nothing (:func:`er_gym.writing.whole_folder`). Memory does not grow
    with the file, but for the ids. Nothing outside ``out`` is opened for writing.

    Args:
        file: opened with ``decisions=True``, so that every reply ends in a known action.
        out: the collection; it may be there if it is empty.
        copy: copy pictures instead of linking them.
        progress: is called after each sample with the number done and the total.

    Raises:
        ForeignFile: ``out`` is not empty.
        ShareGptError: a picture cannot be read.
        OSError: something cannot be written.
    """
    counts: Counter[str] = Counter()
    with whole_folder(out) as draft:
        picture_folder = PictureFolder(draft, copy=copy)
        collection = Collection.create(draft, _manifest(file))
        collection.write(_trajectories(file, picture_folder, counts, progress))
        left_out = _write_left_out(file, draft)
    return ImportSummary(
        samples=len(file),
        trajectories=counts["trajectories"],
        parts={part: counts[part] for part in (PLAIN, FEEDBACK) if counts[part]},
        turns=counts["turns"],
        trained_turns=counts["trained"],
        pictures=counts["pictures"],
        without_scene=counts["without scene"],
        left_out=left_out,
        outside=picture_folder.outside,
    )


def trajectory_of(chat: Chat) -> Trajectory:
    """The trajectory of a conversation.

    Raises:
        ImportFailed: a reply ends in no known action.
    """
    said = [turn for turn in chat.turns if turn.role != "system"]
    users, replies = said[::2], said[1::2]
    blind = not chat.pictures
    heard = [
        user_message(user.text, first=not index, shows=bool(user.pictures) or blind)
        for index, user in enumerate(users)
    ]
    language = heard[0].language or language_of("".join(reply.text for reply in replies))
    turns: list[Turn] = []
    for index, (user, reply) in enumerate(zip(users, replies, strict=True)):
        after = heard[index + 1] if index + 1 < len(heard) else UserMessage()
        turns.append(_turn(chat.id, index, user, reply, after, language, turns))
    ended = turns[-1].verb == verbs.END
    where = f"{chat.id}/{chat.pictures[0].path if chat.pictures else ''}"
    room = _ROOM.search(where)
    kind = _KIND.search(str(PurePosixPath(where).parent))
    failed = any("<|feedback|>" in user.text for user in users)
    return Trajectory(
        id=chat.id,
        task_id=chat.id,
        task_type=_task_type(where),
        scene=room[0] if room else "",
        instruction=heard[0].task,
        name=heard[0].task,
        key_actions=[],
        seed=0,
        part=FEEDBACK if failed else PLAIN,
        kind=kind[1] if kind else "played",
        language=language,
        actor=SOURCE,
        max_steps=len(turns),
        turns=turns,
        success=ended,
        end_reason="end" if ended else "unknown",
    )


def _turn(
    chat_id: str,
    index: int,
    user: ChatTurn,
    reply: ChatTurn,
    after: UserMessage,
    language: Language,
    before: list[Turn],
) -> Turn:
    action = decision(reply.text)
    if action is None:
        raise ImportFailed(
            f"{chat_id}: reply {index} ends in {reply.text[-40:]!r}, which is no known action in "
            "<DecisionMaking>; leave such samples out"
        )
    looked = bool(before) and before[-1].verb == verbs.OBSERVE
    around = _AROUND if looked and len(user.pictures) == len(_AROUND) else ()
    return Turn(
        pictures=[
            picture.model_copy(update={"direction": direction})
            for picture, direction in zip(
                user.pictures, around or ("ahead",) * len(user.pictures), strict=True
            )
        ],
        purpose=PURPOSE.get(action.verb, "use"),
        thoughts=thoughts_of(reply.text, language, first=not index),
        verb=action.verb,
        object_type=action.object_type,
        success=not after.failed,
        feedback=after.feedback,
        train=reply.train,
    )


def _task_type(where: str) -> str:
    """The type of task that a path or an id names, ``""`` for none."""
    for part in re.split(r"[/\\]", where):
        named = part.removeprefix("data_")
        inside = [name for name in BY_NAME if name.replace(" ", "_") in named]
        if inside:
            return max(inside, key=len)
    return ""


# -- writing ---------------------------------------------------------------------------------------


def _trajectories(
    file: ShareGptFile, picture_folder: PictureFolder, counts: Counter[str], progress: Progress
) -> Iterator[Trajectory]:
    names = _Names(file)
    for chat in _whole(file, progress):
        trajectory = trajectory_of(chat).model_copy(update={"id": names.of(chat.id)})
        trajectory = _with_pictures(trajectory, file.folder, picture_folder)
        counts["trajectories"] += 1
        counts[trajectory.part] += 1
        counts["turns"] += len(trajectory.turns)
        counts["trained"] += sum(turn.train for turn in trajectory.turns)
        counts["pictures"] += trajectory.pictures
        counts["without scene"] += not trajectory.scene
        yield trajectory


def _whole(file: ShareGptFile, progress: Progress) -> Iterator[Chat]:
    """The conversations; of neighbours with one id, each going on where the last ends, the last,
    in which all is learnt that any of them teaches."""
    last: Chat | None = None
    for number, chat in enumerate(file, 1):
        if last is not None and _continues(chat, last):
            turns = [
                turn if place >= len(last.turns) or not last.turns[place].train
                else ChatTurn(turn.role, turn.parts, True)
                for place, turn in enumerate(chat.turns)
            ]  # fmt: skip
            last = Chat(chat.id, tuple(turns), chat.reply_told)
        else:
            if last is not None:
                yield last
            last = chat
        progress(number, len(file))
    if last is not None:
        yield last


def _continues(chat: Chat, last: Chat) -> bool:
    if chat.id != last.id or len(chat.turns) <= len(last.turns):
        return False
    pairs = zip(chat.turns, last.turns, strict=False)
    return all((one.role, one.parts) == (other.role, other.parts) for one, other in pairs)


class _Names:
    """Ids that no two trajectories share, not even as file names: those of the file where it names
    each once; ``x-2`` and so on where it has several ``x``, unless it has an ``x-2`` of its own."""

    def __init__(self, file: ShareGptFile) -> None:
        self._file = file
        self._given: set[str] = set()
        self._theirs: set[str] | None = None
        """The ids of the file, as file names; read when two are first the same."""

    def of(self, name: str) -> str:
        """The id of the next trajectory of this name."""
        found, number = name, 1
        while file_stem(found) in self._given or (number > 1 and file_stem(found) in self._taken):
            number += 1
            found = f"{name}-{number}"
        self._given.add(file_stem(found))
        return found

    @property
    def _taken(self) -> set[str]:
        if self._theirs is None:
            self._theirs = {file_stem(each) for each in self._file.ids()}
        return self._theirs


def _with_pictures(
    trajectory: Trajectory, folder: Path, picture_folder: PictureFolder
) -> Trajectory:
    number = 0
    turns: list[Turn] = []
    under = PurePosixPath("pictures", file_stem(trajectory.id))
    for turn in trajectory.turns:
        pictures: list[PictureRecord] = []
        for picture in turn.pictures:
            path = under / picture_name(f"{number:03}", picture)
            picture_folder.place(folder / picture.path, path, within=folder)
            pictures.append(picture.model_copy(update={"path": str(path)}))
            number += 1
        turns.append(turn.model_copy(update={"pictures": pictures}))
    return trajectory.model_copy(update={"turns": turns})


def _write_left_out(file: ShareGptFile, out: Path) -> int:
    """Name each sample that is left out, and why; returns how many there are."""
    count = 0
    if not file.report.unsound:
        return 0
    with replaced(out / LEFT_OUT) as lines:
        lines.write(json.dumps({"format": "er-gym/left-out/1", "file": file.path.name}) + "\n")
        for each in file.left_out():
            lines.write(json.dumps(each, ensure_ascii=False) + "\n")
            count += 1
    return count


def _manifest(file: ShareGptFile) -> CollectionManifest:
    with file.path.open("rb") as content:
        digest = hashlib.sha256()
        while block := content.read(1 << 20):
            digest.update(block)
    settings: dict[str, Any] = {SOURCE: {"file": file.path.name, "samples": len(file)}}
    return CollectionManifest(
        suite=SOURCE,
        suite_digest=digest.hexdigest(),
        settings=settings,
        seed=0,
        er_gym=er_gym.__version__,
    )
