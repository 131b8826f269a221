"""The paper's raw trajectories: a folder for each, with one JSON file and the pictures.

::

    data_single_search/FloorPlan1_single_search_0_a/FloorPlan1_single_search_0_a.json
    data_single_search/FloorPlan1_single_search_0_a/0_init_observe.jpeg
    data_single_search/FloorPlan1_single_search_0_a/1_CounterTop|-00.08|+01.15|00.00.jpeg

``trajectory`` is a list of texts in tags: the thoughts and decisions in order. The paper's data
engine does not write the final ``end``, and neither does this one where the task is done. A picture
is named after its turn, from 0, and the object of the action before. ``1_left_90_observe``,
``1_right_90_observe`` and ``1_left_180_observe`` are what is seen to the left, right and behind
after ``observe``; ``1_more_2`` is one more picture of turn 1. ``2_ID_verify`` is shown at turn 3,
after a step taken to check. A turn after an action that was not done has no picture.
:mod:`er_gym.data.exports.paper_reader` reads such folders.

The layout has no place for results, feedback, faults, views, plans, and whether a turn is learnt.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from pathlib import PurePosixPath
from typing import Any

from er_gym.data.dialects import without_markup
from er_gym.data.exports.base import ExportFormat, ExportJob
from er_gym.data.picture_folder import picture_name
from er_gym.data.trajectory import TAG_OF_KIND, PictureRecord, Trajectory, Turn
from er_gym.rollout.records import KeyActionRecord
from er_gym.tasks import verbs
from er_gym.tasks.room_kinds import room_kind
from er_gym.writing import file_stem, write_atomic

DECISION = "DecisionMaking"
INIT, OBSERVE, VERIFY, MORE = "init_observe", "observe", "verify", "more"
ANGLES = {"left": "left_90", "right": "right_90", "behind": "left_180"}
"""How the views after ``observe`` are named: by the turn of the body."""
FLAG_OF_REASON = {"step limit": "too many round"}
_NOT_IN_IDS = re.compile(r"[^\w|+.,() -]")
_LONGEST_ID = 120
"""AI2-THOR's ids are shorter; file systems allow 255 bytes of a name."""
FAILED = "error end"
"""The flags of an episode that was not a success; others have ``""``."""


def _write(job: ExportJob) -> None:
    numbers: Counter[tuple[str, str]] = Counter()
    for split, trajectory in job.trajectories():
        try:
            room_kind(trajectory.scene)
        except ValueError:
            job.leave_out("its scene is no room of iTHOR")
            continue
        job.take(trajectory)
        kind = trajectory.task_type.replace(" ", "_")
        key = (trajectory.scene, kind)
        name = file_stem(f"{trajectory.scene}_{kind}_{numbers[key]}_{trajectory.kind}")
        folder = job.new_folder(PurePosixPath(split, file_stem(f"data_{kind}")), name)
        images: list[str] = []
        stems: set[str] = set()
        for index, turn in enumerate(trajectory.turns):
            for picture in turn.pictures:
                stem = _picture_name(trajectory.turns, index, picture)
                if stem in stems:
                    stem = f"{index}_{MORE}_{len(stems)}"
                stems.add(stem)
                path = folder / picture_name(stem, picture)
                job.place(picture, job.folder / path)
                images.append(str(path.relative_to(split)))
        item = _item(trajectory, numbers[key], images)
        text = json.dumps([item], indent=4, ensure_ascii=False) + "\n"
        (job.folder / folder).mkdir(parents=True, exist_ok=True)
        write_atomic(job.folder / folder / f"{folder.name}.json", text)
        numbers[key] += 1
        job.add(split, len(images))


def _item(trajectory: Trajectory, number: int, images: list[str]) -> dict[str, Any]:
    kind = room_kind(trajectory.scene).replace(" ", "_")
    flag = "" if trajectory.success else FLAG_OF_REASON.get(trajectory.end_reason, FAILED)
    return {
        "scene": trajectory.scene,
        "tasktype": trajectory.task_type,
        "instruction_idx": number,
        "taskname": trajectory.instruction,
        "trajectory": _texts(trajectory, flag),
        "images": images,
        "flag": flag,
        "time": 0,
        "task_metadata": {
            "taskname": trajectory.name,
            "tasktype": trajectory.task_type,
            "metadatapath": f"taskgenerate/{kind}s/{trajectory.scene}/metadata.json",
            "actions": [_action(key, trajectory) for key in trajectory.key_actions],
            "totalreward": sum(key.reward for key in trajectory.key_actions),
        },
    }


def _action(key: KeyActionRecord, trajectory: Trajectory) -> dict[str, Any]:
    return {
        "action": key.spelled or key.verb,
        "objectId": key.object_id,
        "objectType": key.object_type,
        "baseaction": "",
        "reward": key.reward,
        "relatedObject": [*filter(None, [key.object_id]), *trajectory.search_targets],
    }


def _texts(trajectory: Trajectory, flag: str) -> list[str]:
    texts: list[str] = []
    last = len(trajectory.turns) - 1
    for index, turn in enumerate(trajectory.turns):
        for thought in turn.thoughts:
            texts.append(_tagged(TAG_OF_KIND[thought.kind], without_markup(thought.text)))
        if not (index == last and turn.verb == verbs.END and not flag):
            texts.append(_tagged(DECISION, str(turn.action)))
    return texts


def _tagged(tag: str, text: str) -> str:
    return f"<{tag}>{text}</{tag}>"


def _picture_name(turns: list[Turn], index: int, picture: PictureRecord) -> str:
    if index == 0:
        return f"0_{INIT}"
    if picture.direction in ANGLES:
        return f"{index}_{ANGLES[picture.direction]}_{OBSERVE}"
    last = turns[index - 1]
    if last.purpose == "check":
        done = (turn.object_id for turn in reversed(turns[: index - 1]) if turn.object_id)
        return f"{index - 1}_{_part(next(done, ''))}_{VERIFY}"
    return f"{index}_{_part(last.object_id or last.object_type or last.verb)}"


def _part(name: str) -> str:
    """An object's id as a part of a file's name."""
    return _NOT_IN_IDS.sub("_", name)[:_LONGEST_ID]


PAPER = ExportFormat(
    name="paper",
    about="the paper's raw trajectories: a folder each, with JSON and pictures",
    write=_write,
    usage="""\
```python
from pathlib import Path
from er_gym.data.exports.paper_reader import read_paper

for trajectory in read_paper(Path("THIS FOLDER") / "train"):
    ...
```

`train`[[, and so `validation`,]] holds `data_TYPE/SCENE_TYPE_NUMBER_KIND/`, each with one
JSON file, a list of one element, and the pictures. Dialect and language do not matter here.
""",
)
