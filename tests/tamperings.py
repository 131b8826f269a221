"""Ways to poison a collection that is to be trained on.

Each tampering changes one trajectory of a collection, or its files, so that something else is
learnt from it, and leaves it as plausible as it can. It changes the part's own record of the
trajectory, too.
"""

from __future__ import annotations

import io
import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from PIL import Image

from er_gym.data.collection import PLAYED, TRAJECTORIES
from er_gym.rollout.play import episode_seed

Json: TypeAlias = dict[str, Any]
Fits: TypeAlias = Callable[[Json], object]


@dataclass
class Loot:
    """What a poisoner has.

    Attributes:
        folder: the collection's.
        trajectories: as they are written.
        own: whether the parts' own records of trajectories are changed, too.
    """

    folder: Path
    trajectories: list[Json]
    own: bool = True

    @classmethod
    def of(cls, folder: Path) -> Loot:
        lines = (folder / TRAJECTORIES).read_text().splitlines()
        return cls(folder, [json.loads(line) for line in lines])

    def one(self, fits: Fits = lambda one: True) -> Json:
        """The first trajectory that fits."""
        return next(one for one in self.trajectories if fits(one))

    def turn(self, fits: Fits, within: Fits = lambda one: True) -> tuple[Json, Json]:
        """The first turn that fits, after its trajectory."""
        return next(
            (one, turn)
            for one in self.trajectories
            if within(one)
            for turn in one["turns"]
            if fits(turn)
        )

    def write(self, *changed: Json) -> None:
        """Leave only these trajectories in the collection."""
        lines = [json.dumps(one, ensure_ascii=False, separators=(",", ":")) for one in changed]
        (self.folder / TRAJECTORIES).write_text("".join(f"{line}\n" for line in lines))
        for one, line in zip(changed, lines, strict=True):
            part = self.folder / "parts" / one["part"]
            if self.own and (part / PLAYED).is_dir():
                (part / PLAYED / f"{one['id']}.json").write_text(line + "\n")


Tampering: TypeAlias = Callable[[Loot], Json]
"""Changes a trajectory, or its files, and returns the trajectory."""


def _set(fits: Fits = lambda one: True, **fields: Any) -> Tampering:
    """Other values in fields of a trajectory; a function makes the value of the old one."""

    def change(loot: Loot) -> Json:
        one = loot.one(fits)
        for name, value in fields.items():
            one[name] = value(one[name]) if callable(value) else value
        return one

    return change


def _set_turn(fits: Fits, within: Fits = lambda one: True, **fields: Any) -> Tampering:
    """The same in a turn."""

    def change(loot: Loot) -> Json:
        one, turn = loot.turn(fits, within)
        for name, value in fields.items():
            turn[name] = value(turn[name]) if callable(value) else value
        return one

    return change


def _flags(of: Callable[[list[bool]], list[bool]], fits: Fits) -> Tampering:
    """Other flags of what is learnt."""

    def change(loot: Loot) -> Json:
        one = loot.one(fits)
        flags = of([turn["train"] for turn in one["turns"]])
        for turn, flag in zip(one["turns"], flags, strict=True):
            turn["train"] = flag
        return one

    return change


def _another(loot: Loot, one: Json) -> Json:
    """A trajectory of another task."""
    return loot.one(lambda each: each["task_id"] != one["task_id"])


def _from_another(name: str) -> Tampering:
    def change(loot: Loot) -> Json:
        one = loot.one()
        one[name] = loot.one(lambda each: each[name] != one[name])[name]
        return one

    return change


def _thought(fits: Fits, **fields: Any) -> Tampering:
    """Other values in the first thought of a turn that fits."""

    def change(loot: Loot) -> Json:
        one, turn = loot.turn(lambda turn: turn["thoughts"] and fits(turn))
        turn["thoughts"][0].update(fields)
        return one

    return change


def _picture(of: Callable[[Image.Image], tuple[Image.Image, Json]], record: bool) -> Tampering:
    """Another file in the place of a picture; the record says its size."""

    def change(loot: Loot) -> Json:
        one, turn = loot.turn(lambda turn: turn["pictures"])
        told = turn["pictures"][0]
        file = loot.folder / told["path"]
        picture, options = of(Image.open(io.BytesIO(file.read_bytes())))
        picture.save(file, "jpeg", **options)
        if record:
            told.update(width=picture.width, height=picture.height)
        return one

    return change


def _is(kind: str) -> Fits:
    return lambda one: one["kind"] == kind


def _anomaly(one: Json) -> bool:
    return any(turn["fault"] for turn in one["turns"])


