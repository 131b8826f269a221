"""Why the expert acts, what its thoughts respond to, and the facts that they may tell."""

from __future__ import annotations

import random
import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from support import in_one_test, make_task

from agents.expert.candidates import Candidate
from agents.expert.collect import Collector
from agents.expert.course import Intent, View
from agents.expert.explorer import ExplorerCourse, Strength
from agents.expert.legs import Leg, legs_of
from agents.expert.recorded_replies import split_speech
from agents.expert.replayed_intents import replayed_intent, replayed_purpose
from agents.expert.task_course import GiveUp
from agents.expert.thinker import _event
from agents.expert.writers.facts import _in_view, facts_of
from agents.expert.writers.nouns import nouns
from er_gym.data.collection import CollectionError
from er_gym.data.knowledge import Knowledge, LastAction
from er_gym.data.trajectory import SeenObject, Subgoal, Turn
from er_gym.envs.actions import Action
from er_gym.tasks import verbs
from er_gym.tasks.config_folder import config_directory

GO = verbs.NAVIGATE
FRIDGE, DESK = "Fridge|+00.00|+01.00|+02.00", "Desk|+00.00|+01.00|+02.00"
MUG = "Mug|+00.00|+01.00|+02.00"
TASK = make_task("pickup_and_put", (GO, FRIDGE), ("pickup", MUG), (GO, DESK), ("put in", DESK))


def view(left: int, held: str = "", *seen: str) -> View:
    """The agent has the last ``left`` key actions before it."""
    return View(
        visible=frozenset(seen),
        held=held,
        navigable=(),
        reach=frozenset(),
        legal=(),
        action=None,
        success=True,
        done=len(TASK.key_actions) - left,
        left=TASK.key_actions[len(TASK.key_actions) - left :],
        steps_left=9,
        info={},
    )


@in_one_test(
    "row",
    [  # what was done; what the agent told; the purpose that it seems to have had
        (Action(GO, "Fridge"), view(5), "search"),
        (Action(GO, "Fridge"), view(5, "", "Mug"), "approach"),
        (Action(GO, "Fridge"), view(5, "", "Egg"), "search"),
        (Action(GO, "Desk"), view(3, "Mug"), "carry"),
        (Action(GO, "Shelf"), view(3, "Mug"), "search"),
        (Action(GO, "Shelf"), view(3, "Mug", "Desk"), "approach"),
        (Action(verbs.OPEN, "Desk"), view(3, "Mug"), "open to put"),
        (Action(verbs.OPEN, "Fridge"), view(5), "open to look"),
    ],
)
def test_what_was_replayed_seems_to_have_had_a_purpose(row: tuple[Action, View, str]) -> None:
    action, seen, purpose = row
    legs = legs_of(TASK)
    found = replayed_intent(action, seen, legs, train=True)
    assert (found.action, found.purpose, found.train) == (action, purpose, True)
    assert found.plan == ((action.object_type,) if action.verb == GO else ())
    assert replayed_intent(action, seen, legs, train=False, again=True).purpose == "retry"


@in_one_test(
    "row",
    [
        (Action(GO, "Desk"), "", "", "search"),
        (Action(GO, "Desk"), "Mug", "", "carry"),
        (Action(GO, "Desk"), "Mug", "Desk", "carry"),
        (Action(GO, "Shelf"), "Mug", "Desk", "search"),
        (Action(verbs.OPEN, "Desk"), "Mug", "Desk", "open to put"),
        (Action(verbs.OPEN, "Shelf"), "Mug", "Desk", "open to look"),
        (Action(verbs.PUT, "Desk"), "Mug", "Desk", "put"),
        (Action(verbs.END), "", "", "finish"),
        (Action(verbs.SLICE, "Bread"), "", "", "use"),
    ],
)
def test_purposes(row: tuple[Action, str, str, str]) -> None:
    action, held, place, purpose = row
    assert replayed_purpose(action, held, place) == purpose


def turn(**fields: Any) -> Turn:
    return Turn(
        **{"verb": GO, "object_type": "Desk", "purpose": "search", "success": True} | fields
    )


