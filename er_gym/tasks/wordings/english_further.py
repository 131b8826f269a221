"""English wordings for learning alone: a language model's data may be told in them.

No suite draws from them, so they change no task and no measurement. Who wrote them had seen neither
the wordings of er-gym nor the paper's tasks. None has a word that only evaluation's wordings have.
For each core and whole sentence, a reader told from one instruction alone which kind of task it
is, and was right each time.

The fields are those of :mod:`er_gym.tasks.wordings.english_sentences`.
"""

from __future__ import annotations

from er_gym.tasks.wordings.english import ENGLISH
from er_gym.tasks.wordings.grammar import Grammar, Joiner, Parts, Sentences

_FRAMES = (
    "Please {core}.",
    "Could you possibly {core}?",
    "Would you {core}?",
    "I need you to {core}.",
    "I would like you to {core}.",
    "Can you {core}, please?",
    "Would you be so kind as to {core}?",
    "If you have a moment, {core}.",
    "Robot, {core}.",
    "Hey, {core}, will you?",
    "It would be great if you could {core}.",
    "I want you to {core}.",
    "Do me a favor and {core}.",
    "Kindly {core}.",
    "Go ahead and {core}.",
    "Now you have to {core}.",
    "I wonder if you could {core}.",
    "Sorry to bother you, but could you {core}?",
    "Are you able to {core}?",
    "Okay, robot, {core}!",
    "It is time for you to {core}.",
    "As soon as you are free, {core}.",
    "You are requested to {core}.",
)

_JOINERS = (
    Joiner(
        "first {clause}",
        (", then {clause}", ", after that {clause}"),
        ", and finally {clause}",
    ),
    Joiner(
        "begin with this: {clause}",
        ("; next, {clause}", "; following that, {clause}", "; then {clause}"),
        "; and as the last step, {clause}",
    ),
    Joiner(
        "{clause}",
        (", then {clause}", ", next {clause}"),
        ", and then {clause}",
    ),
    Joiner(
        "do the following in order: {clause}",
        ("; {clause}",),
        "; {clause}",
    ),
    Joiner(
        "carry out these steps one by one: {clause}",
        ("; after that, {clause}", "; when that is done, {clause}"),
        "; to finish, {clause}",
    ),
    Joiner(
        "{clause}",
        (", and when you have done that, {clause}", ", and after that {clause}"),
        ", and afterwards {clause}",
    ),
    Joiner(
        "work in this order: {clause}",
        (", subsequently {clause}", ", thereafter {clause}"),
        ", and lastly {clause}",
    ),
)

_FIND = Sentences(
    whole=Parts(
        seen=(
            "Would you mind looking for {an_object} in the {room}?",
            "I have no idea where the {object} {is}, so please go and look.",
            "Where in the {room} {is} the {object}?",
            "Can you see {an_object} anywhere in the {room}?",
            "I would like to know where the {object} {is}.",
            "The {object} must be somewhere in the {room}, and your job is only to spot {it}.",
            "The {object} must be located.",
            "How about searching the {room} for {an_object}?",
            "I'd appreciate you tracking down the {object} in the {room}.",
            "Once you have located the {object} in the {room}, you are done.",
            "I bet you can find {an_object} before I count to ten!",
            "We have been looking for the {object} all morning; now it is your turn to search.",
            "Nobody seems to know where the {object} {is}, so finding out is up to you.",
            "The location of the {object} in the {room} has to be determined.",
            "What I want is for you to go up to the {object} and just look.",
        ),
        unseen=(),
    ),
    cores=Parts(
        seen=(
            "find {an_object} in the {room}",
            "locate the {object}",
            "look for {an_object} in the {room}",
            "search the {room} for {an_object}",
            "spot the {object} in the {room}",
            "track down the {object}",
            "seek out {an_object}",
            "hunt for the {object} in the {room}",
            "scan the {room} for {an_object}",
            "show me where the {object} {is}",
            "point out the {object} in the {room}",
            "find out where the {object} {is}",
            "check where in the {room} the {object} {is}",
            "go over to the {object} and just look at {it}",
            "look around the {room} until you see {an_object}",
            "identify {an_object} in the {room}",
            "pinpoint the {object}",
            "work out where the {object} {is}",
            "have a look around the {room} for {an_object}",
            "go and see where the {object} {is}",
            "walk through the {room} and stop once you notice {an_object}",
            "hunt down the {object} and wait next to {it}",
            "make your way to wherever the {object} {is}",
            "figure out the location of the {object}",
            "comb the {room} for {an_object}",
            "keep looking until you come across {an_object}",
            "go around the {room} and search for {an_object}",
            "lead me to the {object}",
            "inspect the {room} and tell me where the {object} {is}",
        ),
        unseen=(),
    ),
)

