"""The paper's ladder: its table's rows for the three stages of Qwen2-VL-7B.

Source: *Embodied-Reasoner* (arXiv 2503.21696, version 2), the table of results and the ablation of
the stages, 809 tasks in 12 rooms; success by the number of key actions is read off its figure.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class PaperRung:
    """A model of the paper, in %.

    Attributes:
        name: the paper's.
        success, search_efficiency, completeness: means over the test tasks.
        groups: success in search, manipulate, transport and composite tasks.
        by_key_actions: success by the number of key actions; 9 stands for 9 and more.
    """

    name: str
    success: float
    search_efficiency: float
    completeness: float
    groups: tuple[float, float, float, float]
    by_key_actions: Mapping[int, float]


PAPER: Mapping[str, PaperRung] = {
    "base": PaperRung("Qwen2-VL-7B", 14.79, 11.97, 38.67, (23.33, 25.50, 2.82, 0.0), {}),
    "imitation": PaperRung("Interactor", 25.46, 24.75, 53.67, (30.97, 27.09, 29.20, 3.81), {}),
    "exploration": PaperRung("Explorer", 65.39, 46.25, 77.73, (60.00, 75.92, 72.24, 26.67), {}),
    "reflection": PaperRung(
        "Reasoner",
        80.96,
        55.07,
        86.30,
        (65.16, 93.31, 87.20, 54.29),
        {1: 71.87, 2: 87.25, 4: 90.15, 5: 90.0, 6: 84.21, 7: 64.71, 8: 66.67, 9: 49.33},
    ),
}
"""By the name of the rung: the base model, then the stage that made it."""
