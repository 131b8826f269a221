"""Claims that the clause readers judge, in other words than those of the collected thoughts."""

from __future__ import annotations

from dataclasses import replace

from support import in_one_test

from er_gym.data.critic import check, review
from er_gym.data.knowledge import Knowledge, LastAction
from er_gym.data.trajectory import SeenObject, Subgoal, ThoughtRecord
from er_gym.envs.actions import Action
from er_gym.envs.feedback_words import OUT_OF_REACH

LIMIT = 200


def _acted(verb: str, name: str = "", success: bool = True, feedback: str = "") -> LastAction:
    action = Action(verb, name)
    return LastAction(action, "search", success, False, feedback or f"Done: {action}.")


DONE = [
    _acted("navigate to", "Cabinet"),
    _acted("open", "Cabinet"),
    _acted("close", "Cabinet"),
    _acted(
        "pickup", "Kettle", False, "You cannot pickup Kettle: none is within reach and in view."
    ),
    _acted("navigate to", "CounterTop"),
    _acted("pickup", "Mug"),
]
KITCHEN = Knowledge(
    language="en",
    instruction="Put the Mug in the Sink.",
    turn=6,
    view=[
        SeenObject(type="CounterTop", side="ahead", distance=0.6),
        SeenObject(type="Apple", side="left", distance=0.7, on="CounterTop"),
        SeenObject(type="Apple", side="left", distance=0.8, on="CounterTop"),
        SeenObject(type="Fridge", side="right", distance=2.4, open=False),
        SeenObject(type="Faucet", side="ahead", distance=0.9, toggled=False),
    ],
    held="Mug",
    at="CounterTop",
    seen={
        "CounterTop": "CounterTop",
        "Apple": "CounterTop",
        "Fridge": "CounterTop",
        "Faucet": "CounterTop",
        "Bread": "",
        "Cabinet": "Cabinet",
        "Kettle": "",
    },
    sightings={
        "CounterTop": ("", "CounterTop"),
        "Apple": ("CounterTop",),
        "Fridge": ("CounterTop",),
        "Faucet": ("CounterTop",),
        "Bread": ("",),
        "Cabinet": ("Cabinet",),
        "Kettle": ("",),
    },
    last=DONE[-1],
    actions=DONE,
    decision=Action("navigate to", "Sink"),
    purpose="approach",
    subgoal=Subgoal(thing="Mug", place="Sink"),
)
"""The agent holds a mug at a counter; it opened a cabinet, and could not take a kettle."""


def codes(text: str) -> set[str]:
    known = KITCHEN if text.isascii() else replace(KITCHEN, language="zh")
    return {each.code for each in check(text, "reasoning", known, limit=LIMIT)}


