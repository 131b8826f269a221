"""English instructions: frames, ways to join clauses, and the whole grammar.

No frame has a word that says what to do, or a pronoun for a thing.
"""

from __future__ import annotations

from collections.abc import Sequence

from er_gym.tasks.wordings.english_sentences import SENTENCES
from er_gym.tasks.wordings.grammar import Grammar, Joiner, Parts, Style, capital

_FRAMES = Parts(
    seen=(
        "{core}.",
        "Please {core}.",
        "Could you {core}?",
        "Could you please {core}?",
        "Can you {core} now?",
        "Would you {core}, please?",
        "I need you to {core}.",
        "I would like you to {core}.",
        "I want you to {core}.",
        "Your job is to {core}.",
        "{core}, would you?",
        "{core}, please.",
        "If you have time, please {core}.",
        "Robot, {core}.",
        "Here is what I need: {core}.",
        "One thing for you: {core}.",
        "I am busy right now. Could you {core}?",
        "Be so kind as to {core}.",
        "Kindly {core}.",
        "Do me a favour and {core}.",
        "I am expecting guests, so please {core}.",
        "We are tidying up. Please {core}.",
        "Sorry to bother you, but could you {core}?",
    ),
    unseen=(
        "Is there any chance you could {core}?",
        "I was wondering whether you could {core}.",
        "Be a dear and {core}.",
        "You have one errand: {core}.",
        "My knees hurt today, so I shall need you to {core}.",
        "Hello there! Might I trouble you to {core}?",
    ),
)

_STYLES = Parts(
    seen=(
        Style(
            "{clause}",
            "First, {clause}",
            (". Then, {clause}", ". After that, {clause}"),
            ". Finally, {clause}",
        ),
        Style(
            "Could you please {clause}",
            "Could you please {clause}",
            (", then {clause}", ", after that {clause}"),
            ", and finally {clause}",
            "?",
        ),
        Style(
            "Please {clause}",
            "Please {clause}",
            (". When that is done, {clause}", ". Next, {clause}"),
            ". Last of all, {clause}",
        ),
        Style(
            "I need you to {clause}",
            "I need you to {clause}",
            (", then to {clause}", ", after that to {clause}"),
            ", and in the end to {clause}",
        ),
        Style(
            "There is one thing to do: {clause}",
            "Step {number}: {clause}",
            (". Step {number}: {clause}",),
            ". Step {number}: {clause}",
        ),
        Style(
            "{clause}, please",
            "{clause}",
            (". Once you have done that, {clause}", ". Then {clause}"),
            ". To finish, {clause}",
        ),
        Style(
            "Would you {clause}",
            "Would you {clause}",
            (", and then {clause}",),
            ", and then, as the last thing, {clause}",
            "?",
        ),
        Style(
            "It would help if you could {clause}",
            "It would help if you could {clause}",
            (", then {clause}", ", next {clause}"),
            ", and, when all that is done, {clause}",
        ),
        Style(
            "Do this, please: {clause}",
            "Do these things in this order, please: {clause}",
            ("; {clause}",),
            "; {clause}",
        ),
        Style(
            "I have only one request: {clause}",
            "To begin with, {clause}",
            (". Next, {clause}", ". Afterwards, {clause}"),
            ". The last thing to do is to {clause}",
        ),
        Style(
            "Something needs to be done: {clause}",
            "More than one thing needs to be done: first {clause}",
            (", then {clause}", ", after that {clause}"),
            ", and at the end {clause}",
        ),
    ),
    unseen=(
        Style(
            "Your task is to {clause}",
            "Your task is to {clause}",
            ("; after that, to {clause}", "; then, to {clause}"),
            "; and at the very end, to {clause}",
        ),
        Style(
            "Can I ask you to {clause}",
            "Can I ask you to {clause}",
            ("; then to {clause}", "; next, to {clause}"),
            "; and, last of all, to {clause}",
            "?",
        ),
        Style(
            "I would be glad if you would {clause}",
            "I would be glad if you would first {clause}",
            ("; then {clause}", "; afterwards {clause}"),
            "; and, to conclude, {clause}",
        ),
    ),
)

_JOINERS = Parts(
    seen=(
        Joiner(
            "{clause}", (", and then {clause}", ", after that {clause}"), ", and finally {clause}"
        ),
        Joiner("first {clause}", (", then {clause}",), ", and, to finish, {clause}"),
        Joiner("{clause}", ("; then {clause}", "; next, {clause}"), "; and last of all {clause}"),
    ),
    unseen=(
        Joiner(
            "{clause} to begin with",
            (", afterwards {clause}", ", then {clause}"),
            ", and at the very end {clause}",
        ),
    ),
)

_VERBS = {
    "put": Parts(seen=("put", "place"), unseen=("set",)),
    "turn": Parts(seen=("turn", "switch"), unseen=()),
    "wash": Parts(seen=("wash", "rinse"), unseen=("clean",)),
    "heat": Parts(seen=("heat",), unseen=("warm",)),
    "cool": Parts(seen=("cool", "chill"), unseen=()),
    "slice": Parts(seen=("slice", "cut"), unseen=()),
}

ENGLISH = Grammar(
    frames=_FRAMES,
    sentences=SENTENCES,
    styles=_STYLES,
    joiners=_JOINERS,
    verbs=_VERBS,
)
"""The English wordings."""


def in_order(clauses: Sequence[str], style: Style) -> str:
    """Join clauses into an instruction that makes their order plain.

    Args:
        clauses: imperatives in lower case without a final punctuation mark ("slice the Lettuce");
            they may hold commas and "and".
        style: one of ``ENGLISH.orders``.

    Raises:
        ValueError: there are no clauses.
    """
    if not clauses:
        raise ValueError("no clauses to join; give at least one")
    return capital(style.join(clauses))
