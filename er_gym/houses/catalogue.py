"""What belongs into which room, as tables."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

from er_gym.sim.house.assets import Asset, assets_of_type


@dataclass(frozen=True)
class Piece:
    """A kind of furniture.

    Attributes:
        type: AI2-THOR's object type.
        chance: that the room has it; above 1, how many on average.
        free: how much floor before it stays free, metres.
        has: properties that its asset must have.
        most: the largest width of its asset, metres.
        turned: whether its front (+z) is at the wall: a bed's headboard is there.
        at_wall: whether it stands at a wall; else in the open.
        on: the type of furniture that it stands on, ``""`` for the floor.
        parts: the type of part that its asset must have.
    """

    type: str
    chance: float = 1.0
    free: float = 0.55
    has: str = ""
    most: float = 3.0
    turned: bool = False
    at_wall: bool = True
    on: str = ""
    parts: str = ""


FURNITURE: dict[str, tuple[Piece, ...]] = {
    "Kitchen": (
        Piece("Fridge", has="openable", most=1.0),
        Piece("CounterTop", 1.7, most=2.0),
        Piece("Sink", free=0.5, has="receptacle", parts="SinkBasin"),
        Piece("DiningTable", 0.9, most=1.7, at_wall=False),
        Piece("Microwave", has="openable toggleable", on="CounterTop"),
        Piece("CoffeeMachine", 0.8, has="toggleable", on="CounterTop"),
        Piece("Toaster", 0.8, has="toggleable", on="CounterTop"),
        Piece("SideTable", 0.7, has="receptacle", most=1.0, parts="Drawer"),
        Piece("Chair", 1.6, 0.0, has="receptacle moveable", at_wall=False),
        Piece("GarbageCan", 1.0, 0.3, has="receptacle"),
        Piece("HousePlant", 0.4, 0.0),
        Piece("Stool", 0.4, 0.0),
    ),
    "LivingRoom": (
        Piece("Sofa", most=2.4, has="receptacle"),
        Piece("TVStand", has="receptacle", most=1.6),
        Piece("Television", has="toggleable", on="TVStand", most=1.3),
        Piece("ArmChair", 0.9, has="receptacle", most=1.2),
        Piece("CoffeeTable", 0.9, 0.4, has="receptacle", at_wall=False, most=1.3),
        Piece("Dresser", 0.8, 0.75, has="receptacle", most=1.7, parts="Drawer"),
        Piece("SideTable", 1.2, has="receptacle", most=1.0, parts="Drawer"),
        Piece("Desk", 0.5, 0.75, has="receptacle", most=1.6),
        Piece("Safe", 0.4, 0.5, has="openable"),
        Piece("FloorLamp", 0.9, 0.25, has="toggleable", most=0.6),
        Piece("DeskLamp", 0.6, has="toggleable", on="SideTable"),
        Piece("HousePlant", 0.8, 0.0),
        Piece("GarbageCan", 0.6, 0.3, has="receptacle"),
        Piece("Chair", 0.4, 0.0, has="receptacle moveable", at_wall=False),
    ),
    "Bedroom": (
        Piece("Bed", 1.0, 0.6, has="receptacle", most=1.8, turned=True),
        Piece("Dresser", 1.0, 0.75, has="receptacle", most=1.6, parts="Drawer"),
        Piece("SideTable", 1.2, has="receptacle", most=0.9, parts="Drawer"),
        Piece("Desk", 0.9, 0.75, has="receptacle", most=1.6),
        Piece("DeskLamp", 0.9, has="toggleable", on="Desk"),
        Piece("Safe", 0.3, 0.5, has="openable"),
        Piece("LaundryHamper", 0.4, 0.3, has="receptacle openable"),
        Piece("FloorLamp", 0.4, 0.25, has="toggleable", most=0.6),
        Piece("GarbageCan", 0.7, 0.3, has="receptacle"),
        Piece("Chair", 0.7, 0.0, has="receptacle moveable", at_wall=False),
        Piece("HousePlant", 0.3, 0.0),
    ),
    "Bathroom": (
        Piece("Toilet", 1.0, 0.5, has="receptacle"),
        Piece("Sink", 1.0, 0.55, has="receptacle", parts="SinkBasin"),
        Piece("SideTable", 0.9, 0.5, has="receptacle", most=0.8, parts="Drawer"),
        Piece("GarbageCan", 0.9, 0.25, has="receptacle"),
        Piece("LaundryHamper", 0.3, 0.3, has="receptacle openable"),
    ),
}
"""The furniture of each kind of room, in the order in which it is placed: what is needed most, and
what needs most room, comes first."""

SMALL: dict[str, str] = {
    "Kitchen": (
        "Apple Tomato Potato Lettuce Egg Bread Bowl Plate Mug Cup Pot Pan Knife ButterKnife Fork "
        "Spoon Spatula SaltShaker PepperShaker DishSponge SoapBottle Kettle Bottle WineBottle "
        "PaperTowelRoll Apple Mug Plate Book Vase"
    ),
    "LivingRoom": (
        "RemoteControl Book Laptop Newspaper Pillow CellPhone KeyChain CreditCard Statue Vase Box "
        "Watch TissueBox CD Pen Pencil Candle Bowl Plate WateringCan Box"
    ),
    "Bedroom": (
        "Pillow Book Laptop CellPhone AlarmClock Pen Pencil CD KeyChain CreditCard Mug TeddyBear "
        "BasketBall Box Cloth Watch Bowl TissueBox"
    ),
    "Bathroom": (
        "SoapBottle SoapBar ToiletPaper Cloth SprayBottle Candle TissueBox DishSponge ToiletPaper"
    ),
}
"""The small things of each kind of room; a type that occurs twice may be there twice."""

NEEDED = {
    "CellPhone": "breakable", "Laptop": "openable toggleable", "Book": "openable",
    "Candle": "toggleable", "Mug": "canFillWithLiquid", "Bowl": "canFillWithLiquid",
    "Box": "openable", "Egg": "sliceable", "Potato": "cookable",
}  # fmt: skip
"""Properties that small things must have, where some assets of their type lack them."""


@cache
def choices(piece: Piece) -> tuple[Asset, ...]:
    """The assets that a piece of furniture may be."""
    needed = set(piece.has.split())
    found = tuple(
        asset
        for asset in assets_of_type(piece.type)
        if needed <= asset.has
        and asset.size[0] <= piece.most
        and (not piece.parts or any(part.type == piece.parts for part in asset.parts))
        and ("Countertop_I" in asset.id or piece.type != "CounterTop")
    )
    assert found, piece
    return found


@cache
def small_choices(kind: str) -> tuple[Asset, ...]:
    """The assets of a small thing."""
    needed = {"pickupable", *NEEDED.get(kind, "").split()}
    return tuple(asset for asset in assets_of_type(kind) if needed <= asset.has)