@in_one_test(
    "case",
    [
        ("I got my hands on the kettle earlier without trouble.", "history"),
        ("I never visited the cabinet.", "history"),
        ("So far I have not opened anything at all.", "history"),
        ("I took the mug, and only afterwards did I open the cabinet.", "history"),
        ("The mug was in my hand before I had even opened the cabinet.", "history"),
        ("I was told that the kettle was locked in place.", "history"),
        ("The bread has never shown itself; it may be in the fridge.", "memory"),
        ("When I was at the cabinet, I noticed the bread.", "memory"),
        ("There is no apple anywhere in this view.", "unseen"),
        ("I can see the bread from here.", "unseen"),
        ("The fridge is packed with food.", "hidden"),
        ("I see three apples next to each other.", "count"),
        ("There is only a single apple on the left.", "count"),
        ("The fridge is within arm's reach of me.", "distance"),
        ("The apples lie clear across the room.", "distance"),
        ("This bathroom has what I need.", "room"),
        ("I was asked to wash the mug before anything else.", "task"),
        ("Water is pouring out of the faucet.", "state"),
        ("Perhaps the apple is in the fridge.", "memory"),
        ("The apple is resting snugly in my palm.", "held"),
        ("The apple is propped on the fridge.", "support"),
        ("The kettle came along without any trouble when I grabbed it.", "history"),
        ("Everything I have tried so far has worked.", "history"),
        ("None of my attempts has failed.", "history"),
        ("My grab at the mug came to nothing.", "history"),
        ("I have never touched the cabinet.", "history"),
        ("I'm going to the sink because the apple goes in there.", "task"),
        ("The mug has to go in the fridge.", "task"),
        ("I go to the sink since the mug is nowhere to be found.", "held"),
        ("The mug slipped out of my hand.", "history"),
        ("I'm opening the fridge now.", "decision"),
        ("Off to the fridge I go.", "decision"),
        ("Never mind the sink.", "decision"),
        ("Mug first, cabinet second: that was my route.", "history"),
        ("水壶一伸手就拿到了。", "history"),
        ("到目前为止每一步都成功了。", "history"),
        ("去水槽是为了把苹果放进去。", "task"),
        ("水槽先不去了。", "decision"),
        ("马克杯还没找到。", "held"),
        ("水壶刚才已经被我拿到了。", "history"),
        ("橱柜我一次都没打开过。", "history"),
        ("我先拿了马克杯，后来才开的橱柜。", "history"),
        ("面包至今没露过面，也许在冰箱里。", "memory"),
        ("视野里没有苹果。", "unseen"),
        ("左边只有一个苹果。", "count"),
        ("冰箱近在咫尺。", "distance"),
        ("这间卧室挺宽敞的。", "room"),
        ("任务要我把苹果洗干净。", "task"),
    ],
)
def test_false_claims_are_refused(case: tuple[str, str]) -> None:
    text, code = case
    assert code in codes(text)


@in_one_test(
    "text",
    [
        "I could not get my hands on the kettle earlier.",
        "I never visited the fridge.",
        "I opened the cabinet, and only afterwards did I take the mug.",
        "The cabinet was opened before I had the mug in my hand.",
        "The answer was that no kettle was within reach.",
        "The egg has never shown itself; it may be in the fridge.",
        "After opening the fridge I will know more.",
        "There is no bread anywhere in this view.",
        "The fridge may be packed with food.",
        "I see two apples next to each other.",
        "The apples are within arm's reach of me.",
        "The fridge is over two metres away.",
        "In most bathrooms there is a towel, but this is a kitchen.",
        "I was asked to put the mug in the sink before anything else.",
        "No water is pouring out of the faucet.",
        "Two bins may stand there, neither of which matters.",
        "Had I gone to the fridge, I might have seen the egg.",
        "If the fridge were open, the egg would be in my hand by now.",
        "Were the faucet on, water would be running.",
        "After I have opened the fridge, I will know more.",
        "With the kettle in hand I could have made tea.",
        "The apples are in view and neither of them is of use.",
        "The cabinet's been opened and closed again.",
        "I never opened the cabinet a second time.",
        "I needn't have opened the cabinet.",
        "I thought the apple would be in the fridge, but it is on the counter.",
        "The cabinet that I saw from the counter is not in view.",
        "Apart from the kettle, everything I tried worked.",
        "The mug has to go in the sink.",
        "I can't help noticing two apples, and not a hint of an egg.",
        "The handle for the fridge is on my left.",
        "None of the faucets is on.",
        "I couldn't see the apples before I came to the counter.",
        "I was told that no kettle was within reach.",
        "要是当初先去冰箱，就不用打开橱柜了。",
        "假如苹果在冰箱里，我现在就该打开它了。",
        "到了水槽那边，我就把马克杯放下。",
        "等马克杯到了水槽里，任务就完成了。",
        "打开橱柜以后，我就能看清楚了。",
        "我没想到苹果会在料理台上。",
        "除了水壶没拿到，其他都成功了。",
        "提示说够得着的范围里没有水壶。",
        "水壶刚才没拿到。",
        "冰箱我一次都没打开过。",
        "我先开了橱柜，后来才拿的马克杯。",
        "鸡蛋至今没露过面，也许在冰箱里。",
        "左边有两个苹果。",
        "任务要我把马克杯放进水槽。",
    ],
)
def test_true_claims_stand(text: str) -> None:
    assert codes(text) == set()


