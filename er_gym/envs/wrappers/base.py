"""The base class and helpers of the wrappers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray


class TaskWrapper(gymnasium.Wrapper[Any, Any, Any, Any]):
    """A wrapper around an er-gym environment; it has ``action_masks`` as the environment has.

    Gymnasium's wrappers do not pass on methods that they do not know. Learners that use
    ``get_wrapper_attr`` still find the method. A plain call finds it only on this class.
    """

    def action_masks(self) -> NDArray[np.int8]:
        """(len(ACTIONS),) int8: 1 for each action that is legal now.

        Raises:
            AttributeError: the environment has no ``action_masks``, so it is not one of er-gym's.
        """
        masks: NDArray[np.int8] = self.env.get_wrapper_attr("action_masks")()
        return masks


def info_entry(info: Mapping[str, Any], key: str) -> Any:
    """An entry of ``info``.

    Raises:
        ValueError: the entry is missing, so the environment is not one of er-gym's.
    """
    if key not in info:
        raise ValueError(
            f"the environment's info has no {key!r}; wrap an er-gym environment, such as "
            "gymnasium.make('ER-SinglePickup-v0')"
        )
    return info[key]
