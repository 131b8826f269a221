"""Replies of models, parsed as decisions and thoughts."""

from __future__ import annotations

import random
import time

import pytest
from support import in_one_test

from agents.vlm.parsing import ParsedReply, Thought, parse
from agents.vlm.parsing.reply import LONGEST
from agents.vlm.parsing.rules import RULES
from agents.vlm.parsing.vocabulary import THOUGHT_TAGS, VERBS
from er_gym.envs.actions import parse as action_of
from er_gym.tasks import verbs


def tagged(words: str) -> str:
    return f"<DecisionMaking>{words}</DecisionMaking>"


NORMAL = "<Observation>I see a Fridge.</Observation>\n<Planning>I go there.</Planning>\n" + tagged(
    "navigate to Fridge"
)
SEEN = (Thought("Observation", "I see a Fridge."), Thought("Planning", "I go there."))


# -- clean replies ---------------------------------------------------------------------------------


def test_the_normal_form() -> None:
    assert parse(NORMAL) == ParsedReply("navigate to", "Fridge", SEEN)


@pytest.mark.parametrize("verb", [*verbs.OBJECT_VERBS, *verbs.BARE_VERBS])
def test_every_verb_is_clean(verb: str) -> None:
    name = "CounterTop" if verb in verbs.OBJECT_VERBS else ""
    assert parse(tagged(f"{verb} {name}".strip())) == ParsedReply(verb, name)


def test_space_and_the_case_of_a_verb_do_not_matter() -> None:
    assert parse(tagged("\n Navigate  to\tFridge \n")) == ParsedReply("navigate to", "Fridge")


@pytest.mark.parametrize(
    ("tag", "kind"),
    [
        ("Situation Analysis", "Observation"),
        ("SituationAnalysis", "Observation"),
        ("Task-Planning", "Planning"),
        ("spatial_reasoning", "Thinking"),
        ("Thinking", "Thinking"),
        ("SELF-REFLECTION", "Reflection"),
        ("Reflection", "Reflection"),
        ("Double Verification", "Verification"),
        ("Verification", "Verification"),
        ("think", "Thinking"),
        ("观察", "Observation"),
    ],
)
def test_names_of_thoughts(tag: str, kind: str) -> None:
    parsed = parse(f"<{tag}> So it is. </{tag}>" + tagged("end"))
    assert parsed == ParsedReply("end", thoughts=(Thought(kind, "So it is."),))


def test_thoughts_keep_their_order_also_behind_the_decision() -> None:
    text = "<Reflection>a</Reflection>" + tagged("end") + "<Reflection>b</Reflection>"
    assert [thought.text for thought in parse(text).thoughts] == ["a", "b"]


def test_text_outside_of_tags_is_a_thought_where_no_tag_holds_one() -> None:
    assert parse("I go.\nNow!\n" + tagged("end") + " Bye.").thoughts == (
        Thought("Thinking", "I go.\nNow!"),
    )
    assert parse("Well. " + NORMAL).thoughts == SEEN


def test_what_is_weighed_in_think_is_not_decided() -> None:
    weighed = f"First {tagged('open Fridge')}? <Planning>No.</Planning>"
    parsed = parse(f"<think>{weighed}</think>{tagged('close Fridge')}")
    assert parsed == ParsedReply("close", "Fridge", (Thought("Thinking", weighed),))


@pytest.mark.parametrize(
    ("call", "verb", "name"),
    [
        ('{"action": "navigate to", "object": "Fridge"}', "navigate to", "Fridge"),
        ('{"verb": "open", "target": "冰箱"}', "open", "冰箱"),
        ('{"action": "put in", "object": "Apple", "receptacle": "Fridge"}', "put in", "Fridge"),
        ('{"action": "put in", "object": "Fridge"}', "put in", "Fridge"),
        ('{"action": "observe", "object": ""}', "observe", ""),
        ('{"action": "observe", "object": null}', "observe", ""),
        ('{"action": "pickup Mug"}', "pickup", "Mug"),
    ],
)
def test_tool_calls(call: str, verb: str, name: str) -> None:
    assert parse("", call) == ParsedReply(verb, name)


