"""The critic's checks of claims about objects: one function for each kind of false claim.

Each takes the clauses of a thought and what the agent knew, and yields the refusals. If a name
stands for several types, a claim about it is right if it is right for one of them.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence

from er_gym.data.mentions import Mention, all_interchangeable, named_in
from er_gym.data.phrases import MARK, Phrases
from er_gym.data.pronouns import resolved
from er_gym.data.reading import Clause
from er_gym.data.thought import Refusal, Thought, name_of
from er_gym.data.trajectory import SeenObject
from er_gym.tasks import verbs
from er_gym.thor import OBJECT_TYPES

PARTS: Mapping[str, frozenset[str]] = {
    "Drawer": frozenset(
        {"Dresser", "Desk", "SideTable", "TVStand", "CounterTop", "CoffeeTable", "ShelvingUnit"}
    ),
    "Shelf": frozenset(
        {"ShelvingUnit", "Dresser", "Desk", "SideTable", "TVStand", "Cabinet", "Fridge"}
    ),
    "StoveBurner": frozenset({"CounterTop", "StoveKnob"}),
    "SinkBasin": frozenset({"Sink", "CounterTop"}),
    "Sink": frozenset({"SinkBasin", "CounterTop"}),
    "BathtubBasin": frozenset({"Bathtub"}),
    "Cabinet": frozenset({"CounterTop", "Sink"}),
}
"""Receptacles that are parts of others: what lies in a Drawer is in the Dresser."""


# -- what is seen, and where it is -----------------------------------------------------------------


def check_unseen(thought: Thought) -> Iterator[Refusal]:
    """Claims to see an object that is not and was not in view, or says where it is."""
    phrases = thought.phrases
    for clause in thought.clauses:
        strange = [each for each in clause.mentions if not each.types & thought.seen]
        if not strange:
            continue
        if clause.is_fact and not clause.wanted:
            for mention in strange:
                if not mention.types & thought.mentionable:
                    yield _not_seen(mention)
        if clause.guessed or clause.negated:
            continue
        for phrase in phrases.seen:
            for match in phrase.finditer(clause.text):
                if _wanted_before(clause, match, phrases) or clause.intended:
                    continue
                if _ENOUGH.match(clause.text, match.end()):
                    continue
                for mention in subjects(clause, match, phrases):
                    if mention in strange:
                        yield _not_seen(mention)


_ENOUGH = re.compile(
    r" ?(?:了|过)?(?:就行|就好|就算|就成|便可|即可|就可以|才行|才算|再说)"
    r"| (?:is|will be|would be) (?:enough|all)\b"
)
"""After what is seen: that is all that is asked for."""


def check_hidden(thought: Thought) -> Iterator[Refusal]:
    """States where an object is that was never in view, or what an unopened container holds."""
    phrases = thought.phrases
    for clause in thought.clauses:
        if clause.guessed or clause.negated:
            continue
        if not clause.intended:
            for phrase in phrases.located:
                for match in phrase.finditer(clause.text):
                    for mention in subjects(clause, match, phrases):
                        if not mention.types & thought.seen and not is_given(thought, mention):
                            yield _nowhere(mention)
        for match in _matches(clause, (*phrases.on, *phrases.out_of)):
            if match.re not in phrases.out_of and (
                clause.intended or is_placing(clause, match.start("xs"), phrases)
            ):
                continue
            (holder,) = clause.named(match, "y")
            for mention in subjects(clause, match, phrases):
                if mention.types & thought.seen or is_given(thought, mention):
                    continue
                yield Refusal(
                    "hidden",
                    f"The agent cannot know that {name_of(mention)} is in or on {name_of(holder)}: "
                    "it was never in view. Say that it may be there, or leave it out.",
                )


def check_inside(thought: Thought) -> Iterator[Refusal]:
    """States what is in a closed container that the agent has not opened."""
    for _, mention, holder in told_to_be_on(thought):
        if not _is_shut(thought, holder) or not mention.types & thought.seen:
            continue
        if not any(each.on in holder.types for _, each in thought.things(mention.types)):
            yield Refusal(
                "hidden",
                f"The agent cannot know that {name_of(mention)} is in {name_of(holder)}: "
                "it is closed and was not opened.",
            )


def told_to_be_on(thought: Thought) -> Iterator[tuple[Clause, Mention, Mention]]:
    """What is told as a fact to be in or on something now, with that."""
    phrases = thought.phrases
    for clause in thought.clauses:
        if not clause.is_fact or clause.past or clause.wanted or _IS_ASKED.search(clause.text):
            continue
        for match in _matches(clause, phrases.on):
            if _is_gapped(thought, clause, match):
                continue
            if not is_placing(clause, match.start("xs"), phrases):
                (holder,) = clause.named(match, "y")
                for mention in subjects(clause, match, phrases):
                    yield clause, mention, holder


_IS_ASKED = re.compile(
    r"\b(?:request|task|instructions?|orders?|errand|note|brief) "
    r"(?:says?|said|claims?|puts|has it)\b"
    r"|\b(?:meant|supposed|bound|destined|due|intended) (?:to|for)\b|托我|吩咐"
)
"""Where somebody says that a thing is, or where it is to be."""
_SAYS_SO = re.compile(
    r"\b(?:[a-z]+s|[a-z]+ing|are|lie|sit|stand|rest|was|were|been|left|put)\b|'s\b|[在有着是]"
)
_ELSEWHERE = re.compile(
    r"\b(?:goes|go|belongs?|has to|have to|needs?|put|should|must|wants?|wanted|after|before)\b"
)
_ANY = re.compile(r"\b(?:a|an|one|some)(?: [a-z-]+)? $")


def _is_gapped(thought: Thought, clause: Clause, match: re.Match[str]) -> bool:
    """Whether "the pencil on the desk" has no verb, but may take one from before, or is a thought
    of any pencil on any desk."""
    first, last = match.span("xs"), match.span("y")
    if last[0] < first[0] or _SAYS_SO.search(clause.text[first[1] : last[0]]):
        return False
    if _ANY.search(clause.text[: first[0]]) and _ANY.search(clause.text[: last[0]]):
        return True
    whole = [each for each in thought.clauses if each.sentence == clause.sentence]
    if not any(_SAYS_SO.search(each.text) for each in whole):
        return True
    before = whole
    told = " ".join(each.text for each in before[: before.index(clause)])
    return bool(_ELSEWHERE.search(f"{told} {clause.text[: first[0]]}"))


def check_side(thought: Thought) -> Iterator[Refusal]:
    """Says that an object in view is on another side than it is."""
    for clause in (*thought.clauses, *resolved(thought)):
        if not clause.mentions or clause.guessed or clause.negated or clause.past:
            continue
        told = [*_sides(clause, thought.phrases)]
        if not told or _TURNS_ROUND.search(thought.sentences[clause.sentence]):
            continue
        for direction, nearly, groups in told:
            if len(told) > len(clause.mentions):
                break  # "ahead, on the left": something between them
            wrong = []
            for mention in groups:
                places = {
                    each.side if view == "ahead" else view
                    for view, each in thought.things(mention.types)
                }
                fits = (
                    not places
                    or direction in places
                    or (mention.types & _WIDE and "ahead" in places)
                    or (mention.types & _WIDE and direction == "ahead" and {*places} - {"behind"})
                    or (nearly and "ahead" in places)
                    or _bears_there(thought, mention, clause, direction)
                )
                wrong.append("" if fits else f"{name_of(mention)} is {_directions(places)}")
            if wrong and all(wrong):
                yield Refusal("side", f"{wrong[0]}, not {_directions({direction})}.")


_TURNS_ROUND = re.compile(
    r"\b(?:i|having|after) (?:just |then |have |had )*turn(?:ed|ing)?\b"
    r"|(?:往|朝|向)(?:身后|后|左|右)[^，。]{0,2}看|回头|转过?身|转头|掉头"
)
"""Who turns says on which side things are then."""


_WIDE = frozenset(
    {
        "CounterTop",
        "DiningTable",
        "Bed",
        "Bathtub",
        "BathtubBasin",
        "Sofa",
        "ShelvingUnit",
        "Desk",
        "Dresser",
        "TVStand",
    }
)
"""What is so wide that its centre may be ahead and the most of it on one side."""


def _bears_there(thought: Thought, mention: Mention, clause: Clause, direction: str) -> bool:
    """Whether a thing that the clause names lies on the one that is mentioned, on that side.

    Large furniture is on both sides of the view; its centre is not where a thing on it is.
    """
    return any(
        each.on in all_interchangeable(mention.types)
        and direction == (each.side if at == "ahead" else at)
        for near in thought.clauses
        if near.sentence == clause.sentence
        for other in near.mentions
        for at, each in thought.things(other.types)
    )


# -- helpers ---------------------------------------------------------------------------------------


def _matches(clause: Clause, phrases: Iterable[re.Pattern[str]]) -> list[re.Match[str]]:
    if MARK not in clause.text:
        return []
    return [match for phrase in phrases for match in phrase.finditer(clause.text)]


def _wanted_before(clause: Clause, match: re.Match[str], phrases: Phrases) -> bool:
    """Whether the clause says before the match that the thing is only wanted."""
    return bool(
        phrases.goal.search(
            clause.text[: match.start()] + clause.text[match.start() :].split(MARK)[0]
        )
    )


def subjects(clause: Clause, match: re.Match[str], phrases: Phrases) -> list[Mention]:
    """The names that a match is about; "at the sink, the mug is ..." is about the mug alone."""
    found = clause.named(match, "xs")
    if phrases.of_other.search(clause.text[: match.start("xs")]):
        return found[-1:]
    return found


def is_placing(clause: Clause, place: int, phrases: Phrases) -> bool:
    """Whether a thing is being put somewhere, or looked for there, rather than lying there.

    Args:
        place: where its name stands in the clause.
    """
    return bool(phrases.placing.search(clause.text[:place]))


def is_given(thought: Thought, mention: Mention) -> bool:
    """Whether the instruction says where the thing is ("that is in the Drawer")."""
    return bool(_GIVEN.search(thought.known.instruction)) and bool(
        mention.types & all_interchangeable(named_in(thought.known.instruction))
    )


_GIVEN = re.compile(r"\bthat (?:is|are|lies) (?:in|on)\b|\bfrom (?:the|inside)\b|里的|上的")


def _not_seen(mention: Mention) -> Refusal:
    return Refusal(
        "unseen",
        f"{name_of(mention)} is not and was not in view. Leave it out, or say that it may be "
        "there.",
    )


def _nowhere(mention: Mention) -> Refusal:
    return Refusal(
        "hidden",
        f"The agent cannot know where {name_of(mention)} is: it was never in view. Say where it "
        "may be, or leave it out.",
    )


def _is_shut(thought: Thought, holder: Mention) -> bool:
    """Whether all things of that name in view are closed, and the agent never opened one."""
    there = [each for _, each in thought.things(holder.types)]
    touched = (verbs.OPEN, verbs.CLOSE, verbs.PUT)
    return (
        bool(there)
        and all(each.open is False for each in there)
        and not any(thought.done(verb, holder.types) for verb in touched)
    )


def _holders(each: SeenObject, view: Sequence[SeenObject]) -> frozenset[str]:
    """The types of all that a thing in view lies in or on."""
    above: dict[str, list[str]] = {}
    for other in view:
        above.setdefault(other.type, []).append(other.on)
    return _upwards(each.on, above)


def holders_of(thought: Thought, place: str) -> frozenset[str]:
    """The types of a place and of all that it was ever seen to be in or on."""
    return _upwards(place, thought.known.rested)


def _upwards(place: str, above: Mapping[str, Sequence[str]]) -> frozenset[str]:
    found: set[str] = set()
    upwards = [place]
    while upwards:
        holder = upwards.pop()
        if holder and holder not in found:
            found.add(holder)
            found |= PARTS.get(holder, frozenset())
            upwards += above.get(holder, ())
    return all_interchangeable(each for each in found if each in OBJECT_TYPES)


def not_on(thought: Thought, mention: Mention, holder: Mention) -> str:
    """Where a thing in view lies, if it does not lie on the holder that is claimed; else ``""``."""
    there = list(thought.things(mention.types))
    if not there:
        if mention.types & thought.held:
            return "it is in the hand"
        return not_remembered_on(thought, mention, holder)
    if thought.done(verbs.PUT, holder.types) and thought.done(verbs.PICKUP, mention.types):
        return ""  # another one may be in view
    where = set()
    for direction, each in there:
        properties = OBJECT_TYPES[each.type].properties
        if "pickupable" not in properties and not (each.on and "moveable" in properties):
            return ""
        holders = _holders(each, thought.views[direction])
        if holders & holder.types:
            return ""
        if not each.on and not holder.types & thought.in_view:
            return ""  # what it lies on is out of view
        where.add(f"it is on {each.on}" if each.on else "it does not lie on it")
    return " or ".join(sorted(where))


def not_remembered_on(thought: Thought, thing: Mention, place: Mention) -> str:
    """Where a thing was seen to lie, if never in or on that place; else ``""``."""
    rested = thought.known.rested
    if not all("pickupable" in OBJECT_TYPES[each].properties for each in thing.types):
        return ""
    if not any("receptacle" in OBJECT_TYPES[each].properties for each in place.types):
        return ""
    if thing.types & thought.held:
        return ""
    seen = [on for each in all_interchangeable(thing.types) for on in rested.get(each, ())]
    if not seen or "" in seen:
        return ""
    holders = {one for on in seen for one in holders_of(thought, on)}
    if holders & all_interchangeable(place.types):
        return ""
    return f"it was seen on {' and on '.join(dict.fromkeys(seen))}"


def _directions(places: Iterable[str]) -> str:
    words = {"left": "on the left", "right": "on the right", "behind": "behind the agent"}
    return " or ".join(sorted(words.get(place, "straight ahead") for place in places))


def _sides(clause: Clause, phrases: Phrases) -> Iterator[tuple[str, bool, list[Mention]]]:
    """The directions that a clause tells: each with whether it is only nearly so, and the names of
    which one must be there."""
    found = sorted(
        (match.start(), match.end(), direction)
        for direction, phrase in phrases.sides.items()
        for match in phrase.finditer(clause.text)
    )
    for k, (start, end, direction) in enumerate(found):
        nearly = bool(phrases.nearly.search(clause.text[:start]))
        begin = found[k - 1][1] if k else 0
        stop = found[k + 1][0] if k + 1 < len(found) else len(clause.text)
        leading = not clause.among(0, found[0][0]) or (
            phrases.is_so.match(clause.text, end) and clause.among(end, stop)
        )
        if direction == "behind" and _SHUTS.search(clause.text, 0, start):
            continue  # "I closed it behind me"
        if leading or clause.text.startswith("的", end):
            if _NAMELESS.fullmatch(clause.text[begin:start]) and clause.text[end : end + 1] == ",":
                continue  # "pen straight ahead, the card …": a thing whose name is not known
            for place, mention in _pairs(clause, end, stop):
                if not phrases.of_other.search(clause.text[end:place]):
                    yield direction, nearly, [mention]
                    break
        else:
            nearest = list(_pairs(clause, begin, start))
            if nearest and not _OTHER_THING.search(clause.text, nearest[-1][0] + 1, start):
                own = [
                    mention
                    for place, mention in nearest
                    if not phrases.of_other.search(clause.text[begin:place])
                ]
                if len(found) > 1:  # "the left mug and on the right a vase": it may be either
                    own += [mention for _, mention in list(_pairs(clause, end, stop))[:1]]
                if own:  # else something without a name is there
                    yield direction, nearly, [nearest[-1][1], *own[-2:]]


_NAMELESS = re.compile(
    r"\W*(?:(?!(?:and|but|so|now|well|still|yet|just|there|here|then|is|are)\b)"
    r"[a-z-]+ ){1,2}"
)
"""English: a thing without a name that is known."""
_SHUTS = re.compile(r"\b(?:clos|shut|pull)[a-z]* (?:it|them|the [a-z]+|§)(?: shut| to| closed)? $")
"""Before "behind me", it says no side."""
_OTHER_THING = re.compile(
    r",(?! (?:which|and|but|just|still|it|right|only|over|back|there)\b) [a-z]+ "
)
"""English: after a name, a further thing without one: "the mug, a thing on the left"."""


def _pairs(clause: Clause, start: int, end: int) -> Iterator[tuple[int, Mention]]:
    for place, mention in zip(clause.places, clause.mentions, strict=True):
        if start <= place < end:
            yield place, mention