def test_an_answer_in_chinese_is_read_as_one_in_english() -> None:
    told = OUT_OF_REACH.zh.format(action="pickup Kettle", places="Mug")
    actions = [_acted("pickup", "Kettle", False, told)]
    known = replace(KITCHEN, language="zh", actions=actions, last=actions[0])
    for text, code in (
        ("拿水壶的时候，系统说手里已经有东西了。", "history"),
        ("拿水壶的时候，系统说够不着。", ""),
    ):
        found = {each.code for each in check(text, "reasoning", known, limit=LIMIT)}
        assert found == ({code} if code else set())


def test_what_is_said_of_earlier_thoughts_is_compared_with_them() -> None:
    thoughts = ["The fridge may hold it.", *("I go on.",) * (len(DONE) - 1)]
    earlier = [[ThoughtRecord(kind="planning", text=each)] for each in thoughts]
    told = replace(KITCHEN, earlier=earlier)

    def found(text: str, known: Knowledge = told) -> set[str]:
        language = "en" if text.isascii() else "zh"
        known = replace(known, language=language)
        return {each.code for each in check(text, "reasoning", known, limit=LIMIT)}

    for text in (
        "As I suspected earlier, the toaster was no good.",
        "I had never considered the fridge before.",
        "我早就提到过烤面包机。",
    ):
        assert "memory" in found(text)
        assert "memory" not in found(text, replace(told, earlier=[[], *earlier[1:]]))
    for text in ("As I suspected earlier, the fridge was no good.", "我从没想过烤面包机。"):
        assert found(text) == set()


def test_sentences_without_a_claim_are_counted_as_unknown() -> None:
    found = review("How dull. The faucet is off.", "reasoning", KITCHEN, limit=LIMIT)
    assert (found.true, found.false, found.unknown) == (1, 0, 1)
    assert found.open == ("How dull.",)
    lie = review("How dull. The faucet is on.", "reasoning", KITCHEN, limit=LIMIT)
    assert (lie.true, lie.false, lie.unknown) == (0, 1, 1)


@in_one_test(
    "text",
    [
        "料理台和冰箱都没有结果，再找找吧。",
        "还没有收获。要看到里面才行，我拉开冰箱看看里面。",
        "右手边的冰箱走过去很方便。",
    ],
)
def test_what_came_of_nothing_and_what_is_meant_now_is_no_claim(text: str) -> None:
    """没有结果 denies no thing, and without 了 nothing has been opened or visited."""
    assert codes(text) <= {"decision"}


# -- words in any order ----------------------------------------------------------------------------


@in_one_test(
    "case",
    [
        ("What I have come away with is the apple.", "held"),
        ("One hand is busy, since it holds the apple.", "held"),
        ("手里举着苹果。", "held"),
        ("The kettle I pocketed without any trouble.", "history"),
        ("水壶一试就拿到手了。", "history"),
        ("苹果我已经从台面上拿走了。", "history"),
        ("The apple has found its way into the fridge.", "support"),
        ("What the task wants first is the kettle.", "task"),
        ('"You cannot close Cabinet: it is jammed." Fine, leave it.', "history"),
        ("The fridge stands on the right. It is wide open.", "state"),
        ("I started with the counter and moved on to the cabinet.", "history"),
    ],
)
def test_a_false_claim_in_any_order_is_refused(case: tuple[str, str]) -> None:
    text, code = case
    assert code in codes(text), text


@in_one_test(
    "text",
    [
        "What I have come away with is the mug.",
        "My hand must let go of the mug before it can hold the apple.",
        "The kettle would have come without any trouble had it been nearer.",
        "手里是马克杯。",
        "The apple has found its way onto the counter.",
        "What the task wants first is the mug.",
        "The fridge stands on the right. It is closed.",
        "I started with the cabinet and moved on to the counter.",
        "Knives, not sinks, are what I would look for in a drawer.",
    ],
)
def test_an_honest_one_in_any_order_stands(text: str) -> None:
    assert not codes(text), (text, codes(text))
