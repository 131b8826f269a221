"""What English instructions say, for each kind of task. ``str.format_map`` fills the templates with

- {object}: a type, or a type with its place ("Book that is on the Desk");
- {an_object}: the same with its article ("a Book", "some Bread", "the Book that is on the Desk");
- {it}, {is}: its pronoun, never a subject ("it", "them"), and its verb ("is", "are");
- {room}: the room's kind; {way}: "on" or "off"; {place}: "in the Fridge", "on the Shelf";
- {second_object}, {second_an_object}, {second_it}, {second_place}: those of the second transfer.

The first whole sentence of each kind also gives the task's name. {object} may end in "that is on
the Desk". So no particle that belongs to an earlier verb follows it: "switch on the {object}", not
"switch the {object} on".
"""

from __future__ import annotations

from collections.abc import Mapping

from er_gym.tasks.wordings.grammar import Parts, Sentences

# A search ends when the object is in view: no template may ask the agent to pick it up.
_FIND = Sentences(
    whole=Parts(
        seen=(
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
        ),
        unseen=(
            "Look for the {object} everywhere in the {room}, inside things too if need be, until"
            " you see {it}.",
            "My eyes are no longer good. Please use yours to find the {object} in this {room}.",
            "It would help if you found the {object} somewhere in this {room}.",
        ),
    ),
    cores=Parts(
        seen=(
            "find the {object} in the {room}",
            "find {an_object} in this {room}",
            "locate the {object} in this {room}",
            "search the {room} for the {object}",
            "look around the {room} until you see the {object}",
            "look for the {object} in this {room}",
            "find out where in this {room} the {object} {is}",
            "look around this {room} until you spot the {object}",
            "search this {room} until the {object} {is} in view",
            "look around for the {object} in the {room}",
            "have a look around the {room} for {an_object}",
            "find the {object}, which should be somewhere in this {room}",
            "search for the {object} and stop once you see {it}",
        ),
        unseen=(
            "locate {an_object} somewhere in the {room}",
            "look everywhere in the {room} until you come across {an_object}",
            "search high and low in this {room} for the {object}",
        ),
    ),
)

# Finding the object is not enough: each template asks to have it in the hand.
_PICK_UP = Sentences(
    whole=Parts(
        seen=(
            "Pick up the {object} in the {room}.",
            "Please find the {object} and pick {it} up.",
            "I need {an_object} from this {room}. Could you pick {it} up for me?",
            "Look around the {room} until you see the {object}, and take {it} in your hand.",
            "Could you get {an_object} and hold on to {it}?",
            "Grab the {object} and keep {it} in your hand.",
            "It would help if you picked up the {object} and held {it} for me.",
            "Go and get {an_object}; you should end up with {it} in your hand.",
            "I would like you to carry {an_object}. Please look for {it} in the {room} and pick"
            " {it} up.",
            "Somewhere in this {room} you will come across {an_object}. Please pick {it} up.",
            "When you are done, your hand should be holding the {object}.",
            "Can you find the {object} in this {room} and take {it} into your hand?",
            "Would you mind picking up {an_object} in this {room}?",
        ),
        unseen=(
            "We are going to need {an_object}. Search the {room}, and pick {it} up when you find"
            " {it}.",
            "Do not just look for the {object} in the {room}: pick {it} up as well.",
            "Please hold the {object} for me. You should find {it} in this {room}.",
        ),
    ),
    cores=Parts(
        seen=(
            "pick up the {object} in the {room}",
            "pick up the {object}",
            "find the {object} and pick {it} up",
            "take the {object} in your hand",
            "grab the {object} and hold {it}",
            "get {an_object} and keep {it} in your hand",
            "fetch the {object} and hold on to {it}",
            "look for the {object} in this {room} and pick {it} up",
            "search the {room} for the {object} and pick {it} up",
            "grab {an_object} in this {room} and keep {it} in your hand",
            "find {an_object} and take {it} in your hand",
            "locate the {object}, pick {it} up and hold {it}",
            "take {an_object} and stop with {it} in your hand",
        ),
        unseen=(
            "reach for the {object} and pick {it} up",
            "fetch {an_object} in this {room} and hold on to {it}",
            "collect the {object} by picking {it} up",
        ),
    ),
)

_TOGGLE = Sentences(
    whole=Parts(
        seen=(
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
        ),
        unseen=(
            "Can I ask you to turn {way} the {object}?",
            "There is one small job in the {room}: switch {way} the {object}.",
            "I do not want to get up. Could you go to the {object} and turn {it} {way}?",
        ),
    ),
    cores=Parts(
        seen=(
            "turn {way} the {object} in the {room}",
            "switch {way} the {object}",
            "turn {way} the {object}",
            "find the {object} and turn {it} {way}",
            "go to the {object} and switch {it} {way}",
            "look for the {object} in this {room} and turn {it} {way}",
            "see to it that the {object} {is} turned {way}",
            "make sure the {object} {is} switched {way}",
            "switch {way} the {object} in this {room}",
            "walk over to the {object} and turn {it} {way}",
            "locate the {object} in the {room} and switch {it} {way}",
            "find the {object} in this {room} and switch {it} {way}",
        ),
        unseen=(
            "head over to the {object} in this {room} and switch {it} {way}",
            "use the switch of the {object} to turn {it} {way}",
            "go up to the {object} and turn {it} {way}",
        ),
    ),
)

