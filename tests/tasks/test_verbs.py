"""The table of verbs, and rows of other packages."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from er_gym.envs.actions import ACTIONS
from er_gym.plugins import VARIABLE, PluginError
from er_gym.tasks import verbs
from er_gym.tasks.equivalence import BASIN_OF
from er_gym.tasks.verbs import CLOSE, OPEN, PUT, Verb, Words

OUTSIDE = Path(__file__).parents[1] / "outside"
CLEAN = Verb(name="clean", thor_action="CleanObject", object_property="dirtyable")


def test_the_verbs_that_come_with_er_gym() -> None:
    assert verbs.BARE_VERBS == ("observe", "move forward", "end")
    interactions = ("pickup", "put in", "open", "close", "toggle", "slice")
    assert ("navigate to", *interactions) == verbs.OBJECT_VERBS
    assert interactions == verbs.INTERACTIONS
    assert {"init", "observe", "move forward", "navigate to"} == verbs.UNSCORED
    assert verbs.ALIASES == {
        "put": "put in",
        "pick up": "pickup",
        "navigate": "navigate to",
        "go to": "navigate to",
        "cut": "slice",
    }
    assert verbs.ADDED == ()


def test_the_numbers_of_actions_that_policies_were_trained_with() -> None:
    found = {str(action): number for number, action in enumerate(ACTIONS)}
    expected = {
        "observe": 0, "move forward": 1, "end": 2, "navigate to AlarmClock": 3,
        "pickup AlarmClock": 126, "put in ArmChair": 194, "open Blinds": 237, "close Blinds": 251,
        "toggle CellPhone": 266, "slice Apple": 280, "slice Tomato": 285,
    }  # fmt: skip
    assert {name: found[name] for name in expected} == expected
    assert len(ACTIONS) == 286


def test_what_stands_for_a_part_of_it_can_be_filled() -> None:
    assert set(verbs.verb_named(PUT).object_types) == set(BASIN_OF)


def test_canonical_verb() -> None:
    assert verbs.canonical_verb("  Pick  UP ") == "pickup"
    assert verbs.canonical_verb("polish") == "polish"


# -- adding ----------------------------------------------------------------------------------------


def fresh_table(monkeypatch: pytest.MonkeyPatch, names: str) -> tuple[Verb, ...]:
    monkeypatch.syspath_prepend(str(OUTSIDE))
    monkeypatch.setenv(VARIABLE, names)
    return verbs.table.__wrapped__()


def test_added_verbs_follow_in_the_order_of_their_names(monkeypatch: pytest.MonkeyPatch) -> None:
    names = [f"verbs=household_verbs:{name}" for name in ("FILL", "CLEAN", "FILL")]
    found = fresh_table(monkeypatch, " , ".join(names))
    assert found[: len(verbs.OWN)] == verbs.OWN
    assert [verb.name for verb in found[len(verbs.OWN) :]] == ["clean", "fill"]


@pytest.mark.parametrize(
    ("names", "message"),
    [
        ("verbs=household_verbs:CLAEN", r"verb 'household_verbs:CLAEN'.* \(did you mean CLEAN\?\)"),
        ("verbs=household_verbs", "is not a package.module:Name"),
        ("verbs=household_verbs:Words", r"ER_GYM_PLUGINS is .*give an er_gym\.tasks\.verbs\.Verb"),
        ("verbs=no_such:X", "Cannot import 'no_such'"),
        ("household_verbs:FILL", r"holds 'household_verbs:FILL'; give TABLE=package\.module:Name"),
        ("words=a:B", r"holds 'words=a:B'.* one of: task_types, verbs, actions, shapes"),
    ],
)
def test_wrong_names_in_the_variable(
    monkeypatch: pytest.MonkeyPatch, names: str, message: str
) -> None:
    with pytest.raises(PluginError, match=message):
        fresh_table(monkeypatch, names)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"name": "open"}, "'open' already means 'open'"),
        ({"aliases": ("turn on",)}, "'turn on' already means 'toggle'"),
        ({"name": "init"}, "'init' already means 'init'"),
        ({"name": "Clean"}, "'Clean' is not a phrase; write lower-case"),
        ({"name": ""}, "'' is not a phrase"),
        ({"name": "clean_up"}, "'clean_up' is not a phrase"),
        ({"aliases": "wipe"}, r"aliases is 'wipe': .*valid tuple"),
        ({"words": {"en": Words(said="wipe")}}, r"words\.en\.said is 'wipe': .*valid tuple"),
        ({"words": {"en": "wipe"}}, r"words\.en is 'wipe'"),
        ({"name": None}, "verb None: name is None: .*valid string"),
        ({"object_state": ("isDirty",)}, r"object_state\.1 is .*[Ff]ield required"),
        ({"parameters": {"objectId": "Mug|1"}}, "parameters has 'objectId'"),
        ({"plan": "{"}, r"plan is '\{'; write words"),
        ({"hand": ()}, r"hand is \(\); give 'any'"),
        ({"thor_action": ""}, "has no thor_action"),
        (
            {"object_property": "dirty"},
            "no object has the property 'dirty'; .*breakable, canBeUsedUp",
        ),
        ({"object_state": ("dirty", True)}, "'dirty' is not a state; .*isDirty"),
        ({"object_types": ("Mag",)}, "no object type 'Mag'; did you mean Mug"),
        ({"hand": ("Sponge",)}, "no object type 'Sponge'; did you mean .*DishSponge"),
        ({"hand": "sponge"}, "hand is 'sponge'; give 'any', 'empty', 'full' or a tuple"),
        ({"alone": True}, "alone means no object, so object_property has no effect"),
        ({"plan": "clean {what}"}, r"plan is .*write words and \{it\}"),
    ],
)
def test_what_a_row_cannot_be(changes: dict[str, object], message: str) -> None:
    known = {verb.name: verb for verb in verbs.OWN}
    assert verbs._merged(known, [CLEAN])["clean"] == CLEAN
    with pytest.raises(PluginError, match=message):
        verbs._merged(known, [replace(CLEAN, **changes)])


def test_two_verbs_may_not_be_said_alike() -> None:
    known = {verb.name: verb for verb in verbs.OWN}
    other = Verb(name="wash", aliases=("clean",), thor_action="CleanObject")
    with pytest.raises(PluginError, match="verb 'wash': 'clean' already means 'clean'"):
        verbs._merged(known, [CLEAN, other])


def test_a_verb_cannot_be_registered_late() -> None:
    assert verbs.table()
    with pytest.raises(PluginError, match=r"'clean' is registered too late.*\$ER_GYM_PLUGINS"):
        verbs.register(CLEAN)


def test_a_verb_for_any_object_and_one_for_certain_types() -> None:
    push = Verb(name="push", thor_action="PushObject")
    assert push.takes("Fridge")
    assert not push.takes("Floor")
    brush = replace(push, object_types=("Toilet",))
    assert brush.takes("Toilet")
    assert not brush.takes("Fridge")
    assert verbs.verb_named(OPEN).object_state == ("isOpen", False)
    assert verbs.verb_named(CLOSE).said == ("close", "close object", "shut", "关闭", "关上", "合上")
