from __future__ import annotations

import re

import pytest
from support import in_one_test

from er_gym.tasks.wordings.english import ENGLISH, in_order
from er_gym.tasks.wordings.grammar import Style
from er_gym.tasks.wordings.words import (
    HOLLOW,
    PLURAL,
    UNCOUNTED,
    in_or_on_the,
    pronoun,
    subject_words,
    verb_to_be,
    with_article,
)
from er_gym.thor import OBJECT_TYPES

WORDINGS = {kind: parts.all for kind, parts in ENGLISH.templates.items()}
EVERY = [(name, template) for name, rows in WORDINGS.items() for template in rows]
"""Each template with the name of the wording that it belongs to."""
STYLES = ENGLISH.orders.all
FIRST = {
    "find": "Find the {object} in the {room}.",
    "pick up": "Pick up the {object} in the {room}.",
    "toggle": "Turn {way} the {object} in the {room}.",
    "move": "Put the {object} {place}.",
    "move two": "First, put the {object} {place}; then, put the {second_object} {second_place}.",
}
ON = frozenset(
    {
        *("ArmChair", "Bathtub", "Bed", "Chair", "CoffeeTable", "CounterTop", "Desk"),
        *("DiningTable", "DogBed", "Dresser", "Floor", "Footstool", "HandTowelHolder", "Ottoman"),
        *("Plate", "Shelf", "ShelvingUnit", "SideTable", "Sink", "Sofa", "Stool", "StoveBurner"),
        *("TVStand", "Toilet", "ToiletPaperHanger", "TowelHolder"),
    }
)


def second(words: dict[str, str]) -> dict[str, str]:
    return {f"second_{key}": word for key, word in words.items() if key != "is"}


SUBJECTS = {
    "vowel": subject_words("Apple"),
    "uncounted": subject_words("Bread"),
    "plural": subject_words("Boots"),
    "long": subject_words("Book", "on the Desk"),
    "plural-long": subject_words("Boots", "in the Box"),
}
PARTNERS = {
    "vowel": subject_words("Boots"),
    "uncounted": subject_words("Egg"),
    "plural": subject_words("Lettuce"),
    "long": subject_words("CD", "in the Drawer"),
    "plural-long": subject_words("ToiletPaper", "on the Toilet"),
}


def fill(template: str, case: str) -> str:
    words = {
        **SUBJECTS[case],
        **second(PARTNERS[case]),
        "room": "living room",
        "way": "off",
        "place": "in the Fridge",
        "second_place": "on the Shelf",
    }
    return template.format_map(words)


@pytest.mark.parametrize("wording", WORDINGS)
def test_a_wording_has_many_templates_all_different(wording: str) -> None:
    rows = WORDINGS[wording]
    assert rows[0] == FIRST[wording]
    assert len(rows) >= 160
    assert len({re.sub(r"\W+", " ", row).casefold() for row in rows}) == len(rows)
    assert len({" ".join(row.split()[:3]) for row in rows}) >= 12


@pytest.mark.parametrize("case", SUBJECTS)
@in_one_test("template", [template for _, template in EVERY])
def test_a_filled_template_is_an_english_instruction(template: str, case: str) -> None:
    text = fill(template, case)
    assert re.fullmatch(r"[A-Z].*[.?]", text)
    assert not re.search(r"[{}]|\s\s|\s[,.;:?]|^\s|\s$", text)
    assert not re.search(r"[.?] [a-z]", text)
    assert not re.search(r"\ba [aeiou]|\ban [^aeiou]", text, re.IGNORECASE)
    assert not re.search(r"\b(the|a|an|some) (the|a|an|some)\b", text)
    assert "'s" not in text


@pytest.mark.parametrize("case", SUBJECTS)
@in_one_test("row", EVERY)
def test_a_filled_template_names_everything(row: tuple[str, str], case: str) -> None:
    wording, template = row
    text = fill(template, case)
    assert SUBJECTS[case]["object"] in text
    assert ("in the Fridge" in text) == (wording in ("move", "move two"))
    assert (" off" in text) == (wording == "toggle")
    if wording == "move two":
        assert PARTNERS[case]["object"] in text
        assert "on the Shelf" in text