# No template says "have the {object} {place}": "the Bread on the Plate" could name one of several.
_MOVE = Sentences(
    whole=Parts(
        seen=(
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
        ),
        unseen=(
            "Get hold of the {object}, carry {it} over, and leave {it} {place}.",
            "From now on, the {object} should be kept {place}. Please move {it} there.",
            "Go and get {an_object}, and do not stop before you have put {it} {place}.",
        ),
    ),
    cores=Parts(
        seen=(
            "put the {object} {place}",
            "take the {object} and put {it} {place}",
            "get the {object} and leave {it} {place}",
            "place the {object} {place}",
            "find the {object} in the {room} and put {it} {place}",
            "pick up the {object} and place {it} {place}",
            "carry the {object} over and leave {it} {place}",
            "go and get {an_object} and put {it} {place}",
            "look for the {object}, take {it} and put {it} {place}",
            "make sure the {object} {is} put {place}",
            "fetch {an_object} and set {it} down {place}",
            "grab the {object} and put {it} away {place}",
            "see that the {object} {is} placed {place}",
        ),
        unseen=(
            "store the {object} {place}",
            "pick up {an_object} and set {it} {place}",
            "bring the {object} over and store {it} {place}",
        ),
    ),
)

# Both transfers keep their verbs: "the Pen that is in the Mug in the Drawer" would be one object.
_MOVE_TWO = Sentences(
    whole=Parts(
        seen=(
            "First, put the {object} {place}; then, put the {second_object} {second_place}.",
            "Please put the {object} {place}, and after that put the {second_object}"
            " {second_place}.",
            "Two things, in this order: put the {object} {place}, and put the {second_object}"
            " {second_place}.",
            "Once you have put the {object} {place}, could you put the {second_object}"
            " {second_place}?",
            "Start with the {object}: put {it} {place}. When that is done, take the"
            " {second_object} and put {second_it} {second_place}.",
            "Before you put the {second_object} {second_place}, put the {object} {place}.",
            "I need two things moved, one after the other. The {object} should go {place} first,"
            " and then the {second_object} should go {second_place}.",
            "Could you get {an_object} and leave {it} {place}, and only then get"
            " {second_an_object} and leave {second_it} {second_place}?",
            "Would you mind moving two things? The {object} should go {place} first; after that,"
            " the {second_object} should go {second_place}.",
            "The order matters here: put the {object} {place}, and only then put the"
            " {second_object} {second_place}.",
            "It would help if you first put the {object} {place} and then put the {second_object}"
            " {second_place}.",
            "There are two jobs in this {room}, one after the other. The first is to put the"
            " {object} {place}. The second is to put the {second_object} {second_place}.",
            "Find the {object} and put {it} {place}. Next, find the {second_object} and put"
            " {second_it} {second_place}.",
            "Step one: put the {object} {place}. Step two: put the {second_object} {second_place}.",
        ),
        unseen=(
            "I would like you to put the {object} {place} to begin with, and to put the"
            " {second_object} {second_place} after that.",
            "Please see to the {object} and put {it} {place}. Only afterwards, see to the"
            " {second_object} and put {second_it} {second_place}.",
            "Can you put the {object} {place}? When you have done so, please put the"
            " {second_object} {second_place} as well.",
        ),
    ),
    cores=Parts(
        seen=(
            "first put the {object} {place} and then put the {second_object} {second_place}",
            "put the {object} {place} and, right after that, put the {second_object}"
            " {second_place}",
            "put the {object} {place}, then take the {second_object} and put {second_it}"
            " {second_place}",
            "take the {object} and put {it} {place} first, and then put the {second_object}"
            " {second_place}",
            "get {an_object} and leave {it} {place}, and only then put the {second_object}"
            " {second_place}",
            "find the {object} and put {it} {place}, then find the {second_object} and put"
            " {second_it} {second_place}",
            "place the {object} {place} and afterwards place the {second_object} {second_place}",
            "first pick up the {object} and place {it} {place}, and then pick up the"
            " {second_object} and place {second_it} {second_place}",
            "put the {object} {place} before you put the {second_object} {second_place}",
        ),
        unseen=(
            "first store the {object} {place} and then store the {second_object} {second_place}",
            "set the {object} {place} to begin with, and after that set the {second_object}"
            " {second_place}",
        ),
    ),
)

SENTENCES: Mapping[str, Sentences] = {
    "find": _FIND,
    "pick up": _PICK_UP,
    "toggle": _TOGGLE,
    "move": _MOVE,
    "move two": _MOVE_TWO,
}
"""The sentences of each kind of task."""
