"""The search for odd thoughts finds each kind in a turn that has it, and none in one that has not."""

from __future__ import annotations

from typing import Any

from support import in_one_test

from benchmarks.checks.odd_thoughts.__main__ import search
from benchmarks.checks.odd_thoughts.kinds import GUESS, KINDS, oddities
from er_gym.data.trajectory import (
    Language,
    SeenObject,
    Subgoal,
    ThoughtRecord,
    Trajectory,
    Turn,
)
from er_gym.rollout.records import KeyActionRecord
from er_gym.tasks import verbs

GO, TAKE, CARRY = verbs.NAVIGATE, Subgoal(verb=verbs.PICKUP, thing="Mug", place="Sink"), "carry"
ON_DESK = [SeenObject(type="Mug", side="left", distance=1.0, on="Desk")]
WALKS, USUAL, HARD, UNSURE, HALF, PRONOUN, OTHER, SAME = KINDS


def turn(text: str, verb: str = GO, object_type: str = "Bed", **fields: Any) -> Turn:
    plain = {"purpose": "search", "subgoal": TAKE, "success": True}
    thoughts = [ThoughtRecord(kind="planning", text=text)] if text else []
    return Turn(verb=verb, object_type=object_type, thoughts=thoughts, **{**plain, **fields})


def episode(*turns: Turn, language: Language = "en") -> Trajectory:
    return Trajectory(
        id="x",
        task_id="x",
        task_type="pickup_and_put",
        scene="FloorPlan1",
        instruction="Put the Mug in the Sink.",
        name="x",
        key_actions=[KeyActionRecord(verb=verbs.PUT, object_id="Sink|1|1|1", object_type="Sink")],
        seed=0,
        kind="corrected",
        language=language,
        max_steps=9,
        turns=list(turns),
        success=True,
        end_reason="end",
    )


LOOK = {"verb": verbs.OBSERVE, "object_type": "", "purpose": "look around"}
SEEN = turn("", view=ON_DESK, train=False)
HELD = {"held": "Mug", "purpose": CARRY}
TAKES = {"verb": verbs.PICKUP, "object_type": "Mug", "purpose": "take"}


@in_one_test(
    "row",
    [  # the kind; a language; the turns before; an odd turn; one that is not
        (GUESS, "en", [SEEN], turn("I'll go.", object_type="Sofa"), turn("I saw the mug on the desk.", object_type="Desk", purpose="approach")),
        (GUESS, "zh", [SEEN], turn("马克杯可能在书桌上。", purpose="approach"), turn("之前马克杯在书桌上。", purpose="approach")),
        (WALKS, "en", [], turn("I see it.", view=ON_DESK, purpose="approach", navigable=["Desk"]), turn("I see it.", object_type="Desk", view=ON_DESK, purpose="approach", navigable=["Desk"])),
        (WALKS, "en", [], turn("I see it.", view=ON_DESK, purpose="approach", navigable=["Desk"]), turn("I can't go to the desk.", view=ON_DESK, purpose="approach")),
        (WALKS, "en", [], turn("I look.", view=ON_DESK, **LOOK), turn("I look.", **LOOK)),
        (USUAL, "en", [turn("I see only a book on the desk.")], turn("People often keep a mug on the desk."), turn("People often keep a mug on the shelf.")),
        (USUAL, "en", [turn("There is a book on the desk.")], turn("The desk is a likely place for a mug."), turn("The mug might be on the desk.")),
        (USUAL, "zh", [turn("书桌上只有一本书。")], turn("马克杯通常放在书桌上。"), turn("马克杯通常放在架子上。")),
        (HARD, "en", [], turn("The hard part was finding it.", **HELD), turn("I'm on my way.", **HELD)),
        (UNSURE, "en", [turn("")], turn("I can't tell whether it worked."), turn("Once more can't hurt.")),
        (UNSURE, "zh", [turn("")], turn("我不确定刚才那一步做好了没有。"), turn("多做一次没有坏处。")),
        (HALF, "en", [], turn("It first, everything else after that."), turn("No mug on the desk. It comes first.")),
        (HALF, "en", [], turn("Not the desk, then."), turn("The mug isn't on the desk.")),
        (PRONOUN, "en", [], turn("I see a book and a light switch. And there it is.", view=ON_DESK), turn("I see a mug. And there it is.", view=ON_DESK)),
        (PRONOUN, "en", [], turn("The sofa is here. It's within reach.", **TAKES), turn("The mug is on the desk. It's within reach.", **TAKES)),
        (PRONOUN, "zh", [], turn("沙发在这里。它就在手边。", **TAKES), turn("马克杯在这里。它就在手边。", **TAKES)),
        (OTHER, "en", [], turn("The mug belongs on the sofa.", **HELD), turn("The mug belongs in the sink.", **HELD)),
        (OTHER, "zh", [], turn("马克杯应该放在沙发上。", **HELD), turn("马克杯应该放在水槽里。", **HELD)),
        (SAME, "en", [turn("There's a lot of this room I haven't seen.", **LOOK)], turn("There's a lot of this room I haven't seen, so let me look around.", **LOOK), turn("I know only a part of it.", **LOOK)),
        (SAME, "zh", [turn("这个房间还有很多地方我没看过。", **LOOK)], turn("这个房间还有很多地方我没看过。", **LOOK), turn("站在一处看不全房间。", **LOOK)),
    ],
)  # fmt: skip
def test_each_kind_is_found(row: tuple[str, Language, list[Turn], Turn, Turn]) -> None:
    kind, language, before, odd, plain = row
    assert dict(oddities(episode(*before, odd, language=language)))[kind]
    assert not dict(oddities(episode(*before, plain, language=language)))[kind]


def test_the_closers_of_a_collection_are_counted() -> None:
    ends = [f"That was all, so {text}." for text in ("I stop", "I end here", "now I end here")]
    found = search(episode(turn(end, verbs.END, "", purpose="finish")) for end in ends)
    assert found.closers == {"i stop": 1, "i end here": 2}
    assert (found.closed, found.parts.total()) == (3, 3)