@in_one_test("template", [template for _, template in EVERY])
def test_pronouns_and_verbs_agree_with_the_subject(template: str) -> None:
    words = {"room": "kitchen", "way": "on", "place": "in the Box", "second_place": "on the Bed"}
    one, many = subject_words("Apple"), subject_words("Boots")
    singular = template.format_map({**words, **one, **second(one)})
    plural = template.format_map({**words, **many, **second(many)})
    assert not re.search(r"\bthem\b|Apple (are|have)\b|are the Apple", singular)
    # "see to it that" is not about the thing.
    assert not re.search(r"(?<![Ss]ee to )\bit\b|Boots (is|has|goes)\b|is the Boots", plural)


@in_one_test("template", WORDINGS["find"])
def test_a_search_does_not_ask_to_take_the_thing(template: str) -> None:
    taking = r"\b(pick|take|get|grab|fetch|bring|hold|held|carry|give|lift|hand)\b"
    assert not re.search(taking, template, re.IGNORECASE)


@in_one_test("template", WORDINGS["pick up"])
def test_a_pickup_says_that_the_thing_is_to_be_held(template: str) -> None:
    held = r"[Pp]ick(ed|ing)? (up|\{it\} up)|hand\b|\b[Hh]old(ing)?\b|\bheld\b"
    assert re.search(held, template)


@pytest.mark.parametrize(
    ("field", "follows"), [("{object}", r" \{way\}"), ("{an_object}", r" (up|\{way\})")]
)
def test_no_particle_is_torn_from_its_verb_by_a_long_name(field: str, follows: str) -> None:
    for _, template in EVERY:
        assert not re.search(re.escape(field) + follows, template)


@in_one_test("template", WORDINGS["move two"])
def test_two_transfers_are_in_plain_order(template: str) -> None:
    order = r"\b([Ff]irst|then|after|afterwards|order|[Bb]efore|[Oo]nce|[Ww]hen|[Nn]ext|[Ss]tep)\b"
    assert re.search(order, template)
    first, other = template.index("{place}"), template.index("{second_place}")
    assert first < other or template.startswith("Before you put the {second_object}")


CLAUSES = (
    "take the Lettuce and wash it in the SinkBasin, under the Faucet",
    "slice the Lettuce with the Knife",
    "put the Knife in the Drawer, and shut that",
    "fry the PotatoSliced in the Pan",
    "switch off the StoveKnob",
    "serve the Lettuce on the Plate",
)


@pytest.mark.parametrize("count", range(1, 7))
@in_one_test("style", STYLES)
def test_joined_clauses_stand_verbatim_in_their_order(style: Style, count: int) -> None:
    clauses = CLAUSES[:count]
    text = in_order(clauses, style)
    lowered = text.casefold()
    places = [lowered.find(clause.casefold()) for clause in clauses]
    assert places == sorted(places)
    assert places[0] >= 0
    for place, clause in zip(places, clauses, strict=True):
        assert text[place + 1 : place + len(clause)] == clause[1:]
    assert re.fullmatch(r"[A-Z].*[.?]", text)
    assert not re.search(r"[{}]|\s\s|\s[,.;:?]|[,.;:?]{2}|[.?] [a-z]", text)


@in_one_test("style", STYLES)
def test_one_clause_alone_has_no_order(style: Style) -> None:
    text = in_order(["slice the Bread"], style)
    assert not re.search(r"\b(first|then|next|step|finally|begin)\b", text, re.IGNORECASE)


def test_styles_differ() -> None:
    assert len(STYLES) >= 120
    for count in (2, 3, 6):  # a clause alone has no order
        assert len({in_order(CLAUSES[:count], style) for style in STYLES}) == len(STYLES)


def test_a_clause_may_hold_braces() -> None:
    assert in_order(["say {clause}", "say {}"], STYLES[0]) == "First, say {clause}. Then, say {}."


def test_only_the_last_of_three_or_more_is_the_final_one() -> None:
    assert in_order(["go", "look"], STYLES[0]) == "First, go. Then, look."
    assert in_order(["go", "look", "stop"], STYLES[0]) == "First, go. Then, look. Finally, stop."
    assert in_order(["go", "look", "turn", "stop"], STYLES[4]) == (
        "Step 1: go. Step 2: look. Step 3: turn. Step 4: stop."
    )


