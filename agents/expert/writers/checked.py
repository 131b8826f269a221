"""A writer all of whose thoughts the critic has accepted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from agents.expert.writers.base import ThoughtRequest, ThoughtWriter, WrittenThoughts
from er_gym.data.critic import check

_TRIES = 8
"""The thoughts of a turn are written at most this often; then the best try stands."""
_STRIDE = 0x9E3779B97F4A7C15
"""Sets the seeds of the tries far apart."""


class CheckedWriter:
    """Has a writer that draws its wordings write a turn's thoughts again until all pass the critic.

    Args:
        writer: draws by the request's seed; a writer that a model stands behind checks for itself.
    """

    def __init__(self, writer: ThoughtWriter) -> None:
        self._writer = writer
        self.name = writer.name

    def write(self, request: ThoughtRequest) -> WrittenThoughts:
        """Write the thoughts of a turn; ``refused`` says what was wrong with earlier tries."""
        best: WrittenThoughts | None = None
        fewest = 0
        refused: list[list[str]] = [[] for _ in request.kinds]
        for attempt in range(_TRIES):
            seed = (request.seed + attempt * _STRIDE) % 2**64
            written = self._writer.write(replace(request, seed=seed))
            faults = _faults(written, request)
            number = sum(map(len, faults))
            if best is None or number < fewest:
                best, fewest = _with_refusals(written, refused), number
            if not number:
                break
            for all_codes, codes in zip(refused, faults, strict=True):
                all_codes.extend(codes)
        assert best is not None  # there is at least one try
        return best


def _faults(written: WrittenThoughts, request: ThoughtRequest) -> list[list[str]]:
    """The codes of the critic's refusals, for each thought."""
    return [
        [one.code for one in check(thought.text, kind, request.knowledge, limit=limit)]
        for thought, kind, limit in zip(
            written.thoughts, request.kinds, request.limits, strict=True
        )
    ]


def _with_refusals(written: WrittenThoughts, refused: Sequence[Sequence[str]]) -> WrittenThoughts:
    thoughts = tuple(
        thought.model_copy(update={"refused": [*codes]})
        for thought, codes in zip(written.thoughts, refused, strict=True)
    )
    return replace(written, thoughts=thoughts)