@in_one_test(
    "row",
    [  # the intent's fields; the last turn's; what the thoughts respond to
        ({}, None, "begin"),
        ({}, {}, "fruitless"),
        ({}, {"reward": 1.0}, "earned"),
        ({}, {"success": False}, "failed"),
        ({}, {"train": False}, "failed"),
        ({}, {"train": False, "purpose": "repeat"}, "fruitless"),
        ({}, {"train": False, "reward": 1.0}, "earned"),
        ({"train": False}, {"train": False}, "fruitless"),
        ({"purpose": "repeat"}, {}, "careless"),
        ({"purpose": "finish"}, {}, "done"),
        ({"purpose": "finish", "checked": "check"}, {}, "check"),
        ({"purpose": "finish", "checked": "think and check"}, {}, "think and check"),
        ({"purpose": "repeat", "checked": "check"}, {}, "careless"),
    ],
)
def test_thoughts_respond_to_what_happened(
    row: tuple[dict[str, Any], dict[str, Any] | None, str],
) -> None:
    fields, last, event = row
    intent = Intent(Action(GO, "Desk"), **{"purpose": "search", "subgoal": Subgoal()} | fields)
    assert _event(intent, [] if last is None else [turn(), turn(**last)]) == event


def facts(**fields: Any) -> dict[str, Any]:
    """Of a search for the mug; the fridge is ahead."""
    plain: dict[str, Any] = {
        "language": "en",
        "instruction": "Put the Mug on the Desk.",
        "turn": 0,
        "view": [SeenObject(type="Fridge", side="ahead", distance=2.0, open=False)],
        "held": "",
        "at": "",
        "decision": Action(GO, "Fridge"),
        "purpose": "search",
        "subgoal": Subgoal(verb="pickup", thing="Mug", place="Desk"),
    }
    return facts_of(Knowledge(**plain | fields), random.Random(0))


ON_THE_SHELF = [SeenObject(type="Mug", side="left", distance=1.0, on="Shelf")]


@in_one_test(
    "row",
    [  # what is known beyond the plain search; its purpose; facts that hold, and that do not
        ({}, "search", {"is_search", "unseen", "elsewhere"}, {"holds_thing", "lies_there"}),
        ({"decision": Action(GO, "Mug")}, "approach", {"is_approach"}, {"elsewhere", "is_search"}),
        ({"view": ON_THE_SHELF}, "approach", set(), {"unseen", "lies_there"}),
        (
            {"view": ON_THE_SHELF, "decision": Action(GO, "Shelf")},
            "approach",
            {"lies_there"},
            {"unseen"},
        ),
        (
            {"view": ON_THE_SHELF, "decision": Action(GO, "Shelf"), "purpose": "carry"},
            "carry",
            {"lies_there"},
            {"is_approach"},
        ),
        ({"purpose": "open to look"}, "open to look", set(), {"is_approach"}),
        ({"held": "Mug"}, "search", {"holds_thing", "held"}, {"is_approach"}),
        ({"held": "Mug", "decision": Action(GO, "Desk")}, "approach", set(), set()),
        (
            {"last": LastAction(Action(GO, "Shelf"), "search", True, True)},
            "search",
            {"earned", "last_verb"},
            set(),
        ),
    ],
)
def test_facts_are_told_by_their_names(
    row: tuple[dict[str, Any], str, set[str], set[str]],
) -> None:
    fields, purpose, hold, do_not = row
    found = facts(**fields)
    assert found["purpose"] == purpose
    assert hold <= found.keys()
    assert not do_not & found.keys()


def test_a_plan_begins_with_where_the_agent_goes_now() -> None:
    found = facts(plan=["Fridge", "Desk", "Shelf", "Desk", "Bed"])
    assert [each["o"] for each in found["plan"]] == ["Fridge", "Desk", "Shelf", "Bed"]
    assert (found["next1"], found["next2"], found["next3"]) == ("Fridge", "Desk", "Shelf")
    assert "next4" not in found
    opening = facts(plan=["Fridge", "Desk"], decision=Action(verbs.OPEN, "Fridge"))
    assert [each["o"] for each in opening["plan"]] == ["Desk"]


def test_more_than_one_are_counted() -> None:
    said = {
        count: {
            nouns("en").counted({"o": "Mug", "count": count}, random.Random(s)) for s in range(9)
        }
        for count in (1, 2, 3, 4)
    }
    assert said == {
        1: {"a mug"},
        2: {"two mugs", "a couple of mugs"},
        3: {"several mugs", "a few mugs"},
        4: {"several mugs", "a few mugs"},
    }
    for uncounted in ("Bread", "Blinds"):
        one = nouns("en").counted({"o": uncounted, "count": 3}, random.Random(0))
        assert one == nouns("en").counted({"o": uncounted}, random.Random(0))


# -- whose words, and which episodes ---------------------------------------------------------------


def test_a_dialect_of_one_language_has_no_openers_in_another(tmp_path: Path) -> None:
    shutil.copy(config_directory("dialects") / "paper" / "en.yaml", tmp_path)
    said = "It is dark. Let me take a look at the scene first. A sofa."
    assert split_speech(said, str(tmp_path), "en") == [
        ("reasoning", "It is dark."),
        ("analysis", "A sofa."),
    ]
    assert split_speech(said, str(tmp_path), "zh") == [("reasoning", said)]


