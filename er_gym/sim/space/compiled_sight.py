"""Lines of sight by a compiled kernel, where the machine has a C compiler.

The kernel is sight.c. It answers as NumPy does, to the bit, and needs no memory of earlier answers:
a look takes 20 microseconds, and NumPy's first one from a place half a millisecond.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_gym.shared_library import compiled
from er_gym.sim.space.frustum import NEAR_PLANE, Lens

_SOURCE = Path(__file__).with_name("sight.c")
_ARRAYS: Sequence[tuple[str, Any]] = (
    ("points", np.float32),
    ("first_point", np.intp),
    ("point_count", np.intp),
    ("box_low", np.float32),
    ("box_high", np.float32),
    ("box_owner", np.intp),
    ("removed", np.bool_),
    ("concealed", np.bool_),
    ("within", np.bool_),
    ("from_outside", np.bool_),
    ("slab", np.bool_),
    ("carcass", np.bool_),
    ("in_counter", np.bool_),
)
"""The arrays of the kernel's ``Arrangement``, in its order."""


_Arrangement = ctypes.c_ssize_t * (2 + len(_ARRAYS))
"""The kernel's ``Arrangement``: the numbers of objects and of boxes, and where the arrays are."""
_Camera = ctypes.c_double * 10
"""The kernel's ``Camera``: x, y, z; sine and cosine of yaw, of pitch; near plane, slope, aspect."""


@cache
def kernel() -> ctypes.PyDLL | None:
    """The compiled kernel, None if there is none here; a process asks once."""
    library = compiled(_SOURCE)
    if library is not None:
        pointer, number = ctypes.c_void_p, ctypes.c_ssize_t
        library.er_gym_look.argtypes = [pointer, pointer, pointer]
        library.er_gym_unobstructed.argtypes = [
            pointer,
            number,
            pointer,
            number,
            pointer,
            number,
            pointer,
        ]
    return library


class CompiledSight:
    """The lines of sight of one arrangement, by the kernel, which must be there.

    Args:
        arrays: by their names in the kernel; they must not change.
    """

    def __init__(self, **arrays: NDArray[Any]) -> None:
        library = kernel()
        assert library is not None
        self._look, self._unobstructed = library.er_gym_look, library.er_gym_unobstructed
        self._kept = [np.ascontiguousarray(arrays[name], kind) for name, kind in _ARRAYS]
        self._count = len(arrays["point_count"])
        self._buffer = ctypes.c_char * self._count
        addresses = (array.ctypes.data for array in self._kept)
        self._arrangement = _Arrangement(self._count, len(arrays["box_owner"]), *addresses)
        self._address = ctypes.addressof(self._arrangement)

    def look(self, camera: NDArray[np.float64], lens: Lens) -> NDArray[np.bool_]:
        """(N,) the objects with a point that is in the picture and that nothing hides.

        Args:
            camera: (3,) its position, metres.
        """
        seen = bytearray(self._count)
        buffer = self._buffer.from_buffer(seen)
        if not self._look(self._address, _Camera(*camera.tolist(), *_lens(lens)), buffer):
            raise MemoryError
        return np.frombuffer(seen, dtype=np.bool_)

    def unobstructed(
        self, eyes: NDArray[np.float64], points: NDArray[np.float32], i: int
    ) -> NDArray[np.bool_]:
        """(E, Q) whether nothing hides (Q, 3) points of object i from (E, 3) eyes, metres."""
        origins, points = eyes.astype(np.float32, order="C"), np.ascontiguousarray(points)
        clear = np.empty((len(eyes), len(points)), dtype=np.bool_)
        done = self._unobstructed(
            self._address,
            i,
            origins.ctypes.data,
            len(origins),
            points.ctypes.data,
            len(points),
            clear.ctypes.data,
        )
        if not done:
            raise MemoryError
        return clear


@lru_cache(maxsize=256)
def _lens(lens: Lens) -> tuple[float, ...]:
    """What the kernel knows of a lens, as :func:`~er_gym.sim.space.frustum.in_frustum` has it."""
    rotation, horizon, field_of_view, aspect = lens
    yaw, pitch = np.radians(rotation), np.radians(horizon)
    slope = np.tan(np.radians(field_of_view) / 2)
    numbers = (np.sin(yaw), np.cos(yaw), np.sin(pitch), np.cos(pitch), NEAR_PLANE, slope, aspect)
    return tuple(map(float, numbers))
