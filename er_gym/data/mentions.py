"""Finds the object types that a text names, in English and Chinese.

``"the credit card on the coffee table"`` names a CreditCard and a CoffeeTable. A name of several
types, such as "table", stands for all of them: a statement about it is true if it is true for one
of them. Names are looked up as whole words, the longest first, so that "desk lamp" is no Desk.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Literal

from er_gym.data.names_en import MODIFIERS, NAMES_EN
from er_gym.data.names_zh import NAMES_ZH
from er_gym.data.shared_names import SHARED_EN, SHARED_ZH
from er_gym.envs.asked_goal import goal
from er_gym.tasks.equivalence import same_type
from er_gym.thor import OBJECT_TYPES

Language = Literal["en", "zh"]


@dataclass(frozen=True)
class Mention:
    """A name of an object in a text.

    Attributes:
        start, end: where it stands.
        text: as it is written.
        types: the object types that it may mean.
    """

    start: int
    end: int
    text: str
    types: frozenset[str]


WIDER: Mapping[str, tuple[str, ...]] = {
    # What people call by the name of another type.
    "bottle": ("SoapBottle", "SprayBottle", "WineBottle"),
    "box": ("TissueBox",),
    "cabinet": ("TVStand", "Dresser"),
    "cup": ("Mug",),
    "chair": ("ArmChair",),
    "clock": ("Watch",),
    "cushion": ("Ottoman",),
    "desk": ("DiningTable", "SideTable"),
    "dish": ("Bowl",),
    "drawer": ("Dresser",),
    "drawers": ("Dresser",),
    "flower": ("Vase",),
    "glass": ("Bowl", "ShowerGlass"),
    "knife": ("ButterKnife",),
    "light": ("Candle",),
    "mug": ("Cup",),
    "pan": ("Pot",),
    "pot": ("Pan",),
    "screen": ("Laptop",),
    "shelf": ("ShelvingUnit",),
    "sofa": ("ArmChair",),
    "couch": ("ArmChair",),
    "spoon": ("Ladle",),
    "stool": ("Footstool", "Ottoman"),
    "footstool": ("Ottoman",),
    "脚凳": ("Ottoman",),
    "switch": ("StoveKnob",),
    "table": ("Desk", "TVStand"),
    "towel": ("HandTowel",),
    "瓶子": ("SoapBottle", "SprayBottle", "WineBottle"),
    "杯": ("Mug",),
    "柜子": ("Dresser", "TVStand", "SideTable"),
    "柜": ("Dresser", "TVStand", "SideTable"),
    "椅子": ("ArmChair",),
    "刀": ("ButterKnife",),
    "盒子": ("TissueBox",),
    "凳子": ("Footstool", "Ottoman"),
    "置物架": ("Shelf",),
    "储物架": ("Shelf",),
    "搁架": ("ShelvingUnit",),
    "书架": ("TVStand",),
    "shelving": ("Shelf",),
    "rack": ("ShelvingUnit", "TowelHolder", "HandTowelHolder"),
    "架子": ("ShelvingUnit", "TowelHolder", "HandTowelHolder"),
    "抽屉": ("Dresser",),
    "沙发": ("ArmChair",),
    "桌子": ("TVStand",),
    "勺子": ("Ladle",),
}
_MORE_EN: Mapping[str, tuple[str, ...]] = {
    "seat": ("Chair", "ArmChair", "Sofa", "Stool"),
    "holder": ("TowelHolder", "HandTowelHolder", "ToiletPaperHanger"),
    "kitchen table": ("DiningTable", "SideTable"),
}
_MORE_ZH: Mapping[str, tuple[str, ...]] = {
    "沙发椅": ("ArmChair", "Sofa"),
    "椅": ("Chair", "ArmChair"),
    "浴盆": ("Bathtub", "BathtubBasin"),
    "灶具": ("StoveBurner", "StoveKnob"),
}
_WEAK = frozenset(
    """
    alarm art ball bar bat bath bear bin book books bust can card cards cell cloth cooker counter
    disc dish disk flipper floor flower foil fork glass ground hob island key keys knob light lights
    novel ornament paper pan pen pepper picture pictures plate plant pot rack range rag remote safe
    salt scoop screen seat shade shades shower soap spray stand stove switch switches tap tissue
    toast trash turner vacuum watch watches weight weights window wine holder chest urn vault drape
    tub basin brush garbage mobile roll volume
    """.split()
)
"""English names that are other words as well: they count after an article or the like."""
_DETERMINERS = frozenset(
    """
    the a an this that these those my its their his her your our some any no another other each
    every either neither which what both two three four five six several many few more one
    and or of with without
    """.split()
)
_NO_NAME = re.compile(
    r"a (?:bath|shower|drawer of|range of|set of)(?: for\b|$)|a bath\b|(?:the )?(?:picture|image) (?:shows|does|is|i)\b|(?:in|from|of) (?:the|this|my|a) picture\b"
    r"|the (?:key|keys) (?:point|thing|is|to|idea|question|here|for|part|step|lies)\b"
    r"|(?:the|this|that|a) light of\b|the (?:full|whole|wide)? ?range of\b|range\b"
    r"|(?:a|the) safe (?:bet|choice|place|guess|assumption|distance|side)\b"
    r"|(?:the|a|some|any|this|that) light (?:is good|in here|here|from|falls|coming)\b"
    r"|the (?:right|same|first|second) book\b|the weight of\b",
    re.IGNORECASE,
)
"""What looks like a name and is none."""
_NO_NAME_ZH = re.compile(
    r"地(?!板|面|上)|[花](?=时间|费|了|点|些|掉)|画(?=面|出|像)|布(?=局|置|满)|卡(?=住|在|着)|[分点]钟|时钟(?=方向)"
    r"|书(?=房|写)|盘(?=算|点)|厕所|鞋(?=柜)|电话(?=里)|天花|蛋糕|床(?=头)(?!头柜|头桌)|切换|开关(?=门|过|了|一遍|一次)|球(?=形)"
    r"|[纸](?=上谈)|布满|刀(?=口)|灯(?=光|火|罩|泡|芯|影)|池子|杯(?=具)|操作(?=台灯)"
)
_WORDS = re.compile(r"[A-Za-z]+(?:\d+)?")
_CAMEL = re.compile(r"[A-Z]+(?![a-z])|[A-Z][a-z]+|\d+")
_LONGEST_EN = 4
"""The most words of an English name."""
_JOINTS = frozenset(("", " ", "-", "_", "  "))


def _plurals(name: str) -> Iterator[str]:
    """A name in lower case and its plural forms."""
    yield name
    yield name + "s"
    if name.endswith(("s", "x", "z", "ch", "sh", "o")):
        yield name + "es"
    if name.endswith("y"):
        yield name[:-1] + "ies"
    if name.endswith("f"):
        yield name[:-1] + "ves"
    if name.endswith("fe"):
        yield name[:-2] + "ves"


@cache
def interchangeable(object_type: str) -> frozenset[str]:
    """The types that count as one: a Sink and its SinkBasin, an Egg and its EggCracked."""
    others = {other for other in OBJECT_TYPES if same_type(object_type, other)}
    whole = object_type.removesuffix("Sliced").removesuffix("Cracked")
    others |= {whole, f"{whole}Sliced", f"{whole}Cracked"} & {*OBJECT_TYPES}
    return frozenset(others)


def all_interchangeable(types: Iterable[str]) -> frozenset[str]:
    """:func:`interchangeable` of several types."""
    return frozenset(other for each in types for other in interchangeable(each))


@cache
def _english() -> Mapping[str, frozenset[str]]:
    """Every English name, in lower case without spaces, with what it may mean."""
    found: dict[str, set[str]] = {}
    tables = (
        ((name, (name,)) for name in OBJECT_TYPES),
        ((other, (name,)) for name, others in NAMES_EN.items() for other in others),
        SHARED_EN.items(),
        _MORE_EN.items(),
    )
    for table in tables:
        for name, types in table:
            key = "".join(_WORDS.findall(name)).lower()
            for form in _plurals(key):
                found.setdefault(form, set()).update((*types, *WIDER.get(key, ())))
    return {name: frozenset(types) for name, types in found.items()}


@cache
def _chinese() -> Mapping[str, frozenset[str]]:
    """Every Chinese name with what it may mean."""
    found: dict[str, set[str]] = {}
    tables = (
        ((other, (name,)) for name, others in NAMES_ZH.items() for other in others),
        SHARED_ZH.items(),
        _MORE_ZH.items(),
    )
    for table in tables:
        for name, types in table:
            found.setdefault(name, set()).update((*types, *WIDER.get(name, ())))
    del found["厕所"]  # the room as well
    return {name: frozenset(types) for name, types in found.items()}


@cache
def _chinese_lengths() -> Mapping[str, tuple[int, ...]]:
    """The lengths of the names that begin with a character, longest first."""
    lengths: dict[str, set[int]] = {}
    for name in _chinese():
        lengths.setdefault(name[0], set()).add(len(name))
    return {first: tuple(sorted(those, reverse=True)) for first, those in lengths.items()}


def _in_english(text: str) -> Iterator[Mention]:
    names = _english()
    words = list(_WORDS.finditer(text))
    lower = [word.group().lower() for word in words]
    spans = [word.span() for word in words]
    barred = [match.span() for match in _NO_NAME.finditer(text)]
    chinese = bool(_HAN.search(text))
    k = 0
    while k < len(words):
        key, last = "", 0
        found: frozenset[str] | None = None
        for n in range(k, min(k + _LONGEST_EN, len(words))):
            if n > k and text[spans[n - 1][1] : spans[n][0]] not in _JOINTS:
                break
            key += lower[n]
            if key in names:
                found, last = names[key], n
        if found is None:
            k += 1
            continue
        start, end = spans[k][0], spans[last][1]
        written = text[start:end]
        exact = written in OBJECT_TYPES and (
            chinese or len(_CAMEL.findall(written)) > 1 or not _begins(text, start)
        )
        if exact:
            found = frozenset({written})
        elif any(a <= start < b for a, b in barred) or (
            last == k
            and not _WEAK.isdisjoint((lower[k], lower[k].removesuffix("s")))
            and not _after_article(lower, spans, text, k)
        ):
            k += 1
            continue
        yield Mention(start, end, written, found)
        k = last + 1


def _begins(text: str, start: int) -> bool:
    """Whether a sentence begins there, so that a capital letter says nothing."""
    before = text[:start].rstrip(" \"'(*")
    return not before or before[-1] in ".!?:\n"


def _after_article(lower: list[str], spans: list[tuple[int, int]], text: str, k: int) -> bool:
    if k == 0 or text[spans[k - 1][1] : spans[k][0]] not in (" ", "-", "'s ", ", "):
        return False
    return lower[k - 1] in _DETERMINERS or lower[k - 1] in MODIFIERS


def _in_chinese(text: str) -> Iterator[Mention]:
    names, lengths = _chinese(), _chinese_lengths()
    barred = {at for match in _NO_NAME_ZH.finditer(text) for at in range(*match.span())}
    k = 0
    while k < len(text):
        for length in lengths.get(text[k], ()):
            written = text[k : k + length]
            if written in names and not (k in barred and (length <= 2 or written == "操作台")):
                yield Mention(k, k + length, written, names[written])
                k += length
                break
        else:
            k += 1


_ASCII = re.compile(r"[A-Za-z]{2}")
_HAN = re.compile(r"[\u4e00-\u9fff]")


@lru_cache(maxsize=1024)
def find_mentions(text: str) -> tuple[Mention, ...]:
    """All names of objects in a text, in the order in which they stand there.

    English names are found in Chinese text too, and the other way round.
    """
    found: list[Mention] = []
    if _ASCII.search(text):
        found += _in_english(text)
    if _HAN.search(text):
        found += _in_chinese(text)
        found.sort(key=lambda mention: mention.start)
    return tuple(found)


@lru_cache(maxsize=4096)
def named_in(instruction: str) -> tuple[str, ...]:
    """The object types that an instruction names, in order; of a name that several types bear, all
    of them."""
    spelled = [name for name, _ in goal(instruction)[1]]
    others = (each for mention in find_mentions(instruction) for each in sorted(mention.types))
    return tuple(dict.fromkeys((*spelled, *others)))