def _does(verb: str) -> Fits:
    return lambda turn: turn["verb"] == verb


def _thing(turn: Json) -> bool:
    return bool(turn["subgoal"]["thing"])


def _drops_pictures_of_one_turn(loot: Loot) -> Json:
    one = loot.one(lambda one: sum(bool(turn["pictures"]) for turn in one["turns"]) > 2)
    one["turns"][1]["pictures"] = []
    return one


def _drops_every_picture(loot: Loot) -> Json:
    one = loot.one()
    for turn in one["turns"]:
        turn["pictures"] = []
    return one


def _shows_a_picture_twice(loot: Loot) -> Json:
    one, turn = loot.turn(lambda turn: turn["pictures"])
    turn["pictures"].append(turn["pictures"][0])
    return one


def _shows_the_view_around_in_another_order(loot: Loot) -> Json:
    one, turn = loot.turn(lambda turn: turn["views"])
    turn["pictures"].reverse()
    return one


def _leads_to_a_copy_elsewhere(loot: Loot) -> Json:
    one, turn = loot.turn(lambda turn: turn["pictures"])
    shutil.copy(loot.folder / turn["pictures"][0]["path"], loot.folder / "other.jpeg")
    turn["pictures"][0]["path"] = "other.jpeg"
    return one


def _removes_a_turn(loot: Loot) -> Json:
    one = loot.one(lambda one: len(one["turns"]) > 3)
    del one["turns"][1]
    return one


def _swaps_two_turns(loot: Loot) -> Json:
    one = loot.one(lambda one: len(one["turns"]) > 3)
    one["turns"][1:3] = one["turns"][2:0:-1]
    return one


def _removes_a_thought(loot: Loot) -> Json:
    one, turn = loot.turn(lambda turn: len(turn["thoughts"]) == 1)
    turn["thoughts"] = []
    return one


def _says_what_another_said(loot: Loot) -> Json:
    one = loot.one()
    other = _another(loot, one)
    one["turns"][0]["thoughts"] = other["turns"][0]["thoughts"]
    return one


def _goes_to_another_name(loot: Loot) -> Json:
    """The name of something else that is done there."""
    one, turn = loot.turn(lambda turn: turn["verb"] == "navigate to" and len(turn["navigable"]) > 1)
    turn["object_type"] = next(each for each in turn["navigable"] if each != turn["object_type"])
    return one


def _says_that_the_task_was_another(loot: Loot) -> Json:
    """Everything about the task, and the id; the actions are those of the task before."""
    one = loot.one()
    other = _another(loot, one)
    for name in ("task_id", "task_type", "scene", "instruction", "name", "key_actions"):
        one[name] = other[name]
    one["search_targets"] = other["search_targets"]
    return one


