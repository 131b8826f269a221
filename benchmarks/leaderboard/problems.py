"""What a check may find in a submission."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Problem:
    """Something that a submission may not have.

    Attributes:
        kind: of :data:`KINDS`.
        where: the episode's key; ``""`` for the whole submission.
        words: what is wrong.
    """

    kind: str
    where: str
    words: str

    def __str__(self) -> str:
        return f"{self.kind}: {f'{self.where}: ' * bool(self.where)}{self.words}"


KINDS = {
    "file": "it is no submission, or is damaged",
    "rules": "it was played by other rules than the board's",
    "suite": "its tasks are not those of the suite that it names",
    "dropped": "episodes are missing, or there are some that do not belong to it",
    "mixed": "an episode is of another run",
    "task": "an episode was played in another task than the suite has under its name",
    "verdict": "the judge says otherwise, by the record alone",
    "replay": "the engine says otherwise, when the actions are done again",
    "picture": "the engine draws other pictures",
    "talk": "a conversation does not fit the record",
    "cost": "the costs are not those of the conversations",
    "claim": "the results are not those of the records",
    "secret": "a text holds what looks like a secret",
}
"""What a check may find."""