def test_joining_nothing_is_an_error() -> None:
    with pytest.raises(ValueError, match="no clauses to join"):
        in_order([], STYLES[0])


def test_every_receptacle_is_either_hollow_or_not() -> None:
    receptacles = {name for name, kind in OBJECT_TYPES.items() if "receptacle" in kind.properties}
    assert receptacles == HOLLOW | ON
    assert not HOLLOW & ON


@pytest.mark.parametrize(
    ("receptacle", "where"),
    [
        # What lies on the rim or the lid, not in the hollow.
        ("Sink", "on the Sink"),
        ("SinkBasin", "in the SinkBasin"),
        ("Bathtub", "on the Bathtub"),
        ("BathtubBasin", "in the BathtubBasin"),
        ("Toilet", "on the Toilet"),
        ("Plate", "on the Plate"),
        ("Bowl", "in the Bowl"),
        ("Pan", "in the Pan"),
        ("Pot", "in the Pot"),
        ("Mug", "in the Mug"),
        ("CoffeeMachine", "in the CoffeeMachine"),
        ("StoveBurner", "on the StoveBurner"),
        ("Toaster", "in the Toaster"),
        ("ShelvingUnit", "on the ShelvingUnit"),
        ("Dresser", "on the Dresser"),
        ("Safe", "in the Safe"),
        ("Cabinet", "in the Cabinet"),
        ("ArmChair", "on the ArmChair"),
        ("Sofa", "on the Sofa"),
        ("Bed", "on the Bed"),
        ("DogBed", "on the DogBed"),
        ("Footstool", "on the Footstool"),
        ("LaundryHamper", "in the LaundryHamper"),
        ("GarbageCan", "in the GarbageCan"),
        ("ToiletPaperHanger", "on the ToiletPaperHanger"),
        ("HandTowelHolder", "on the HandTowelHolder"),
    ],
)
def test_where_a_thing_lies(receptacle: str, where: str) -> None:
    assert in_or_on_the(receptacle) == where


@pytest.mark.parametrize(
    ("object_type", "article", "it", "verb"),
    [
        ("Apple", "an Apple", "it", "is"),
        ("AlarmClock", "an AlarmClock", "it", "is"),
        ("EggCracked", "an EggCracked", "it", "is"),
        ("Ottoman", "an Ottoman", "it", "is"),
        ("HousePlant", "a HousePlant", "it", "is"),
        ("CD", "a CD", "it", "is"),
        ("TVStand", "a TVStand", "it", "is"),
        ("TissueBox", "a TissueBox", "it", "is"),
        ("PaperTowelRoll", "a PaperTowelRoll", "it", "is"),
        ("AluminumFoil", "some AluminumFoil", "it", "is"),
        ("Bread", "some Bread", "it", "is"),
        ("BreadSliced", "some BreadSliced", "it", "is"),
        ("AppleSliced", "some AppleSliced", "it", "is"),
        ("ToiletPaper", "some ToiletPaper", "it", "is"),
        ("Boots", "some Boots", "them", "are"),
        ("Blinds", "some Blinds", "them", "are"),
        ("Curtains", "some Curtains", "them", "are"),
    ],
)
def test_articles_pronouns_verbs(object_type: str, article: str, it: str, verb: str) -> None:
    assert (with_article(object_type), pronoun(object_type), verb_to_be(object_type)) == (
        article,
        it,
        verb,
    )


def test_the_lists_name_real_types_and_every_plural_one() -> None:
    assert not (PLURAL | UNCOUNTED) - OBJECT_TYPES.keys()
    assert not PLURAL & UNCOUNTED
    assert {name for name in OBJECT_TYPES if name.endswith("s")} - PLURAL == {"ShowerGlass"}
    assert {name for name in OBJECT_TYPES if name.endswith("Sliced")} <= UNCOUNTED
    assert not [name for name in OBJECT_TYPES if name.startswith("U")]  # a User, an Urn