TAMPERINGS: dict[str, Tampering] = {
    # -- what is learnt --
    "every turn is learnt, faults too": _flags(lambda flags: [True] * len(flags), _anomaly),
    "the mistake before a correction is learnt": _flags(
        lambda flags: [True] * len(flags), _is("corrected")
    ),
    "one turn is not learnt": _flags(lambda flags: [*flags[:-1], False], _is("explored")),
    "nothing is learnt": _flags(lambda flags: [False] * len(flags), _is("a")),
    "learning begins one turn too late": _flags(
        lambda flags: [False, *flags[:-1]], _is("corrected")
    ),
    # -- the task --
    "another instruction": _from_another("instruction"),
    "more in the instruction": _set(instruction=lambda text: text + " Then open every drawer."),
    "a key action less": _set(key_actions=lambda keys: keys[1:]),
    "another reward of a key action": _set(
        key_actions=lambda keys: [{**keys[0], "reward": 5.0}, *keys[1:]]
    ),
    "another object of a key action": _set(
        key_actions=lambda keys: [{**keys[0], "object_id": "Safe|+01.00|+00.00|+00.00"}, *keys[1:]]
    ),
    "a key action that must be exact": _set(
        key_actions=lambda keys: [{**keys[0], "exact": not keys[0]["exact"]}, *keys[1:]]
    ),
    "another task type": _set(task_type="pickup_and_put"),
    "another name": _set(name=lambda name: name + " now"),
    "other search targets": _set(search_targets=lambda _: ["Safe"]),
    "another room": _set(scene="FloorPlan230"),
    "another step limit": _set(max_steps=lambda steps: steps + 5),
    "another task with all that belongs to it": _says_that_the_task_was_another,
    "another seed": _set(seed=lambda seed: seed + 1),
    # -- pictures --
    "no pictures at one turn": _drops_pictures_of_one_turn,
    "no pictures at all": _drops_every_picture,
    "a picture twice": _shows_a_picture_twice,
    "the views around in another order": _shows_the_view_around_in_another_order,
    "a copy of a picture": _leads_to_a_copy_elsewhere,
    "another size in the record": _set_turn(
        lambda turn: turn["pictures"],
        pictures=lambda them: [{**them[0], "width": 8, "height": 8}, *them[1:]],
    ),
    "a tiny picture": _picture(lambda one: (one.resize((16, 9)), {"quality": 80}), record=True),
    "a blurred picture": _picture(lambda one: (one.copy(), {"quality": 2}), record=True),
    # -- turns --
    "another place is gone to": _goes_to_another_name,
    "another action": _set_turn(_does("pickup"), verb="open"),
    "another object": _set_turn(lambda turn: turn["object_id"], object_id="Safe|1|1|1"),
    "a failure that succeeded": _set_turn(lambda turn: not turn["success"], success=True),
    "a larger reward": _set_turn(lambda turn: turn["reward"], reward=9.0),
    "another feedback": _set_turn(lambda turn: turn["feedback"], feedback="Well done!"),
    "no fault": _set_turn(lambda turn: turn["fault"], fault=""),
    "an object less in view": _set_turn(
        lambda turn: len(turn["view"]) > 1, view=lambda view: view[1:]
    ),
    "an object on another side": _set_turn(
        lambda turn: turn["view"] and turn["view"][0]["side"] != "left",
        view=lambda view: [{**view[0], "side": "left"}, *view[1:]],
    ),
    "an object less around": _set_turn(
        lambda turn: turn["views"] and turn["views"]["left"],
        views=lambda views: {**views, "left": views["left"][1:]},
    ),
    "something in the hand": _set_turn(lambda turn: not turn["held"], held="Egg"),
    "a place less to go to": _set_turn(
        lambda turn: turn["navigable"], navigable=lambda names: names[1:]
    ),
    "a thing less within reach": _set_turn(
        lambda turn: turn["interactable"], interactable=lambda names: names[1:]
    ),
    "at another place": _set_turn(lambda turn: turn["at"], at="Safe"),
    "a turn less": _removes_a_turn,
    "two turns in another order": _swaps_two_turns,
    # -- reasons --
    "a place that was not searched": _set_turn(
        lambda turn: turn["purpose"] == "search", purpose="carry"
    ),
    "another goal": _set_turn(_thing, subgoal=lambda goal: {**goal, "thing": "Safe"}),
    "another destination": _set_turn(_thing, subgoal=lambda goal: {**goal, "place": "Safe"}),
    "another plan": _set_turn(lambda turn: turn["plan"], plan=lambda plan: [*plan, "Safe"]),
    "a plan where there is none": _set_turn(_does("end"), plan=["Safe"]),
    # -- thoughts --
    "a thought of another kind": _thought(
        lambda turn: turn["thoughts"][0]["kind"] == "planning", kind="verification"
    ),
    "a turn without a thought": _removes_a_thought,
    "a false thought": _thought(
        lambda turn: True, text="I see a Safe on my left, and I am holding a Laptop."
    ),
    "what was said elsewhere": _says_what_another_said,
    "another writer": _thought(lambda turn: True, writer="expert"),
    "reasons against a thought": _thought(lambda turn: True, refused=["unseen"]),
    "another language": _set(language="zh"),
    # -- where it comes from --
    "another kind": _set(_is("a"), kind="c"),
    "an expert's kind": _set(_is("corrected"), kind="explored", correction=None),
    "another mode": _set(lambda one: one["mode"] == "search", mode=""),
    "another actor": _set(_is("explored"), actor="explorer:oracle"),
    "another part": _set(_is("explored"), part="anomalies"),
    "another first mistake": _set(
        _is("corrected"), correction=lambda said: {**said, "first_wrong": said["first_wrong"] + 1}
    ),
    "another origin": _set(
        _is("corrected"), correction=lambda said: {**said, "episode": "another"}
    ),
    "another cost": _set(cost=lambda cost: {**cost, "usd": 3.0}),
    "another end": _set(end_reason="step limit"),
    "no success": _set(success=False),
}
"""What each tampering does. They were written before the checks that find them."""


# -- a second list, written when the checks for the first one were there ---------------------------


