"""Ids of objects in FloorPlan1, a kitchen."""

from __future__ import annotations

APPLE = "Apple|-00.47|+01.15|+00.48"
BOWL = "Bowl|+00.27|+01.10|-00.75"
BREAD = "Bread|-00.52|+01.17|-00.03"
CABINET = "Cabinet|+00.68|+02.02|-02.46"
CUP = "Cup|+00.37|+01.64|-02.58"
EGG = "Egg|-02.04|+00.81|+01.24"
FRIDGE = "Fridge|-02.10|+00.00|+01.07"
ISLAND = "CounterTop|-00.08|+01.15|00.00"
"""The counter in the middle of the room."""
MUG = "Mug|-01.76|+00.90|-00.62"
PLATE = "Plate|+00.96|+01.65|-02.61"
