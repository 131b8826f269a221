"""Reads the paper's raw trajectories (:mod:`er_gym.data.exports.paper` says how they are laid out).

Two fields that the layout lacks are inferred: an action was done unless the turn after it has no
picture, and it earned a key action's reward if it is that key action.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path, PurePosixPath
from typing import Any

from pydantic import BaseModel, ConfigDict

from er_gym.data.exports.paper import ANGLES, DECISION, INIT, OBSERVE, VERIFY
from er_gym.data.pictures import picture_size
from er_gym.data.trajectory import (
    TAG_OF_KIND,
    PictureRecord,
    Purpose,
    ThoughtRecord,
    Trajectory,
    Turn,
)
from er_gym.envs.actions import Action, parse
from er_gym.rollout.records import KeyActionRecord
from er_gym.tasks import verbs
from er_gym.tasks.errors import TaskFileError
from er_gym.tasks.files import known_scene, known_type, validated
from er_gym.tasks.paper_records import PaperAction
from er_gym.tasks.paper_records import key_actions as read_key_actions
from er_gym.tasks.reading import parse_json, read_text

_KIND_OF_TAG = {tag: kind for kind, tag in TAG_OF_KIND.items()}
_TAGGED = re.compile(rf"<({DECISION}|{'|'.join(_KIND_OF_TAG)})>(.*?)</\1>", re.DOTALL)
_PICTURE = re.compile(r"(\d+)_(.+)", re.DOTALL)
_DIRECTION = {f"{angle}_{OBSERVE}": direction for direction, angle in ANGLES.items()}
_STEP_LIMIT = "too many round"
PURPOSE: dict[str, Purpose] = {
    verbs.NAVIGATE: "search",
    verbs.PICKUP: "take",
    verbs.PUT: "put",
    verbs.OPEN: "open to look",
    verbs.CLOSE: "close again",
    verbs.TOGGLE: "switch",
    verbs.OBSERVE: "look around",
    verbs.MOVE_FORWARD: "get closer",
    verbs.END: "finish",
}


class _Metadata(BaseModel):
    model_config = ConfigDict(extra="allow")

    taskname: str = ""
    actions: list[PaperAction]


class _Item(BaseModel):
    """The one element of a file; what is not named here is not read."""

    model_config = ConfigDict(extra="allow")

    scene: str
    tasktype: str
    taskname: str
    trajectory: list[str]
    images: list[str]
    flag: str = ""
    task_metadata: _Metadata


def read_paper(root: Path) -> Iterator[Trajectory]:
    """The trajectories of a folder, in the order of their paths, one at a time.

    The paths of their pictures are relative to ``root``. The id is the name of the folder.

    Raises:
        TaskFileError: a file is damaged, or there is none; the message says which and why.
    """
    files = sorted(root.glob("data_*/*/*.json"))
    if not files:
        raise TaskFileError(
            f"{root} holds none of the paper's raw trajectories (data_TYPE/NAME/NAME.json)"
        )
    for file in files:
        yield read_trajectory(file, root)


def read_trajectory(file: Path, root: Path) -> Trajectory:
    """The trajectory of one JSON file; see :func:`read_paper`."""
    data = parse_json(read_text(file), file)
    if not isinstance(data, list) or len(data) != 1:
        raise TaskFileError(f"{file}: the file is a list of one trajectory")
    item = validated(_Item, data[0], f"{file}:")
    where = str(file)
    kind = known_type(item.tasktype, where)
    keys = read_key_actions(item.task_metadata.actions, where)
    records = [
        KeyActionRecord(
            verb=key.verb, object_id=key.object_id, object_type=key.object_type, reward=key.reward
        )
        for key in keys
    ]
    related = {each for key in keys for each in key.related_objects}
    targets = sorted(each for each in related if "|" not in each) if kind.search else []
    pictures = _pictures(item.images, file, root)
    turns = _turns(item, pictures, where)
    success = not item.flag
    return Trajectory(
        id=file.parent.name,
        task_id=file.parent.name,
        task_type=kind.name,
        scene=known_scene(item.scene, where),
        instruction=item.taskname,
        name=item.task_metadata.taskname or item.taskname,
        key_actions=records,
        search_targets=targets,
        seed=0,
        kind=file.parent.name.rpartition("_")[2],
        actor="paper",
        max_steps=max(kind.max_steps, len(turns) + 1),
        turns=_with_rewards(turns, records, success),
        success=success,
        end_reason="end" if turns[-1].verb == verbs.END else _reason(item.flag),
    )


def _reason(flag: str) -> str:
    return "step limit" if flag == _STEP_LIMIT else flag


class _Shown(BaseModel):
    """A picture, its turn, and the object in its name."""

    turn: int
    record: PictureRecord
    object_id: str = ""
    checks: bool = False


def _pictures(images: Sequence[str], file: Path, root: Path) -> list[_Shown]:
    """The pictures in order. They lie beside the file, whatever the paths before their names."""
    shown: list[_Shown] = []
    for path in images:
        name = PurePosixPath(path.replace("\\", "/")).name
        found = _PICTURE.fullmatch(PurePosixPath(name).stem if "|" not in name else _stem(name))
        picture = file.parent / name
        if found is None or not picture.is_file():
            raise TaskFileError(f"{file}: the picture {path!r} is not there, or has no number")
        number, rest = int(found[1]), found[2]
        width, height = picture_size(picture)
        record = PictureRecord(
            path=str(PurePosixPath(picture.relative_to(root))),
            direction=_DIRECTION.get(rest, "ahead"),
            width=width,
            height=height,
        )
        checks = rest.endswith(f"_{VERIFY}")
        about_object = "|" in rest and not checks and rest not in (INIT, *_DIRECTION)
        shown.append(
            _Shown(
                turn=number + checks,
                record=record,
                object_id=rest if about_object else "",
                checks=checks,
            )
        )
    return shown


def _stem(name: str) -> str:
    """A name without its ending; ids have points too."""
    return re.sub(r"\.(?:png|jpe?g|webp)$", "", name, flags=re.IGNORECASE)


def _turns(item: _Item, pictures: Sequence[_Shown], where: str) -> list[Turn]:
    turns: list[dict[str, Any]] = []
    thoughts: list[ThoughtRecord] = []
    for tag, text in _TAGGED.findall("\n".join(item.trajectory)):
        if tag != DECISION:
            thoughts.append(ThoughtRecord(kind=_KIND_OF_TAG[tag], text=text, writer="paper"))
            continue
        action = parse(text.strip().strip("."))
        if action is None:
            raise TaskFileError(f"{where}: the decision {text!r:.80} names no known action")
        turns.append(_turn(action, thoughts))
        thoughts = []
    if not item.flag and (not turns or turns[-1]["verb"] != verbs.END):
        turns.append(_turn(Action(verbs.END), thoughts))
    if not turns:
        raise TaskFileError(f"{where}: the trajectory has no decision")
    for shown in pictures:
        if shown.turn >= len(turns):
            continue  # what the last action led to; nothing was decided on it
        turns[shown.turn]["pictures"].append(shown.record)
        if shown.turn and shown.object_id:
            turns[shown.turn - 1]["object_id"] = shown.object_id
        if shown.turn and shown.checks:
            turns[shown.turn - 1]["purpose"] = "check"
    for index, turn in enumerate(turns):
        turn["success"] = index + 1 == len(turns) or bool(turns[index + 1]["pictures"])
    turns[-1]["success"] = not item.flag
    return [Turn.model_validate(turn) for turn in turns]


def _turn(action: Action, thoughts: Sequence[ThoughtRecord]) -> dict[str, Any]:
    return {
        "pictures": [],
        "purpose": PURPOSE.get(action.verb, "use"),
        "thoughts": list(thoughts),
        "verb": action.verb,
        "object_type": action.object_type,
    }


def _with_rewards(
    turns: Sequence[Turn], keys: Sequence[KeyActionRecord], success: bool
) -> list[Turn]:
    """The turns with what each earned: the reward of the first key action left that it did."""
    left = list(keys)
    found: list[Turn] = []
    for turn in turns:
        done = next((key for key in left if turn.success and _does(turn, key, success)), None)
        if done is not None:
            left.remove(done)
            turn = turn.model_copy(update={"reward": float(done.reward)})
        found.append(turn)
    return found


def _does(turn: Turn, key: KeyActionRecord, success: bool) -> bool:
    if turn.verb != key.verb:
        return False
    if turn.verb == verbs.END:
        return success
    ids = turn.object_id and turn.object_id == key.object_id
    return bool(ids) or turn.object_type == (key.object_type or key.object_id.partition("|")[0])
