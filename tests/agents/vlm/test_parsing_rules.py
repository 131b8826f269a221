"""The deviations from the normal form of a reply: each rule, and texts that need it or do not."""

from __future__ import annotations

import pytest
from replies import NORMAL, tagged

from agents.vlm.parsing import Thought, parse
from agents.vlm.parsing.reply import LONGEST
from agents.vlm.parsing.rules import RULES

NAVIGATE, OPEN = ("navigate to", "Fridge"), ("open", "Fridge")
PUT, TOGGLE = ("put in", "Fridge"), ("toggle", "DeskLamp")
JSON = '{"action": "open", "object": "Fridge"}'

NEEDED: dict[str, list[tuple[str, tuple[str, str]]]] = {
    "long": [("x" * LONGEST + NORMAL, NAVIGATE)],
    "no end tag": [
        ("<DecisionMaking>navigate to Fridge", NAVIGATE),
        ("<DecisionMaking>navigate to Fridge</Decis", NAVIGATE),
        ("<DecisionMaking>navigate to Fridge<Reflection>Good.</Reflection>", NAVIGATE),
        ("<DecisionMaking>navigate to Fridge<DecisionMaking>", NAVIGATE),
        ("<Observation>A Fridge." + tagged("navigate to Fridge"), NAVIGATE),
    ],
    "no start tag": [
        ("navigate to Fridge</DecisionMaking>", NAVIGATE),
        ("I go.\nnavigate to Fridge</DecisionMaking>", NAVIGATE),
        ("A Fridge.</Observation>" + tagged("navigate to Fridge"), NAVIGATE),
        (f"Or {tagged('end')}? No.</think>{tagged('open Fridge')}", OPEN),
        (f"Or {tagged('end')}? No.</think>open Fridge", OPEN),
    ],
    "tag spelling": [
        ("<Decision>open Fridge</Decision>", OPEN),
        ("<Decision Making>open Fridge</Decision Making>", OPEN),
        ("<decision_making>open Fridge</decision_making>", OPEN),
        ("<DECISIONMAKING>open Fridge</DecisionMaking>", OPEN),
        ("<action>open Fridge</action>", OPEN),
        ("<think>Hm.</think><answer>open Fridge</answer>", OPEN),
        ("＜DecisionMaking＞open Fridge＜／DecisionMaking＞。", OPEN),
        ("< DecisionMaking >open Fridge< / DecisionMaking >", OPEN),
        ("<决策>open Fridge</决策>", OPEN),
    ],
    "tool call": [
        ('<tool_call>{"name": "open", "arguments": {"object": "Fridge"}}</tool_call>', OPEN),
        (f'<tool_call>\n{{"name": "act", "arguments": {JSON}}}\n</tool_call>', OPEN),
        (
            '<tool_call>{"name": "act", "arguments": "{\\"action\\": \\"open\\", '
            '\\"object\\": \\"Fridge\\"}"}</tool_call>',
            OPEN,
        ),
        ("<tool_call>open(Fridge)</tool_call>", OPEN),
    ],
    "several decisions": [
        (tagged("open Drawer") + tagged("open Fridge"), OPEN),
        (tagged("dance") + "Rather:" + tagged("open Fridge"), OPEN),
    ],
    "no tags": [
        ("open Fridge", OPEN),
        ("I see a Fridge.\n\nopen Fridge", OPEN),
        ("<Observation>A Fridge.</Observation>\nopen Fridge", OPEN),
        ("I see a Fridge.\nAction: open Fridge", OPEN),
        ("**Decision:** open Fridge\n\nThat is it.", OPEN),
        ("### DecisionMaking\n\nopen Fridge", OPEN),
        ("[Decision] open Fridge", OPEN),
        ("Action: open Drawer\nAction: open Fridge", OPEN),
        ("决策：open Fridge", OPEN),
        ("open(Fridge)", OPEN),
    ],
    "in thoughts": [
        (f"<think>Well. {tagged('open Fridge')}</think>", OPEN),
        ("<Planning>I open it.\nAction: open Fridge", OPEN),
        ("<Planning>I open it.\nopen Fridge", OPEN),
    ],
    "code fence": [
        ("```\nopen Fridge\n```", OPEN),
        (f"Here:\n```json\n{JSON}\n```", OPEN),
        (f"```json\n{JSON}", OPEN),
        (tagged("\n```text\nopen Fridge\n```\n"), OPEN),
        (tagged("```open Fridge```"), OPEN),
    ],
    "json": [
        (JSON, OPEN),
        (tagged(JSON), OPEN),
        ("Well.\n" + JSON + "\nDone.", OPEN),
        ('{"action": "open Fridge"}', OPEN),
        ('{"verb": "open", "target": "Fridge"}', OPEN),
        ('{"verb": "open", "name": "Fridge"}', OPEN),
        ("{'action': 'open', 'object': 'Fridge',}", OPEN),
        ("{action: open, object: Fridge}", OPEN),
        ('{"action": "open", "object": "Fridge"', OPEN),
        ('{“action”: "end"} ' + JSON, OPEN),
        ('{"action": {"verb": "open", "object": "Fridge"}}', OPEN),
        ('[{"action": "open", "object": "Fridge"}, {"action": "end"}]', OPEN),
        ('{"action": "end"}\n\nNo:\n' + JSON, OPEN),
        (JSON + '\nwhere {"name": "Fridge", "distance": 2}', OPEN),
        ('{"thought": "It\'s {closed}.", "action": "open", "object": "Fridge"}', OPEN),
        ('{"thoughts": "So :} or ]?", "action": "open", "object": "Fridge"}', OPEN),
        ("As in [1] and [2, " + JSON, OPEN),
        ('{"action": "put", "object": "Egg", "target": "Fridge"}', PUT),
    ],
    "full width": [
        (tagged("ｏｐｅｎ　Ｆｒｉｄｇｅ"), OPEN),
        (tagged("open（Fridge）"), OPEN),
        (tagged("open Fridge，它关着"), OPEN),
    ],
    "several actions": [
        (tagged("navigate to Fridge\nopen Fridge"), NAVIGATE),
        (tagged("navigate to Fridge; open Fridge"), NAVIGATE),
        (tagged("navigate to Fridge, then open it"), NAVIGATE),
        (tagged("navigate to Fridge and then open it"), NAVIGATE),
        (tagged("navigate to Fridge -> open Fridge"), NAVIGATE),
        (tagged("1. navigate to Fridge\n2. open Fridge"), NAVIGATE),
        (tagged("1. navigate to Fridge 2. open Fridge"), NAVIGATE),
        (tagged("The Fridge is near.\nnavigate to Fridge"), NAVIGATE),
        ("My plan:\n1. navigate to Fridge\n2. open Fridge", NAVIGATE),
        (tagged("前往 Fridge，然后打开它"), NAVIGATE),
    ],
    "label": [
        (tagged("Action: open Fridge"), OPEN),
        (tagged("**Final Decision:** open Fridge"), OPEN),
        (tagged("1. Action: open Fridge"), OPEN),
        (tagged("Next action: open Fridge"), OPEN),
    ],
    "marks": [
        (tagged("open Fridge."), OPEN),
        (tagged('"open Fridge"'), OPEN),
        (tagged("open 'Fridge'"), OPEN),
        (tagged("**open** `Fridge`"), OPEN),
        (tagged("[open] Fridge"), OPEN),
        (tagged("open <Fridge>"), OPEN),
        (tagged("open_Fridge"), OPEN),
        (tagged("open 【Fridge】"), OPEN),
        (tagged("open Fridge<|im_end|>"), OPEN),
        (tagged("\\boxed{open Fridge}"), OPEN),
        ("open Fridge</s>", OPEN),
        (tagged("observe."), ("observe", "")),
    ],
    "list": [
        (tagged("- open Fridge"), OPEN),
        (tagged("1. open Fridge"), OPEN),
        (tagged("Step 1: open Fridge"), OPEN),
    ],
    "lead-in": [
        (tagged("I will open Fridge"), OPEN),
        (tagged("I’ll now open Fridge"), OPEN),
        (tagged("Next, let me open Fridge"), OPEN),
        (tagged("我将 open Fridge"), OPEN),
        ("Decision: let's open Fridge", OPEN),
    ],
    "call form": [
        (tagged("navigate_to(Fridge)"), NAVIGATE),
        (tagged('navigate_to("Fridge")'), NAVIGATE),
        (tagged("navigate_to(object='Fridge')"), NAVIGATE),
        (tagged("go_to('Fridge');"), NAVIGATE),
        (tagged("put_in(Egg, Fridge)"), PUT),
        (tagged("put_in(receptacle=Fridge, object=Egg)"), PUT),
        (tagged('act(action="open", object="Fridge")'), OPEN),
        (tagged("[open(Fridge)]"), OPEN),
        (tagged("observe()"), ("observe", "")),
    ],
    "verb spelling": [
        (tagged("navigate_to Fridge"), NAVIGATE),
        (tagged("NavigateTo Fridge"), NAVIGATE),
        (tagged("navigate-to Fridge"), NAVIGATE),
        (tagged("navigate Fridge"), NAVIGATE),
        (tagged("pick up Mug"), ("pickup", "Mug")),
        (tagged("put_in Fridge"), PUT),
        (tagged("PutIn Fridge"), PUT),
        (tagged("put Fridge"), PUT),
        (tagged("MoveForward"), ("move forward", "")),
    ],
    "verb synonym": [
        (tagged("walk over to Fridge"), NAVIGATE),
        (tagged("grab Mug"), ("pickup", "Mug")),
        (tagged("PickupObject Mug"), ("pickup", "Mug")),
        (tagged("shut Fridge"), ("close", "Fridge")),
        (tagged("turn off DeskLamp"), TOGGLE),
        (tagged("toggle on DeskLamp"), TOGGLE),
        (tagged("switch_on DeskLamp"), TOGGLE),
        (tagged("cut Bread"), ("slice", "Bread")),
        (tagged("look around"), ("observe", "")),
        (tagged("look"), ("observe", "")),
        (tagged("MoveAhead"), ("move forward", "")),
        (tagged("done"), ("end", "")),
        (tagged("打开冰箱"), ("open", "冰箱")),
    ],
    "verb parted": [
        (tagged("turn DeskLamp on"), TOGGLE),
        (tagged("switch DeskLamp off."), TOGGLE),
        (tagged("pick Mug up"), ("pickup", "Mug")),
        (tagged("把苹果拿起来"), ("pickup", "苹果")),
    ],
    "put form": [
        (tagged("put Egg in Fridge"), PUT),
        (tagged("put Egg into Fridge"), PUT),
        (tagged("put in Egg into Fridge"), PUT),
        (tagged("put it back inside Fridge"), PUT),
        (tagged("put Egg on top of Fridge"), PUT),
        (tagged("put down in Fridge"), PUT),
        (tagged("put on Fridge"), PUT),
        (tagged("place Egg on Fridge"), PUT),
        (tagged("Insert Egg into Fridge"), PUT),
        (tagged("把鸡蛋放进 Fridge"), PUT),
    ],
    "article": [
        (tagged("open the Fridge"), OPEN),
        (tagged("open that Fridge"), OPEN),
        (tagged("put Egg in the Fridge"), PUT),
        (tagged("打开那个冰箱"), ("open", "冰箱")),
        ('{"action": "open", "object": "the Fridge"}', OPEN),
    ],
    "clause": [
        (tagged("pickup Egg from Fridge"), ("pickup", "Egg")),
        (tagged("pickup Egg in Fridge"), ("pickup", "Egg")),
        (tagged("slice Bread with Knife"), ("slice", "Bread")),
        (tagged("open Fridge (it is closed)"), OPEN),
        (tagged("open Fridge, which is closed."), OPEN),
        (tagged("open Fridge and take Egg"), OPEN),
        (tagged("open Fridge now"), OPEN),
        (tagged("open Fridge. It is closed."), OPEN),
        (tagged("放进冰箱里"), ("put in", "冰箱")),
    ],
    "words after": [
        (tagged("observe the room"), ("observe", "")),
        (tagged("move forward 0.25 m"), ("move forward", "")),
        (tagged("end the task"), ("end", "")),
        ('{"action": "observe", "object": "Fridge"}', ("observe", "")),
    ],
}
"""By rule: replies that need it, and what they decide."""