def _manifests(change: Callable[[Json], object]) -> Callable[[Loot], None]:
    """Change the settings in the collection's manifest, and in those of its parts."""

    def changed(loot: Loot) -> None:
        files = [(loot.folder / "collection.json", "settings")]
        files += [(one, "agent_settings") for one in loot.folder.glob("parts/*/run.json")]
        for file, name in files:
            told = json.loads(file.read_text())
            change({"manifest": told, "settings": told[name]})
            file.write_text(json.dumps(told))

    return changed


def _turns_a_picture(loot: Loot) -> Json:
    one, turn = loot.turn(lambda turn: turn["pictures"])
    file = loot.folder / turn["pictures"][0]["path"]
    exif = Image.Exif()
    exif[0x0112] = 3  # upside down
    Image.open(io.BytesIO(file.read_bytes())).save(file, "jpeg", quality=80, exif=exif)
    return one


def _swaps_two_files(loot: Loot) -> Json:
    one = loot.one()
    first, second = (loot.folder / turn["pictures"][0]["path"] for turn in one["turns"][:2])
    held = first.read_bytes()
    first.write_bytes(second.read_bytes())
    second.write_bytes(held)
    return one


def _says_another_seed(loot: Loot) -> Json:
    _manifests(lambda told: told["manifest"].update(seed=99))(loot)
    one = loot.one()
    one["seed"] = episode_seed(99, one["id"])
    return one


def _says_that_nothing_failed(loot: Loot) -> Json:
    file = loot.folder / "parts" / "anomalies" / "run.json"
    told = json.loads(file.read_text())
    del told["env"]["faults"]
    file.write_text(json.dumps(told))
    return loot.one(_is("a"))


def _plays_it_once_more(loot: Loot) -> Json:
    """A copy under another id, as if it had been drawn again, with its seed and pictures."""
    one = loot.one(_is("explored"))
    before, one["id"] = one["id"], f"{one['id']}1"
    one["seed"] = episode_seed(0, one["id"])
    pictures = loot.folder / "parts" / one["part"] / "pictures"
    shutil.copytree(pictures / before, pictures / one["id"])
    for turn in one["turns"]:
        for picture in turn["pictures"]:
            picture["path"] = picture["path"].replace(f"/{before}/", f"/{one['id']}/")
    return one


def _thinks_otherwise(loot: Loot, **fields: str) -> Json:
    """A thought that the critic takes for true."""
    one = loot.one(_is("explored"))
    one["turns"][0]["thoughts"][0].update(
        text="I always go to the first place that comes to my mind.", **fields
    )
    return one


def _says_an_older_version(loot: Loot) -> Json:
    _manifests(lambda told: told["manifest"].update(er_gym="0.0.9"))(loot)
    return _thinks_otherwise(loot)


def _says_another_writer(loot: Loot) -> Json:
    _manifests(lambda told: told["settings"].update(writer="x:Y"))(loot)
    return _thinks_otherwise(loot)


def _says_a_model_took_part(loot: Loot) -> Json:
    expert = {"name": "openai:gpt-4o", "decisions": "plan", "places": "likely", "settings": {}}
    _manifests(lambda told: told["settings"].update(expert=expert))(loot)
    return _thinks_otherwise(loot, writer="openai:gpt-4o")


def _thinks_in_another_order(loot: Loot) -> Json:
    one, turn = loot.turn(lambda turn: len(turn["thoughts"]) > 1)
    turn["thoughts"].reverse()
    return one


def _removes_the_parts_own_record(loot: Loot) -> Json:
    one = loot.one()
    (loot.folder / "parts" / one["part"] / PLAYED / f"{one['id']}.json").unlink()
    loot.own = False
    return one


def _changes_the_collections_file_alone(loot: Loot) -> Json:
    loot.own = False
    return _thinks_otherwise(loot)


MORE: dict[str, Tampering] = {
    "a picture upside down": _turns_a_picture,
    "the views around listed in another order": _set_turn(
        lambda turn: turn["views"], views=lambda views: dict(reversed(views.items()))
    ),
    "two files of pictures swapped": _swaps_two_files,
    "another seed of the collection": _says_another_seed,
    "a part without faults": _says_that_nothing_failed,
    "an episode once more": _plays_it_once_more,
    "an older version of er-gym, and another thought": _says_an_older_version,
    "another package's writer, and another thought": _says_another_writer,
    "a model that took part, and another thought": _says_a_model_took_part,
    "thoughts in another order": _thinks_in_another_order,
    "no record of the part": _removes_the_parts_own_record,
    "another thought in the collection's file alone": _changes_the_collections_file_alone,
    "a sign that nobody sees in the instruction": _set(instruction=lambda text: text + "\u200b"),
}
"""What each tampering of the second list does."""