def test_a_call_counts_before_the_text_and_may_have_thoughts() -> None:
    call = '{"observation": "A Mug，\\u518d.", "action": "pickup", "object": "Mug"}'
    assert parse("I take it. " + tagged("end"), call) == ParsedReply(
        "pickup", "Mug", (Thought("Observation", "A Mug，再."),)
    )
    assert parse("I take it.", '{"action": "end"}').thoughts == (Thought("Thinking", "I take it."),)


def test_json_is_the_normal_form_where_it_is_asked_for() -> None:
    text = '{"thoughts": "It is closed.", "action": "open", "object": "Fridge"}\n'
    thoughts = (Thought("Thinking", "It is closed."),)
    assert parse(text, decide="json") == ParsedReply("open", "Fridge", thoughts)
    assert parse(text).rules == ("json",)
    assert parse("Well: " + text, decide="json").rules == ("json",)
    assert parse(text[:-2], decide="json").rules == ("json",)
    assert parse("", text[:-2]).rules == ("json",)
    assert parse(NORMAL, decide="json") == parse(NORMAL)


def test_a_call_that_cannot_be_read_is_a_problem_whatever_the_text_says() -> None:
    assert "'{\"x\": 5}' is not an action" in parse(NORMAL, '{"x": 5}').problem


# -- rules -----------------------------------------------------------------------------------------

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


# -- verbs and names -------------------------------------------------------------------------------


@in_one_test("phrase", VERBS)
def test_every_way_to_say_a_verb(phrase: str) -> None:
    verb = VERBS[phrase]
    assert verb in (*verbs.OBJECT_VERBS, *verbs.BARE_VERBS)
    name = "Fridge" if verb in verbs.OBJECT_VERBS else ""
    parsed = parse(tagged(f"{phrase} {name}"))
    assert (parsed.verb, parsed.name) == (verb, name)
    if phrase.isascii():
        for joined in (phrase.replace(" ", "_"), phrase.title().replace(" ", "")):
            parsed = parse(tagged(f"{joined} {name}"))
            assert (parsed.verb, parsed.name) == (verb, name)


@in_one_test("verb", verbs.OBJECT_VERBS)
@pytest.mark.parametrize("name", ["CounterTop", "credit card", "Fridge|+00.97|-01.00", "信用卡"])
def test_names_stay_as_they_are_written(verb: str, name: str) -> None:
    assert parse(tagged(f"{verb} {name}")) == ParsedReply(verb, name)
    assert parse(tagged(f"{verb} the {name}.")).name == name


def test_what_is_understood_is_an_action_of_the_environment() -> None:
    parsed = parse("Sure! <action>Put the egg into the Fridge.</action>")
    assert str(action_of(f"{parsed.verb} {parsed.name}")) == "put in Fridge"


def test_tags_and_kinds_agree() -> None:
    kinds = {"Observation", "Planning", "Thinking", "Reflection", "Verification"}
    assert {*THOUGHT_TAGS.values()} == kinds


# -- problems --------------------------------------------------------------------------------------


@pytest.mark.parametrize("text", ["", "  \n\t"])
def test_empty_replies(text: str) -> None:
    assert parse(text) == ParsedReply(
        problem="The reply is empty. Decide on one action, such as 'navigate to Fridge'."
    )


@pytest.mark.parametrize(
    "text",
    [
        "I'm sorry, I can't help with that.",
        "抱歉，我不能这样做。",
        "<DecisionMaking></DecisionMaking>",
        "```\n```",
        "{}",
    ],
)
def test_replies_without_a_decision(text: str) -> None:
    parsed = parse(text)
    assert parsed.problem == (
        "The reply has no decision. Decide on one action, such as 'navigate to Fridge'."
    )
    assert parsed.verb == parsed.name == ""


def test_a_refusal_is_kept_as_a_thought() -> None:
    assert parse("I'm sorry.").thoughts == (Thought("Thinking", "I'm sorry."),)
    assert parse("<Observation>Hm.</Observation> No.").thoughts == (Thought("Observation", "Hm."),)


@pytest.mark.parametrize(
    "said",
    ["dance", "dance with Fridge", "search the room", "rotate left", "stop the Microwave",
     "end table", "opening Fridge", "look for the Mug", "drop Mug", "Fridge", "init"],
)  # fmt: skip
def test_unknown_verbs_list_those_there_are(said: str) -> None:
    assert parse(tagged(said)) == ParsedReply(
        problem=f"'{said}' is not an action. Actions with an object: navigate to, pickup, put in, "
        "open, close, toggle, slice; without one: observe, move forward, end. Write one, such as "
        "'navigate to Fridge'."
    )


