"""Points and directions as parameters of actions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict


class Vector(BaseModel):
    """A point or a direction as AI2-THOR writes it; other keys are ignored."""

    model_config = ConfigDict(allow_inf_nan=False)

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


def array(vector: Vector) -> NDArray[np.float64]:
    """(3,) the numbers of a vector."""
    return np.array([vector.x, vector.y, vector.z])


class PartialVector(BaseModel):
    """A point or a direction with some coordinates left out."""

    model_config = ConfigDict(allow_inf_nan=False)

    x: float | None = None
    y: float | None = None
    z: float | None = None