NOT_NEEDED: dict[str, list[str]] = {
    "long": [NORMAL, "x" * (LONGEST - len(NORMAL)) + NORMAL],
    "no end tag": [NORMAL, "<Planning>x" + "</Planning>" + tagged("end"), "a < b > c"],
    "no start tag": [NORMAL, "<Observation>a</Observation></Observation>" + tagged("end")],
    "tag spelling": [NORMAL, "<Dance>open Fridge</Dance>", "<Thinking>a</Thinking>end"],
    "tool call": [NORMAL, JSON],
    "several decisions": [NORMAL, tagged("end") * 2, f"<think>{tagged('observe')}</think>end"],
    "no tags": [
        NORMAL,
        "Reaction: open Fridge",
        "I would rather not open Fridge",
        "I will open the Fridge.",
        "open Fridge\nThat is what I do.",
        "Open the door to your heart and let the sunshine in.",
    ],
    "in thoughts": [
        f"<think>{tagged('open Fridge')}</think>{tagged('close Fridge')}",
        f"<think>{tagged('open Fridge')}</think>close Fridge",
        "<Planning>open Fridge</Planning>",
    ],
    "code fence": [NORMAL, "`open Fridge`"],
    "json": [NORMAL, "{open Fridge}", '{"size": "5"}', "[open] Fridge"],
    "full width": [NORMAL, tagged("打开冰箱"), "今天，好：" + tagged("end")],
    "several actions": [NORMAL, tagged("\n\nopen Fridge\n\n"), tagged("dance; sing")],
    "label": [NORMAL, tagged("Reaction: open Fridge"), tagged("open Action: Fridge")],
    "marks": [NORMAL, tagged("open Fridge|+00.97|-01.00|+01.25"), tagged("open Dining_Table_1")],
    "list": [NORMAL, tagged("open 1 Drawer")],
    "lead-in": [NORMAL, tagged("I like to open Fridge"), "I will open Fridge"],
    "call form": [NORMAL, tagged("dance(Fridge)"), tagged("open Fridge (action: end)")],
    "verb spelling": [
        NORMAL,
        tagged("opened Fridge"),
        tagged("openFridge2x door"),
        "put in Fridge",
    ],
    "verb synonym": [NORMAL, tagged("search Fridge"), tagged("look for Fridge")],
    "verb parted": [NORMAL, tagged("turn left"), tagged("toggle DeskLamp")],
    "put form": [
        NORMAL,
        tagged("put in Fridge"),
        tagged("drop Mug"),
        tagged("input Egg in Fridge"),
    ],
    "article": [NORMAL, tagged("open Theatre"), tagged("open AnApple")],
    "clause": [NORMAL, tagged("pickup ToiletPaper"), tagged("open Frozen Foods")],
    "words after": [NORMAL, tagged("stop the Microwave"), tagged("end table"), tagged("observe")],
}
"""By rule: replies that do not need it, or are not understood, for all that they come close."""

