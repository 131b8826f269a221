"""The object types that each receptacle type accepts: AI2-THOR's placement restrictions.

The table groups object types, because AI2-THOR's own table does too: every food goes to much the
same places. It joins AI2-THOR's documentation of object types with every containment that the 120
recorded scenes show.
"""

from __future__ import annotations

from functools import lru_cache

COUNTERS = "DiningTable TVStand CoffeeTable SideTable CounterTop"
TABLES = f"{COUNTERS} Desk"
COOKWARE = "Pot Pan Bowl"
SINKS = "Sink SinkBasin"
SEATS = "Sofa ArmChair"
STORAGE = "Cabinet Shelf Drawer"

# fmt: off
_ACCEPTED_BY: dict[str, str] = {
    # Kitchen: food
    "Apple AppleSliced": f"{COOKWARE} Plate Microwave Fridge {SINKS} {TABLES} Dresser GarbageCan",
    "Potato PotatoSliced Egg EggCracked": f"{COOKWARE} Plate Microwave Fridge {SINKS} {COUNTERS} GarbageCan",
    "Tomato TomatoSliced": f"Pot Bowl Plate Fridge {SINKS} {COUNTERS} GarbageCan",
    "Lettuce LettuceSliced": f"{COOKWARE} Plate Fridge {SINKS} {COUNTERS} GarbageCan",
    "Bread": f"Plate Microwave Fridge {TABLES} GarbageCan",
    "BreadSliced": f"Plate Toaster Microwave Fridge {TABLES} GarbageCan",
    # Kitchen: tools
    "ButterKnife": f"{COOKWARE} Plate Mug Cup {SINKS} {TABLES} Drawer",
    "Fork Spoon": f"{COOKWARE} Plate Mug Cup {SINKS} {COUNTERS} Drawer",
    "Knife": f"{COOKWARE} Plate Mug {SINKS} {COUNTERS} Drawer",
    "Ladle": f"{COOKWARE} Plate {SINKS} {COUNTERS} Drawer Cabinet",
    "Spatula": f"{COOKWARE} Plate {SINKS} {COUNTERS} Drawer",
    "DishSponge": f"{COOKWARE} Plate Box {SINKS} {COUNTERS} {STORAGE} Cart Toilet GarbageCan Bathtub BathtubBasin",
    "SaltShaker PepperShaker": f"{COUNTERS} {STORAGE}",
    "Bowl Plate Cup": f"Microwave Fridge Dresser {SINKS} {TABLES} Cabinet Shelf",
    "Mug": f"Microwave Fridge CoffeeMachine {SINKS} {TABLES} Cabinet Shelf",
    "Pot": f"StoveBurner Fridge {SINKS} {COUNTERS} Cabinet Shelf",
    "Pan": f"StoveBurner Fridge {SINKS} {COUNTERS} Cabinet",
    "Kettle": f"StoveBurner {SINKS} {COUNTERS} Cabinet Shelf",
    "Bottle": f"Fridge Box Dresser {SINKS} {TABLES} Cabinet Shelf GarbageCan",
    "WineBottle": f"Fridge Dresser {TABLES} Cabinet Shelf GarbageCan",
    "AluminumFoil": f"{COUNTERS} Shelf",
    # Living room and bedroom
    "AlarmClock": f"Box Dresser {TABLES} Shelf",
    "BaseballBat": f"Bed {TABLES}",
    "BasketBall": f"{SEATS} Dresser Bed {TABLES}",
    "TennisRacket": f"Dresser Bed {TABLES}",
    "Book": f"{SEATS} Ottoman Bed Box Dresser {TABLES} {STORAGE}",
    "Box": f"{SEATS} Ottoman Dresser {TABLES} Cabinet Shelf",
    "CD": f"{SEATS} Ottoman Box Dresser {TABLES} {STORAGE} Safe GarbageCan",
    "CellPhone": f"{SEATS} Ottoman Bed Box Dresser {TABLES} Shelf Drawer Safe",
    "CreditCard": f"{SEATS} Ottoman Bed Box Dresser {TABLES} Shelf Drawer",
    "KeyChain": f"{SEATS} Ottoman Bed Box Dresser {TABLES} Shelf Drawer Safe",
    "Watch": f"Box Dresser {TABLES} Shelf Drawer Safe",
    "Laptop": f"{SEATS} Ottoman Bed Dresser {TABLES}",
    "Newspaper": f"{SEATS} Ottoman Bed Toilet Dresser {TABLES} {STORAGE} GarbageCan",
    "Pen Pencil": f"Mug Box Dresser Bed {TABLES} Shelf Drawer GarbageCan",
    "Pillow": f"{SEATS} Ottoman Bed",
    "RemoteControl": f"{SEATS} Ottoman Box Dresser {TABLES} Shelf Drawer",
    "Statue": f"Box Dresser {TABLES} Shelf Cart Safe",
    "Vase": f"Box Dresser {TABLES} Cabinet Shelf Cart Safe",
    "TeddyBear": f"{SEATS} Ottoman Bed Dresser {TABLES} Safe",
    "WateringCan": f"Dresser {TABLES} {STORAGE}",
    "TableTopDecor": f"Desk Shelf {COUNTERS}",
    # Bathroom
    "Candle": f"Box Dresser Toilet Cart Bathtub {TABLES} {STORAGE}",
    "Cloth": f"{SEATS} Ottoman Box Dresser LaundryHamper {TABLES} {STORAGE} Cart Toilet {SINKS} GarbageCan Bathtub BathtubBasin",
    "HandTowel": "HandTowelHolder",
    "Towel": "TowelHolder",
    "PaperTowelRoll": f"{COUNTERS} {STORAGE} Toilet",
    "Plunger": "Cart Cabinet",
    "SoapBar": f"Toilet {SINKS} {COUNTERS} {STORAGE} Cart GarbageCan Bathtub BathtubBasin",
    "SoapBottle": f"Dresser Toilet Sink {TABLES} {STORAGE} Cart GarbageCan Bathtub",
    "SprayBottle": f"Dresser Toilet {TABLES} {STORAGE} Cart GarbageCan",
    "TissueBox": f"Box Dresser Toilet {TABLES} {STORAGE} Cart GarbageCan",
    "ToiletPaper": f"ToiletPaperHanger Dresser Toilet {TABLES} {STORAGE} Cart GarbageCan Bathtub",
}
# fmt: on


@lru_cache(maxsize=1)
def placement_table() -> dict[str, frozenset[str]]:
    """The receptacle types that accept each object type."""
    return {
        object_type: frozenset(receptacles.split())
        for family, receptacles in _ACCEPTED_BY.items()
        for object_type in family.split()
    }


def accepts(object_type: str, receptacle_type: str) -> bool:
    """Whether AI2-THOR's ``PutObject`` accepts this object type in or on this receptacle type."""
    return receptacle_type in placement_table().get(object_type, frozenset())