def test_an_invalid_action_is_quoted_briefly_in_one_line() -> None:
    problem = parse(tagged("dance\n" * 1000)).problem
    assert problem.startswith(f"'{'dance ' * 9}dance…' is not an action.")


@in_one_test("verb", verbs.OBJECT_VERBS)
@pytest.mark.parametrize("name", ["", "it", "<object>", "the", "."])
def test_verbs_that_lack_their_object(verb: str, name: str) -> None:
    parsed = parse(tagged(f"{verb} {name}"))
    assert parsed.problem == f"'{verb}' needs an object. Name one, such as in '{verb} Fridge'."
    assert parsed.verb == parsed.name == ""


# -- whatever comes --------------------------------------------------------------------------------

_PIECES = [
    "<DecisionMaking>", "</DecisionMaking>", "<think>", "</think>", "<Observation>", "</Planning>",
    "<tool_call>", "<", ">", "</", "＜", "＞", "{", "}", "[", "]", "(", ")", '"', "'", "“", "\\",
    "\\u", '"action"', '"object":', ":", "：", "=", ",", ";", "```", "json", "\n", " ", "  ", "\t",
    "navigate to", "put", "in", "pick", "up", "turn", "on", "then", "the", "observe", "end",
    "Fridge", "Fridge|+00.97", "把", "放进", "打开", "。", "Action:", "1.", "-", "*", "I will",
    "let", "\x00", "\ud800", "\ufdfa", "é", "😀", "\u202e", "0.25",
]  # fmt: skip


def test_never_raises_and_either_decides_or_says_why() -> None:
    chance = random.Random(7)
    kinds = {*THOUGHT_TAGS.values()}
    names = [rule.name for rule in RULES]
    decided = 0
    for _ in range(4000):
        text = "".join(chance.choice(_PIECES) for _ in range(chance.randrange(20)))
        parsed = parse(text, text if chance.random() < 0.2 else "")
        assert bool(parsed.verb) != bool(parsed.problem), text
        assert bool(parsed.name) == (parsed.verb in verbs.OBJECT_VERBS), text
        assert "\n" not in parsed.problem
        assert [*parsed.rules] == [name for name in names if name in parsed.rules]
        assert {thought.kind for thought in parsed.thoughts} <= kinds
        assert all(thought.text.strip() for thought in parsed.thoughts)
        decided += bool(parsed.verb)
    assert 100 < decided < 3900


def test_never_raises_on_any_characters() -> None:
    chance = random.Random(8)
    for size in (1, 5, 50, 500):
        for _ in range(100):
            text = "".join(chr(chance.randrange(0x110000)) for _ in range(size))
            for reply in (text, tagged(text), f'{{"action": "{text}"}}', f"open {text}"):
                parsed = parse(reply, text)
                assert bool(parsed.verb) != bool(parsed.problem)


_HUGE = 2_000_000


@pytest.mark.parametrize(
    "piece",
    ["<", "<a", "< ", "{", "[ ", '{"a":', '{"', '{"\\"', '[{"', '"', '"\\', "'a':", "```",
     '```json\n{"action":', " ", "\n", "\t.", "<think>", "</think>", "<think>a</think>",
     "<DecisionMaking>", "a</Planning>", "<DecisionMaking>dance</DecisionMaking>",
     "Action: dance\n", "open Fridge\n", "put in ", "(", "navigate_to(", ";", " then ", "1. ",
     "把", "\ufdfa", "x", "**", '{"action": "dance"}', '{"action":"end"'],
)  # fmt: skip
def test_huge_replies_are_read_in_no_time(piece: str) -> None:
    huge = piece * (_HUGE // len(piece))
    for text in (huge, "<DecisionMaking>" + huge[: LONGEST - 20]):
        began = time.process_time()
        parse(text)
        assert time.process_time() - began < 5  # a quadratic parser takes minutes
    began = time.process_time()
    parse("", huge)
    assert time.process_time() - began < 0.5
