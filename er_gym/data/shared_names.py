"""Names that several object types share, in English and Chinese."""

from __future__ import annotations

from collections.abc import Mapping

_SHARED: tuple[tuple[str, str, str], ...] = (
    ("DiningTable CoffeeTable SideTable", "table", ""),
    ("DeskLamp FloorLamp", "lamp", ""),
    ("LightSwitch FloorLamp DeskLamp", "light", "灯"),
    ("Laptop Desktop", "computer", "电脑"),
    ("Television Desktop", "screen", ""),
    ("SoapBar SoapBottle", "soap", ""),
    ("ToiletPaper Newspaper PaperTowelRoll", "paper", "纸"),
    ("TableTopDecor RoomDecor", "decorative item/decoration/decor", "装饰品"),
    ("ShelvingUnit Shelf", "bookshelf/bookcase", "书架"),
    ("StoveBurner StoveKnob", "stove", "炉灶/炉子"),
    ("StoveBurner CounterTop", "", "灶台"),
    ("TowelHolder HandTowelHolder", "towel rack/towel bar", "毛巾架"),
    ("Curtains ShowerCurtain", "curtain", ""),
    ("ShowerHead ShowerDoor ShowerCurtain", "shower", "淋浴"),
    ("SinkBasin BathtubBasin", "basin", ""),
    ("Bathtub BathtubBasin", "tub/bath", ""),
    ("Painting Poster", "picture", ""),
    ("Statue TableTopDecor", "figurine", ""),
    ("Cup Mug", "glass", "杯子"),
    ("Mug Cup", "teacup", ""),
    ("ArmChair Sofa", "recliner", ""),
    ("GarbageCan GarbageBag", "trash/garbage", ""),
    ("SideTable Dresser", "nightstand", ""),
    ("Footstool Ottoman", "footrest", ""),
    ("Dresser Safe", "chest", ""),
    ("DiningTable CoffeeTable SideTable Desk", "", "桌子"),
    ("TissueBox PaperTowelRoll", "", "纸巾"),
    ("ToiletPaper PaperTowelRoll", "roll", "纸卷"),
    ("SinkBasin Sink", "", "水池"),
    ("Pot Pan", "", "锅"),
    ("Spoon Ladle", "", "勺"),
    ("Towel HandTowel", "", "毛巾"),
    ("Pen Pencil", "", "笔"),
)
"""Object types, the usual one first; their English names; their Chinese names."""


def _types_by_name(language: int) -> dict[str, tuple[str, ...]]:
    return {
        name: tuple(row[0].split())
        for row in _SHARED
        for name in filter(None, row[language].split("/"))
    }


SHARED_EN: Mapping[str, tuple[str, ...]] = _types_by_name(1)
SHARED_ZH: Mapping[str, tuple[str, ...]] = _types_by_name(2)
"""Names of several types. One that is at hand is meant, else the first."""
