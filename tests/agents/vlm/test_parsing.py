"""Replies of models, parsed as decisions and thoughts."""

from __future__ import annotations

import random
import time

import pytest
from replies import NORMAL, tagged
from support import in_one_test

from agents.vlm.parsing import ParsedReply, Thought, parse
from agents.vlm.parsing.reply import LONGEST
from agents.vlm.parsing.rules import RULES
from agents.vlm.parsing.vocabulary import THOUGHT_TAGS, VERBS
from er_gym.envs.actions import parse as action_of
from er_gym.tasks import verbs

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
    assert time.process_time() - began < 5
