"""What instructions call the object types: "CellPhone", "cell phone", "phone", "手机"."""

from __future__ import annotations

import random
import re
from collections.abc import Mapping
from functools import cache

from er_gym.tasks.config_folder import config_directory
from er_gym.tasks.reading import read_yaml
from er_gym.tasks.wordings.grammar import Parts, Wording
from er_gym.tasks.wordings.words import with_article
from er_gym.thor import OBJECT_TYPES

SYNONYMS: Mapping[str, Parts[str]] = {
    "AlarmClock": Parts((), ("bedside clock",)),
    "Cabinet": Parts((), ("cupboard",)),
    "CellPhone": Parts(("phone",), ("mobile phone",)),
    "Cloth": Parts((), ("rag",)),
    "CounterTop": Parts(("counter",), ()),
    "CreditCard": Parts((), ("bank card",)),
    "DeskLamp": Parts((), ("table lamp",)),
    "Desktop": Parts(("desktop computer",), ()),
    "DiningTable": Parts((), ("dinner table",)),
    "DishSponge": Parts(("sponge",), ()),
    "Faucet": Parts(("tap",), ()),
    "Fridge": Parts(("refrigerator",), ()),
    "GarbageCan": Parts(("bin",), ("trash can",)),
    "Laptop": Parts(("laptop computer",), ()),
    "Pan": Parts(("frying pan",), ()),
    "Pillow": Parts((), ("cushion",)),
    "RemoteControl": Parts(("remote",), ()),
    "Sofa": Parts(("couch",), ()),
    "TeddyBear": Parts((), ("stuffed bear",)),
    "Television": Parts((), ("telly",)),
    "ToiletPaper": Parts(("toilet roll",), ()),
    "Watch": Parts(("wristwatch",), ()),
}
"""Object type to other English names, none of which any other type bears."""

_WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z][a-z]+|\d+")
_ARTICLE = r"(?:\b(?P<article>an?|some) )?"


def apart(object_type: str) -> str:
    """A type as separate words in lower case, but for abbreviations: "cell phone", "TV stand"."""
    return " ".join(w if w.isupper() else w.lower() for w in _WORD.findall(object_type))


@cache
def chinese_names() -> Mapping[str, Parts[str]]:
    """Object type to its Chinese names: the common one is seen, the second one is not."""
    names: dict[str, Parts[str]] = {}
    for kind, said in read_yaml(config_directory("thoughts") / "zh" / "names.yaml").items():
        words = [each.split(maxsplit=1)[-1] for each in said.split(", ")]
        names[kind] = Parts((words[0],), tuple(words[1:2]))
    return names


@cache
def types_by_name() -> Mapping[str, str]:
    """Each name to the type that it stands for, English ones in lower case."""
    found = {name.lower(): kind for kind in OBJECT_TYPES for name in (kind, apart(kind))}
    for names in (SYNONYMS, chinese_names()):
        found |= {name.lower(): kind for kind, parts in names.items() for name in parts.all}
    return found


def renamed(instruction: str, wording: Wording, rng: random.Random) -> str:
    """An English instruction with its types spelled as they are, in words, or by other names.

    One of these ways is drawn. Sliced things keep their types' names, because "sliced" is no name.

    Args:
        instruction: it names object types as they are spelled.
        wording: of unseen synonyms, ``seen`` takes none; ``unseen`` takes them first.
        rng: draws the way.
    """
    way = rng.choice(("spelled", "words", "synonyms"))
    if way == "spelled":
        return instruction

    def name(match: re.Match[str]) -> str:
        kind = match["type"]
        parts = SYNONYMS.get(kind, Parts((), ()))
        others = parts.unseen or parts.seen if wording == "unseen" else parts.seen
        said = rng.choice(others) if others and way == "synonyms" else apart(kind)
        if not match["article"]:
            return said
        article = with_article(kind).split()[0] if said == apart(kind) else None
        return f"{article or ('an' if said[0] in 'aeiou' else 'a')} {said}"

    return _spelled().sub(name, instruction)


def as_types(instruction: str) -> str:
    """An instruction with types for all names, articles made alike, to be compared with others."""
    return _named().sub(lambda match: f"<{types_by_name()[match['type'].lower()]}>", instruction)


def types_named_in(instruction: str) -> frozenset[str]:
    """The object types that an instruction names, by whatever name, in English or Chinese."""
    return frozenset(
        types_by_name()[each["type"].lower()] for each in _named().finditer(instruction)
    )


def names_unseen(instruction: str) -> bool:
    """Whether an instruction calls a type by a name that is kept for evaluation."""
    held_out = _held_out()
    return any(match["type"].lower() in held_out for match in _named().finditer(instruction))


@cache
def _spelled() -> re.Pattern[str]:
    kinds = sorted((k for k in OBJECT_TYPES if "Sliced" not in k), key=len, reverse=True)
    return re.compile(rf"{_ARTICLE}\b(?P<type>{'|'.join(kinds)})\b")


@cache
def _named() -> re.Pattern[str]:
    # Python tries all alternatives at each place of a text. So the English ones are tried at the
    # beginnings of words only, and there those with the right first letter: six times as fast.
    names = sorted(types_by_name(), key=len, reverse=True)
    chinese = [each for each in names if not each.isascii()]
    english: dict[str, list[str]] = {}
    for each in filter(str.isascii, names):
        english.setdefault(each[0], []).append(each[1:])
    words = "|".join(f"{first}(?:{'|'.join(rest)})" for first, rest in english.items())
    return re.compile(rf"{_ARTICLE}(?P<type>\b(?:{words})\b|{'|'.join(chinese)})", re.IGNORECASE)


@cache
def _held_out() -> frozenset[str]:
    tables = (SYNONYMS, chinese_names())
    return frozenset(name.lower() for table in tables for p in table.values() for name in p.unseen)
