"""The critic on thoughts that others wrote about real scenes, before they saw its rules."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import pytest

from benchmarks.harness.judged_thoughts import HONEST, Judged, judge, load

LEAST_REFUSED = {
    "dev": 0.89,
    "held_out": 0.75,
    "dev_b": 0.68,
    "held_out_b": 0.60,
    "dev_c": 0.70,
    "held_out_c": 0.63,
    "held_out_d": 0.62,
    "dev_e": 0.60,
    "dev_f": 0.0,
    "held_out_f": 0.63,
    "held_out_g": 0.60,
}
"""The least share of lies that is refused: three or four points less than when it was measured. The
rules were mended on all of these files but ``held_out_d``, ``held_out_g`` and a third of
``held_out_b``."""
MOST_REFUSED = {
    "dev": 4,
    "held_out": 4,
    "dev_b": 4,
    "held_out_b": 4,
    "dev_c": 6,
    "held_out_c": 4,
    "held_out_d": 9,
    "dev_e": 4,
    "dev_f": 8,
    "held_out_f": 5,
    "held_out_g": 7,
}
"""The most honest thoughts that are refused: 2 %, and of ``held_out_d`` and ``held_out_g`` what was
measured."""
LIES = {"dev_c": 300, "held_out_c": 400, "dev_e": 400, "dev_f": 0, "held_out_f": 400, "held_out_g": 400}
"""How many lies a file has, if they are not 200."""
HONEST_ONES = {**LIES, "held_out_d": 400, "dev_f": 480}
"""How many honest thoughts a file has, if they are not 200."""


VERDICTS = json.loads((Path(__file__).parent / "verdicts.json").read_text())
"""What each thought is refused for, written by ``benchmarks.checks.critic_recall --verdicts``."""


@pytest.fixture(scope="module", params=[*LEAST_REFUSED])
def judged(request: pytest.FixtureRequest) -> tuple[str, list[Judged]]:
    file = Path(__file__).parent / "others" / f"{request.param}.json"
    return request.param, list(judge(load(file)))


def test_lies_of_others_are_refused(judged: tuple[str, list[Judged]]) -> None:
    name, every = judged
    lies = [each for each in every if each.written.sort != HONEST]
    missed = [each.written for each in lies if not each.right]
    assert len(lies) == LIES.get(name, 200)
    assert len(missed) <= (1 - LEAST_REFUSED[name]) * len(lies), Counter(m.sort for m in missed)


def test_honest_thoughts_of_others_stand(judged: tuple[str, list[Judged]]) -> None:
    name, every = judged
    honest = [each for each in every if each.written.sort == HONEST]
    wrong = [(each.written.text, each.refusals) for each in honest if not each.right]
    assert len(honest) == HONEST_ONES.get(name, 200)
    assert len(wrong) <= MOST_REFUSED[name], wrong


def test_no_verdict_changes_unnoticed(judged: tuple[str, list[Judged]]) -> None:
    name, every = judged
    changed = [
        (each.written.text, was, each.verdict)
        for each, was in zip(every, VERDICTS[name], strict=True)
        if each.verdict != was
    ]
    assert not changed, "if it is meant, write them anew: see benchmarks.checks.critic_recall"