_PICK_UP = Sentences(
    whole=Parts(
        seen=(
            "Would you mind retrieving {an_object} from the {room}?",
            "I need you holding {an_object}.",
            "I want the {object} to be picked up.",
            "Do you mind getting {an_object}?",
            "How about grabbing the {object} from the {room}?",
            "The {object} in the {room} must be picked up.",
            "Once you are holding {an_object}, you are finished.",
            "Someone has to take the {object} from the {room}, and I choose you.",
            "Your next job is fetching {an_object} from the {room}.",
            "When you see the {object} in the {room}, go ahead and pick {it} up.",
            "Is picking up the {object} something you can manage?",
            "The {object} should be in your hand by the time you are done.",
            "It would help me a lot if you got {an_object} from the {room}.",
            "Let's see you holding the {object}!",
            "You haven't taken {an_object} from the {room} yet, so do that now.",
        ),
        unseen=(),
    ),
    cores=Parts(
        seen=(
            "pick up the {object}",
            "pick up {an_object} from the {room}",
            "take the {object} from the {room}",
            "get {an_object}",
            "grab the {object} in the {room}",
            "fetch {an_object} from the {room}",
            "retrieve the {object} from the {room}",
            "lift up the {object}",
            "obtain {an_object} from the {room}",
            "get hold of {an_object}",
            "take hold of the {object} in the {room}",
            "find {an_object} in the {room} and pick {it} up",
            "go to the {object} and take {it} in your hand",
            "secure {an_object} from the {room}",
            "gather up the {object}",
            "acquire {an_object}",
            "grasp the {object} and keep holding {it}",
            "look for {an_object} in the {room} and grab {it}",
            "procure {an_object} from the {room}",
            "scoop up the {object}",
            "snatch up the {object} from the {room}",
            "seize the {object}",
            "get your hands on {an_object} in the {room}",
            "locate the {object} in the {room} and get {it} into your hand",
            "go get the {object} from the {room}",
            "grip the {object} and lift {it} up",
        ),
        unseen=(),
    ),
)

_TOGGLE = Sentences(
    whole=Parts(
        seen=(
            "Would you mind switching {way} the {object}?",
            "I want the {object} to be turned {way}.",
            "The {object} should be switched {way}.",
            "How about turning {way} the {object} in the {room}?",
            "I would appreciate you turning {way} {an_object}.",
            "It would be lovely if the {object} could be turned {way}.",
            "When you get to the {object}, turn {it} {way}.",
            "Somebody forgot to switch {way} the {object}, so that is your job.",
            "I'd prefer for the {object} to be switched {way}.",
            "Mom says you should switch {way} the {object}.",
            "We need the {object} in the {room} to be powered {way}.",
            "Do you mind powering {way} the {object}?",
            "You will be done as soon as the {object} {is} turned {way}.",
            "Our guests have asked for the {object} to be turned {way}.",
        ),
        unseen=(),
    ),
    cores=Parts(
        seen=(
            "switch {way} the {object}",
            "turn {way} the {object}",
            "power {way} the {object}",
            "click {way} the {object}",
            "flick {way} the {object}",
            "turn {way} {an_object}",
            "switch {way} {an_object} in the {room}",
            "turn {way} the {object} in the {room}",
            "power {way} the {object} in the {room}",
            "find the {object} and turn {it} {way}",
            "go to the {object} and switch {it} {way}",
            "walk over to the {object} and power {it} {way}",
            "find {an_object} and switch {it} {way}",
            "approach the {object} and turn {it} {way}",
            "locate the {object} in the {room} and switch {it} {way}",
            "look for {an_object} in the {room} and turn {it} {way}",
            "make sure that the {object} {is} turned {way}",
            "see to it that the {object} {is} switched {way}",
            "ensure that the {object} in the {room} {is} turned {way}",
            "press the button that turns {way} the {object}",
            "set the {object} to {way}",
            "set the power switch of the {object} to {way}",
            "do what is needed to turn {way} the {object}",
        ),
        unseen=(),
    ),
)