_EACH_NEEDED = [(rule, *case) for rule, cases in NEEDED.items() for case in cases]
_EACH_NOT = [(rule, text) for rule, texts in NOT_NEEDED.items() for text in texts]


def test_every_rule_is_tried_both_ways() -> None:
    names = [rule.name for rule in RULES]
    assert len(set(names)) == len(names)
    assert list(NEEDED) == names
    assert list(NOT_NEEDED) == names
    assert all(rule.about for rule in RULES)


@pytest.mark.parametrize(
    ("rule", "text", "expected"), _EACH_NEEDED, ids=[f"{r}:{t[-50:]}" for r, t, _ in _EACH_NEEDED]
)
def test_understood_by_a_rule(rule: str, text: str, expected: tuple[str, str]) -> None:
    parsed = parse(text)
    assert (parsed.verb, parsed.name, parsed.problem) == (*expected, "")
    assert rule in parsed.rules


@pytest.mark.parametrize(("rule", "text"), _EACH_NOT, ids=[f"{r}:{t[-50:]}" for r, t in _EACH_NOT])
def test_a_rule_that_is_not_needed(rule: str, text: str) -> None:
    assert rule not in parse(text).rules


@pytest.mark.parametrize(
    ("text", "rules"),
    [
        (tagged("open the Fridge."), ("marks", "article")),
        ("```json\n" + JSON + "\n```", ("code fence", "json")),
        ("<Action>I'll go to the fridges", ("no end tag", "tag spelling", "lead-in",
                                            "verb synonym", "article")),
    ],
)  # fmt: skip
def test_rules_are_all_told_in_the_order_of_their_table(text: str, rules: tuple[str, ...]) -> None:
    assert parse(text).rules == rules


def test_thoughts_before_decisions_of_all_kinds() -> None:
    thinks = (Thought("Thinking", "It is closed."),)
    for said in ("open Fridge", "Action: open Fridge", JSON, f"```json\n{JSON}\n```"):
        assert parse(f"It is closed.\n{said}").thoughts == thinks
    assert parse('{"thought": "It is closed.", "action": "end"}').thoughts == thinks
    assert parse("It is closed.</think>open Fridge").thoughts == thinks
