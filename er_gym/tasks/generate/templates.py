"""Instruction templates for generated tasks.

``str.format_map`` fills the templates with

- {object}: a type, or a type with its place ("Book that is on the Desk");
- {an_object}: the same with its article ("a Book", "some Bread", "the Book that is on the Desk");
- {it}, {is}: its pronoun, never a subject ("it", "them"), and its verb ("is", "are");
- {room}: the room's kind; {way}: "on" or "off"; {place}: "in the Fridge", "on the Shelf";
- {second_object}, {second_an_object}, {second_it}, {second_place}: those of the second transfer.

The first template of each tuple also gives the task's name. {object} may end in "that is on the
Desk". So no particle that belongs to an earlier verb follows it: "switch on the {object}", not
"switch the {object} on".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import cycle, islice

# A search ends when the object is in view: no template may ask the agent to pick it up.
FIND = (
    "Find the {object} in the {room}.",
    "Can you find {an_object} in this {room}?",
    "I have lost sight of the {object}. Please look around the {room} for {it}.",
    "Where in this {room} {is} the {object}? Please go and look.",
    "Search the {room} until you have {an_object} in view.",
    "Please locate the {object} in this {room}.",
    "Could you look around the {room} and try to spot the {object}?",
    "Go and stand where you can see {an_object} in this {room}.",
    "I cannot see the {object} from here. Please search the {room} until you see {it}.",
    "There is no need to touch the {object}: just find {it} in the {room}.",
    "Would you mind searching the {room} for {an_object}?",
    "Walk around the {room} and stop once you have found the {object}.",
    "Somewhere in this {room} you should come across {an_object}. Please find {it}.",
    "Look for the {object} everywhere in the {room}, inside things too if need be, until you see"
    " {it}.",
    "My eyes are no longer good. Please use yours to find the {object} in this {room}.",
    "It would help if you found the {object} somewhere in this {room}.",
)

# Finding the object is not enough: each template asks to have it in the hand.
PICK_UP = (
    "Pick up the {object} in the {room}.",
    "Please find the {object} and pick {it} up.",
    "I need {an_object} from this {room}. Could you pick {it} up for me?",
    "Look around the {room} until you see the {object}, and take {it} in your hand.",
    "Could you get {an_object} and hold on to {it}?",
    "Grab the {object} and keep {it} in your hand.",
    "It would help if you picked up the {object} and held {it} for me.",
    "Go and get {an_object}; you should end up with {it} in your hand.",
    "I would like you to carry {an_object}. Please look for {it} in the {room} and pick {it} up.",
    "Somewhere in this {room} you will come across {an_object}. Please pick {it} up.",
    "When you are done, your hand should be holding the {object}.",
    "Can you find the {object} in this {room} and take {it} into your hand?",
    "Would you mind picking up {an_object} in this {room}?",
    "We are going to need {an_object}. Search the {room}, and pick {it} up when you find {it}.",
    "Do not just look for the {object} in the {room}: pick {it} up as well.",
    "Please hold the {object} for me. You should find {it} in this {room}.",
)

TOGGLE = (
    "Turn {way} the {object} in the {room}.",
    "Please switch {way} the {object}.",
    "Would you turn {way} the {object} for me?",
    "Go over to the {object} and switch {it} {way}.",
    "I need the {object} to be switched {way}.",
    "The {object} should be switched {way}. Can you see to that?",
    "It would help if you turned {way} the {object}.",
    "Could you find the {object} in the {room} and turn {it} {way}?",
    "Please see to it that the {object} in this {room} {is} switched {way}.",
    "Someone has forgotten about the {object}. Please switch {it} {way}.",
    "Would you mind switching {way} the {object} in this {room}?",
    "Look for the {object} in the {room}. When you are there, turn {it} {way}.",
    "By the time you are done, the {object} in this {room} should be turned {way}.",
    "Can I ask you to turn {way} the {object}?",
    "There is one small job in the {room}: switch {way} the {object}.",
    "I do not want to get up. Could you go to the {object} and turn {it} {way}?",
)

# No template says "have the {object} {place}": "the Bread on the Plate" could name one of several.
MOVE = (
    "Put the {object} {place}.",
    "Please take the {object} and put {it} {place}.",
    "I would like you to put the {object} {place}.",
    "Could you get the {object} and leave {it} {place}?",
    "The {object} should go {place}. Please see to that.",
    "Would you mind putting the {object} {place}?",
    "I need the {object} to be {place}. Could you put {it} there?",
    "Find the {object} in the {room}, pick {it} up, and place {it} {place}.",
    "It would help if the {object} ended up {place}.",
    "When you are done, the {object} should be {place}.",
    "The {object} {is} in the wrong place. Please put {it} {place}.",
    "Look for {an_object} in this {room} and put {it} {place}.",
    "Can you see to it that the {object} {is} put {place}?",
    "Get hold of the {object}, carry {it} over, and leave {it} {place}.",
    "From now on, the {object} should be kept {place}. Please move {it} there.",
    "Go and get {an_object}, and do not stop before you have put {it} {place}.",
)

# Both transfers keep their verbs: "the Pen that is in the Mug in the Drawer" would be one object.
MOVE_TWO = (
    "First, put the {object} {place}; then, put the {second_object} {second_place}.",
    "Please put the {object} {place}, and after that put the {second_object} {second_place}.",
    "Two things, in this order: put the {object} {place}, and put the {second_object}"
    " {second_place}.",
    "Once you have put the {object} {place}, could you put the {second_object} {second_place}?",
    "Start with the {object}: put {it} {place}. When that is done, take the {second_object} and put"
    " {second_it} {second_place}.",
    "Before you put the {second_object} {second_place}, put the {object} {place}.",
    "I need two things moved, one after the other. The {object} should go {place} first, and then"
    " the {second_object} should go {second_place}.",
    "Could you get {an_object} and leave {it} {place}, and only then get {second_an_object} and"
    " leave {second_it} {second_place}?",
    "Would you mind moving two things? The {object} should go {place} first; after that, the"
    " {second_object} should go {second_place}.",
    "The order matters here: put the {object} {place}, and only then put the {second_object}"
    " {second_place}.",
    "It would help if you first put the {object} {place} and then put the {second_object}"
    " {second_place}.",
    "There are two jobs in this {room}, one after the other. The first is to put the {object}"
    " {place}. The second is to put the {second_object} {second_place}.",
    "Find the {object} and put {it} {place}. Next, find the {second_object} and put {second_it}"
    " {second_place}.",
    "Step one: put the {object} {place}. Step two: put the {second_object} {second_place}.",
    "I would like you to put the {object} {place} to begin with, and to put the {second_object}"
    " {second_place} after that.",
    "Please see to the {object} and put {it} {place}. Only afterwards, see to the {second_object}"
    " and put {second_it} {second_place}.",
    "Can you put the {object} {place}? When you have done so, please put the {second_object}"
    " {second_place} as well.",
)


@dataclass(frozen=True)
class _Style:
    """A way to join clauses. Each part holds {clause}, and may hold {number}, counted from 1.

    Attributes:
        alone: the whole instruction if there is only one clause.
        first: the first of several clauses.
        between: the clauses after the first, used in turn, each with its separator.
        last: the last of three or more clauses.
        end: the final punctuation mark.
    """

    alone: str
    first: str
    between: tuple[str, ...]
    last: str
    end: str = "."


_STYLES = (
    _Style(
        "{clause}",
        "First, {clause}",
        (". Then, {clause}", ". After that, {clause}"),
        ". Finally, {clause}",
    ),
    _Style(
        "Could you please {clause}",
        "Could you please {clause}",
        (", then {clause}", ", after that {clause}"),
        ", and finally {clause}",
        "?",
    ),
    _Style(
        "Please {clause}",
        "Please {clause}",
        (". When that is done, {clause}", ". Next, {clause}"),
        ". Last of all, {clause}",
    ),
    _Style(
        "I need you to {clause}",
        "I need you to {clause}",
        (", then to {clause}", ", after that to {clause}"),
        ", and in the end to {clause}",
    ),
    _Style(
        "There is one thing to do: {clause}",
        "Step {number}: {clause}",
        (". Step {number}: {clause}",),
        ". Step {number}: {clause}",
    ),
    _Style(
        "{clause}, please",
        "{clause}",
        (". Once you have done that, {clause}", ". Then {clause}"),
        ". To finish, {clause}",
    ),
    _Style(
        "Would you {clause}",
        "Would you {clause}",
        (", and then {clause}",),
        ", and then, as the last thing, {clause}",
        "?",
    ),
    _Style(
        "It would help if you could {clause}",
        "It would help if you could {clause}",
        (", then {clause}", ", next {clause}"),
        ", and, when all that is done, {clause}",
    ),
    _Style(
        "Do this, please: {clause}",
        "Do these things in this order, please: {clause}",
        ("; {clause}",),
        "; {clause}",
    ),
    _Style(
        "Your task is to {clause}",
        "Your task is to {clause}",
        ("; after that, to {clause}", "; then, to {clause}"),
        "; and at the very end, to {clause}",
    ),
    _Style(
        "I have only one request: {clause}",
        "To begin with, {clause}",
        (". Next, {clause}", ". Afterwards, {clause}"),
        ". The last thing to do is to {clause}",
    ),
    _Style(
        "Can I ask you to {clause}",
        "Can I ask you to {clause}",
        ("; then to {clause}", "; next, to {clause}"),
        "; and, last of all, to {clause}",
        "?",
    ),
    _Style(
        "Something needs to be done: {clause}",
        "More than one thing needs to be done: first {clause}",
        (", then {clause}", ", after that {clause}"),
        ", and at the end {clause}",
    ),
    _Style(
        "I would be glad if you would {clause}",
        "I would be glad if you would first {clause}",
        ("; then {clause}", "; afterwards {clause}"),
        "; and, to conclude, {clause}",
    ),
)

STYLES = len(_STYLES)
"""The number of styles of :func:`in_order`."""


def in_order(clauses: Sequence[str], style: int) -> str:
    """Join clauses into an instruction that makes their order plain.

    Args:
        clauses: imperatives in lower case without a final punctuation mark ("slice the Lettuce");
            they may hold commas and "and".
        style: 0 to :data:`STYLES` - 1.

    Raises:
        ValueError: there are no clauses, or there is no such style.
    """
    if not clauses:
        raise ValueError("no clauses to join; give at least one")
    if not 0 <= style < STYLES:
        raise ValueError(f"unknown style {style}; choose one from 0 to {STYLES - 1}")
    way = _STYLES[style]
    parts = [way.alone] if len(clauses) == 1 else [way.first]
    parts += islice(cycle(way.between), len(clauses) - 1)
    if len(clauses) > 2:
        parts[-1] = way.last
    text = "".join(
        part.format(clause=clause, number=number)
        for number, (part, clause) in enumerate(zip(parts, clauses, strict=True), 1)
    )
    return text[0].upper() + text[1:] + way.end