OPEN, TAKE = Action(verbs.OPEN, "Fridge"), Action(verbs.PICKUP, "Mug")
OPENED = make_task("pickup_from_closerep_and_put", (GO, FRIDGE), ("open", FRIDGE), ("pickup", MUG))


@in_one_test(
    "row",
    [  # the key actions left; what is legal; whether it can begin, with a hidden thing or another
        (4, (OPEN,), False, True),  # what hides a thing it opens when it looks inside
        (4, (OPEN, TAKE), True, True),
        (4, (TAKE,), True, False),
        (2, (TAKE,), True, True),
        (2, (), False, False),
    ],
)
def test_an_explorer_is_ready_for_the_key_action_that_it_can_do(
    row: tuple[int, tuple[Action, ...], bool, bool],
) -> None:
    left, legal, *ready = row
    found = []
    for hidden in (True, False):
        course = ExplorerCourse(OPENED, Strength(), random.Random(0))
        course.view = replace(view(5), left=OPENED.key_actions[-left:], legal=legal)
        course._legs = tuple(replace(leg, hidden=hidden) for leg in legs_of(OPENED))
        found.append(course._ready(course._legs[0]))
    assert found == ready


def test_what_was_not_played_or_crashed_does_not_keep_out_what_comes_after() -> None:
    def candidate(name: str) -> Candidate:
        return Candidate(name, "p", "explorer", TASK, 0, "explored")

    chosen = [candidate(name) for name in ("gone", "crashed", "long", "good", "gone", "better")]
    assert {each.mode for each in chosen} == {""}

    def played(part: str, name: str) -> str:
        if name == "crashed":
            raise CollectionError(name)
        return name

    collector = object.__new__(Collector)
    collector._collection = SimpleNamespace(played=played)  # type: ignore[assignment]
    collector._players = SimpleNamespace(  # type: ignore[assignment]
        rejection=lambda name, most: f"longer than {most}" if name == "long" else ""
    )
    collector.summary = SimpleNamespace(rejected={})  # type: ignore[assignment]
    taken: list[Candidate] = []
    directory: Any = SimpleNamespace(has=lambda name: name != "gone")
    stratum: Any = SimpleNamespace(chosen=chosen, take=taken.extend)
    collector._take(directory, stratum, 9)
    assert [each.id for each in taken] == ["good", "better"]
    assert collector.summary.rejected == {"longer than 9": 1}


def test_of_what_was_in_the_file_only_that_is_kept_which_is_not_taken_anew() -> None:
    def trajectory(part: str, name: str, when: str) -> Any:
        return SimpleNamespace(part=part, id=name, when=when)

    new = [trajectory("imitation", "a", "now")]
    old = [trajectory("imitation", "a", "before"), trajectory("anomalies", "a", "before")]
    collector: Any = SimpleNamespace(
        _taken=lambda: new, _collection=SimpleNamespace(trajectories=lambda: old)
    )
    kept = [(each.part, each.when) for each in Collector._taken_and_earlier(collector)]
    assert kept == [("imitation", "now"), ("anomalies", "before")]


def test_who_strays_may_lose_heart_and_does_if_only_finding_is_asked_for() -> None:
    def gives_up(seed: int, leg: Leg) -> bool:
        course = ExplorerCourse(TASK, Strength(), random.Random(seed))
        course.view = view(5)
        try:
            return bool([*course._stray(leg)])
        except GiveUp:
            return True

    leg, *_ = legs_of(TASK)
    assert {gives_up(seed, leg) for seed in range(20)} == {True, False}
    assert all(gives_up(seed, replace(leg, actions=())) for seed in range(20))


def test_what_is_in_view_is_told_apart_by_side_distance_and_state() -> None:
    known = Knowledge(
        language="en",
        instruction="Find the Egg.",
        turn=0,
        view=[
            SeenObject(type="Mug", side="left", distance=0.5),
            SeenObject(type="Fridge", side="ahead", distance=2.5, open=False),
            SeenObject(type="Sofa", side="right", distance=5.0),
        ],
        held="",
        at="",
        decision=Action(verbs.OBSERVE),
        purpose="search",
        subgoal=Subgoal(thing="Egg"),
    )
    facts = _in_view(known, "Egg", random.Random(0))
    told = {key: sorted(each["o"] for each in facts[key]) for key in ("view", "near", "shut")}
    assert told == {"view": ["Fridge", "Mug", "Sofa"], "near": ["Mug"], "shut": ["Fridge"]}
    sides = [[each["o"] for each in facts[side]] for side in ("left", "ahead", "right")]
    assert sides == [["Mug"], ["Fridge"], ["Sofa"]]
