"""The session that all plugs play, and the scaffold that all of them take."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest

from er_gym.envs.errors import ResetNeeded
from er_gym.integrations.scaffold import OBSERVATIONS, REWARDS, Scaffold
from er_gym.integrations.session import PROMPT, Session, Turn, action_in

TASK = "FloorPlan2-single_pickup_from_closerep-Lettuce"
SOLVE = ("navigate to Fridge", "open Fridge", "pickup Lettuce", "close Fridge", "end")
Make = Callable[..., Session]


@pytest.fixture
def make() -> Iterator[Make]:
    made: list[Session] = []

    def session(**settings: object) -> Session:
        made.append(Session("er-1k", **settings))
        return made[-1]

    yield session
    for each in made:
        each.close()


def played(session: Session, *texts: str) -> list[Turn]:
    return [session.reset(TASK), *map(session.step, texts)]


def test_each_level_tells_more_than_the_one_before(make: Make) -> None:
    texts = {
        level: played(make(scaffold=level, width=32, height=32), "open Safe")[-1].text
        for level in OBSERVATIONS
    }
    lines = {level: set(text.splitlines()) for level, text in texts.items()}
    assert [len(lines[level]) for level in OBSERVATIONS] == [2, 4, 6, 6]
    assert lines["picture"] < lines["caption"] < lines["targets"]
    (told,), (hint,) = lines["targets"] - lines["hints"], lines["hints"] - lines["targets"]
    assert told.endswith(". That did not work.")
    assert ". You cannot open Safe: " in hint


@pytest.mark.parametrize("level", OBSERVATIONS)
def test_every_level_says_what_can_be_said(make: Make, level: str) -> None:
    turn = played(make(scaffold=level, width=32, height=32), "fetch a coffee")[-1]
    assert "names no action. Say one of: observe," in turn.text
    assert (turn.is_action_valid, turn.steps, turn.done) == (False, 1, False)


def test_each_reward(make: Make) -> None:
    rewards = {name: played(make(scaffold=name), *SOLVE) for name in REWARDS}
    totals = {name: sum(turn.reward for turn in turns) for name, turns in rewards.items()}
    assert all(turns[-1].success for turns in rewards.values())
    assert [turn.reward for turn in rewards["success"]] == [0, 0, 0, 0, 0, 1]
    assert [turn.reward for turn in rewards["key_actions"]] == [0, 1, 1, 1, 1, 1]
    # With a discount of 1 an episode gets the potential of its start back, whatever it did.
    assert totals["shaping"] == pytest.approx(totals["key_actions"] + 1)
    assert [turn.progress for turn in rewards["success"]] == [0, 0.2, 0.4, 0.6, 0.8, 1]


def test_pictures_come_where_they_are_needed_or_asked_for(make: Make) -> None:
    small = {"width": 32, "height": 24}
    assert make(scaffold="caption", **small).reset(TASK).picture is None
    for asked in ({"scaffold": "picture"}, {"scaffold": "caption", "pictures": True}):
        picture = make(**asked, **small).reset(TASK).picture
        assert picture is not None
        assert (picture.shape, picture.dtype) == ((24, 32, 3), np.uint8)


@pytest.mark.parametrize("name", ["", "hint", "hints/", "success/hints", "a/b/c", None])
def test_an_unknown_scaffold_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match=r"unknown scaffold .*give OBSERVATION/REWARD"):
        Scaffold.named(name)


@pytest.mark.parametrize(
    ("name", "full"),
    [
        ("caption", "caption/key_actions"),
        ("success", "hints/success"),
        ("picture/shaping", "picture/shaping"),
    ],
)
def test_half_a_scaffold_will_do(name: str, full: str) -> None:
    assert str(Scaffold.named(name)) == full


def test_after_the_end_every_turn_says_so(make: Make) -> None:
    session = make()
    last = played(session, *SOLVE)[-1]
    for _ in range(5):
        turn = session.step("open Fridge")
        assert turn.text == "The episode is over (end); nothing more can be done in it."
        assert (turn.reward, turn.done, turn.success) == (0.0, True, last.success)
    assert not session.reset(TASK).done


def test_before_the_beginning_and_after_closing_is_an_error(make: Make) -> None:
    session = make()
    with pytest.raises(ResetNeeded, match="no episode has begun"):
        session.step("observe")
    session.close()
    session.close()
    for call in (session.reset, lambda: session.step("observe")):
        with pytest.raises(ResetNeeded, match="the session is closed"):
            call()


def test_which_actions_are_valid(make: Make) -> None:
    said = {"navigate to Sink": True, "open Safe": False, "go to  fridge": True, "": False}
    turns = played(make(), *said)[1:]
    assert [turn.is_action_valid for turn in turns] == list(said.values())


def test_anchors_tell_situations_apart_and_not_ways(make: Make) -> None:
    session = make()
    short = played(session, "navigate to Fridge")
    long = played(session, "open Safe", "nonsense", "navigate to Fridge", "open Fridge")
    assert short[0].anchor == long[0].anchor != long[1].anchor  # where something was refused
    assert short[1].anchor == long[3].anchor != long[0].anchor
    assert long[4].anchor != long[3].anchor
    assert long[4].anchor.startswith(f"{long[4].task_id}#")
    assert session.reset("FloorPlan2-710812-single_search-Apple").anchor != short[0].anchor


@pytest.mark.parametrize(
    ("reply", "action"),
    [
        ("open Fridge", "open Fridge"),
        ("<think>open Safe?</think>\nopen Fridge\n", "open Fridge"),
        ("<think><action>end</action></think><action> open Fridge </action>", "open Fridge"),
        ("<DecisionMaking>open Fridge</DecisionMaking>.", "open Fridge"),
        ("<action>open Fridge", "<action>open Fridge"),
    ],
)
def test_the_action_in_a_reply(reply: str, action: str) -> None:
    assert action_in(reply) == action


def test_the_prompt_names_the_verbs() -> None:
    assert "navigate to, pickup, put in" in PROMPT