_MOVE = Sentences(
    whole=Parts(
        seen=(
            "Would you mind putting the {object} {place}?",
            "I want the {object} to be placed {place}.",
            "The right spot for the {object} is {place}, so put {it} there.",
            "How about taking {an_object} from the {room} and leaving {it} {place}?",
            "I need to have {an_object} placed {place}.",
            "When you have found the {object} in the {room}, put {it} {place}.",
            "Once you have picked up the {object}, set {it} down {place}.",
            "Do you mind grabbing the {object} from the {room} and setting {it} {place}?",
            "By the time I get back, the {object} should have been put {place}.",
            "Your job is picking up {an_object} from the {room} and placing {it} {place}.",
            "There is free space {place}, so put the {object} there.",
            "Grandma would like the {object} to be returned to the usual spot {place}.",
        ),
        unseen=(),
    ),
    cores=Parts(
        seen=(
            "put the {object} {place}",
            "place the {object} {place}",
            "set {an_object} {place}",
            "deposit the {object} {place}",
            "stow the {object} {place}",
            "lay the {object} {place}",
            "take the {object} and put {it} {place}",
            "pick up the {object} and place {it} {place}",
            "get {an_object} from the {room} and put {it} {place}",
            "find the {object} in the {room} and set {it} {place}",
            "find {an_object} in the {room} and place {it} {place}",
            "grab {an_object} from the {room} and leave {it} {place}",
            "return the {object} to the right spot {place}",
            "deliver the {object} to a spot {place}",
            "retrieve {an_object} from the {room} and position {it} {place}",
            "search the {room} for {an_object} and put {it} {place}",
            "locate the {object} in the {room}, lift {it} and rest {it} {place}",
            "carry the {object} from the {room} and drop {it} off {place}",
            "make the {object} end up {place}",
            "find a spot {place} for the {object} and leave {it} there",
            "get hold of the {object} and stash {it} {place}",
            "tidy up by putting the {object} {place}",
            "go to the {object}, pick {it} up and put {it} down {place}",
        ),
        unseen=(),
    ),
)

_MOVE_TWO = Sentences(
    whole=Parts(
        seen=(
            "Would you mind putting the {object} {place} and then putting the {second_object}"
            " {second_place}?",
            "First the {object} should be placed {place}, and then the {second_object} should be"
            " placed {second_place}.",
            "After you have put the {object} {place}, put the {second_object} {second_place}.",
            "Once you have set the {object} {place}, the {second_object} must be set"
            " {second_place}.",
            "When you are done placing the {object} {place}, start placing the {second_object}"
            " {second_place}.",
            "I'd like the {object} to be put {place} first and the {second_object} to be put"
            " {second_place} second.",
            "There are two jobs for you: putting the {object} {place} comes first, and putting the"
            " {second_object} {second_place} comes second.",
            "I would appreciate you taking the {object} and leaving {it} {place}, then taking the"
            " {second_object} and leaving {second_it} {second_place}.",
            "Start by setting the {object} {place}. After that, set the {second_object}"
            " {second_place}.",
            "The first item is the {object}, to be put {place}; the second is the {second_object},"
            " to be put {second_place}.",
            "You will be finished when you have put the {object} {place} and, afterwards, the"
            " {second_object} {second_place}.",
        ),
        unseen=(),
    ),
    cores=Parts(
        seen=(
            "put the {object} {place}, then put the {second_object} {second_place}",
            "place the {object} {place} and, once that is done, place the {second_object}"
            " {second_place}",
            "take the {object}, put {it} {place}, and after that set the {second_object}"
            " {second_place}",
            "begin by putting the {object} {place} and continue by putting the {second_object}"
            " {second_place}",
            "pick up the {object} and set {it} {place}; next, pick up the {second_object} and set"
            " {second_it} {second_place}",
            "set the {object} {place} prior to setting the {second_object} {second_place}",
            "deal with the {object} first by putting {it} {place}, and with the {second_object}"
            " second by putting {second_it} {second_place}",
            "find {an_object}, leave {it} {place}, and subsequently find {second_an_object} and"
            " leave {second_it} {second_place}",
            "fetch {an_object} and put {it} {place}, and then fetch {second_an_object} and put"
            " {second_it} {second_place}",
            "grab the {object} and stow {it} {place}, and when finished, grab the {second_object}"
            " and stow {second_it} {second_place}",
            "return the {object} to the right spot {place}, then return the {second_object} to the"
            " right spot {second_place}",
            "deposit the {object} {place} and follow that by depositing the {second_object}"
            " {second_place}",
            "take {an_object} and position {it} {place}, after which you should take"
            " {second_an_object} and position {second_it} {second_place}",
            "find a spot {place} for the {object} and leave {it} there, then find a spot"
            " {second_place} for the {second_object} and leave {second_it} there",
            "get hold of the {object} and drop {it} off {place}, then go back for the"
            " {second_object} and drop {second_it} off {second_place}",
            "put {an_object} {place} and {second_an_object} {second_place}, in that order",
        ),
        unseen=(),
    ),
)

FURTHER = Grammar(
    frames=Parts(_FRAMES, ()),
    sentences={
        "find": _FIND,
        "pick up": _PICK_UP,
        "toggle": _TOGGLE,
        "move": _MOVE,
        "move two": _MOVE_TWO,
    },
    styles=Parts((), ()),
    joiners=Parts(_JOINERS, ()),
    verbs={verb: Parts(ways.seen, ()) for verb, ways in ENGLISH.verbs.items()},
)
"""Further English wordings, all of them ``seen``; recipes keep the verbs that training has."""
