"""A small vision-language model's answers about frames, and the figures computed from them."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from agents.vlm.chat import Message, Picture
from agents.vlm.pictures import noise_like
from agents.vlm.settings import AgentSettings
from er_gym.data.dialects import load_dialect
from er_gym.data.frame_chat import Question, questions, words_for_frames
from er_gym.data.frames import Frame, FrameSet
from er_gym.data.scene_text import FrameWords, SceneWords
from er_gym.tables import Table
from er_gym.tasks.reading import read_bytes
from er_gym.thor.objects import TYPES
from er_gym.writing import inside

_KNOWN = frozenset(TYPES)
_DRAWS = 1_000
"""Resamples of the frames for an interval."""


@dataclass
class Answers:
    """What a model answered to the questions about a frame.

    Attributes:
        named: the types that it says are in view; ``there``: those that are.
        right: by measure, whether each answer about a single type was right.
    """

    named: frozenset[str]
    there: frozenset[str]
    right: dict[str, list[bool]] = field(default_factory=dict)


class Examiner:
    """Asks a model about frames.

    Args:
        model: a directory with a tuned model.
        frames: the frames.
        settings: the agent's, as the model was tuned for.
    """

    def __init__(self, model: str, frames: FrameSet, settings: AgentSettings) -> None:
        from agents.finetune.libraries import quiet_libraries
        from agents.vlm.clients.local import LocalClient

        self._frames, self._settings = frames, settings
        dialect = load_dialect(settings.prompts.dialect or "sight")
        self._words, self._scene = words_for_frames(dialect, settings.prompts.language)
        with quiet_libraries():
            self._client = LocalClient(model, settings)

    def answers(self, frame: Frame, blind: bool) -> Answers:
        """The answers about a frame, by the model or its blind copy."""
        picture = self._picture(frame, blind)
        draw = np.random.default_rng(zlib.crc32(frame.id.encode()))
        told = self._client.reply([Message("user", (picture,))], 0).text
        found = Answers(types_in(told), frozenset(each.type for each in frame.view))
        for asked in questions(self._words, self._scene, frame, draw):
            message = Message("user", (picture, f"\n{asked.text}"))
            said = self._client.reply([message], 0).text
            for name, right in verdicts(asked, said, self._words, self._scene).items():
                found.right.setdefault(name, []).append(right)
        return found

    def close(self) -> None:
        """Release the model."""
        self._client.close()

    def _picture(self, frame: Frame, blind: bool) -> Picture:
        record = frame.pictures[0]
        data = read_bytes(inside(self._frames.path, record.path))
        form = Path(record.path).suffix.removeprefix(".")
        picture = Picture(data, f"image/{form}", record.width, record.height)
        if not blind:
            return picture
        return noise_like(picture, self._settings.pictures, (zlib.crc32(frame.id.encode()),))


def types_in(text: str) -> frozenset[str]:
    """The object types that a text names."""
    words = text.replace("<", " ").replace(">", " ").replace(",", " ").split()
    return frozenset(words) & _KNOWN


def verdicts(asked: Question, said: str, words: FrameWords, scene: SceneWords) -> dict[str, bool]:
    """By measure, whether an answer about a type is right.

    Whether the type is in view is judged always; its side, distance, state and support only where
    it is in view and the model says so.
    """
    unseen = words.unseen.replace("{thing}", asked.kind)
    says_unseen = said.strip() == unseen
    if asked.answer == unseen:
        return {"absent": says_unseen}
    if says_unseen:
        return {"present": False}
    told, true = said.split(), asked.answer.split()
    found = {"present": asked.kind in told, "side": told[-1:] == true[-1:]}
    found["reach"] = (scene.far in told) == (scene.far in true)
    for name, pair in {"open": (scene.open, scene.closed), "on": (scene.on, scene.off)}.items():
        if state := {*pair} & {*true}:
            found[name] = state == {*pair} & {*told}
    if "(" in true:
        found["support"] = told[:2] == true[:2]
    return found


def examine(
    answers: Callable[[Frame], Answers], frames: Sequence[Frame], threads: int
) -> list[Answers]:
    """The answers about all frames, in order; many are asked for at once."""
    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(answers, frames))


# -- figures ---------------------------------------------------------------------------------------


def precision_recall_f1(answers: Iterable[Answers]) -> tuple[float, float, float]:
    """Of the types in view, over all frames together, in %."""
    every = list(answers)
    right = sum(len(each.named & each.there) for each in every)
    named = sum(len(each.named) for each in every)
    there = sum(len(each.there) for each in every)
    precision, recall = right / max(named, 1), right / max(there, 1)
    return 100 * precision, 100 * recall, 100 * 2 * right / max(named + there, 1)


def misplaced(answers: Sequence[Answers]) -> list[Answers]:
    """The answers with the labels of another frame: the one half of the list away."""
    half = len(answers) // 2
    others = [*answers[half:], *answers[:half]]
    return [replace(each, there=other.there) for each, other in zip(answers, others, strict=True)]


def f1_interval(answers: Sequence[Answers]) -> tuple[float, float]:
    """The 95 % interval of F1, by resampling frames."""
    draw = np.random.default_rng(0)
    counts = np.array(
        [(len(e.named & e.there), len(e.named) + len(e.there)) for e in answers], float
    )
    picks = draw.integers(len(counts), size=(_DRAWS, len(counts)))
    sums = counts[picks].sum(axis=1)
    low, high = np.percentile(100 * 2 * sums[:, 0] / np.maximum(sums[:, 1], 1), (2.5, 97.5))
    return float(low), float(high)


def figures(found: Mapping[str, Sequence[Answers]]) -> Table:
    """A table with a column for the model and for its blind copy."""
    rows: list[tuple[str, ...]] = []
    scores = {name: precision_recall_f1(answers) for name, answers in found.items()}
    for place, name in enumerate(("precision", "recall", "F1")):
        rows.append((f"types in view, {name}", *(f"{each[place]:.1f}" for each in scores.values())))
    guessed = {name: precision_recall_f1(misplaced(each))[2] for name, each in found.items()}
    rows.append(("F1 for another frame", *(f"{each:.1f}" for each in guessed.values())))
    spans = {name: f1_interval(answers) for name, answers in found.items()}
    rows.append(("F1, 95 %", *(f"{low:.1f} to {high:.1f}" for low, high in spans.values())))
    measures = dict.fromkeys(m for answers in found.values() for e in answers for m in e.right)
    for measure in measures:
        rows.append((f"where: {measure}", *(_share(each, measure) for each in found.values())))
    return Table(
        f"What is seen in {len(next(iter(found.values())))} frames, in %",
        ("", *found),
        tuple(rows),
        1,
        (
            "F1 for another frame: the same answers, held against what is in view elsewhere",
            "where: of questions about single types, those answered rightly: present, absent: "
            "whether it is in view; the others where it is in view and the model says so",
        ),
    )


def _share(answers: Sequence[Answers], measure: str) -> str:
    right = [each for one in answers for each in one.right.get(measure, [])]
    return f"{100 * sum(right) / len(right):.1f} of {len(right)}" if right else "-"
