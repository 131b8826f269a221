"""How many lies of others the critic refuses, and how many honest thoughts.

    python -m benchmarks.checks.critic_recall tests/data/others/dev.json

Each FILE is a list of thoughts about real scenes (``benchmarks.harness.judged_thoughts`` states the
format). It prints recall by sort of lie and language, the share of sentences of which no claim was
judged, and the CPU time a thought. The exit code is 1 if fewer lies are refused than ``--least`` or
more honest thoughts than ``--most`` allow. ``--verdicts`` writes what each thought is refused for,
which tests compare: after a change that is meant,

    python -m benchmarks.checks.critic_recall tests/data/others/*.json \\
        --verdicts tests/data/verdicts.json
"""

from __future__ import annotations

import json
import sys
import time
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import click

from benchmarks.harness.judged_thoughts import HONEST, LIMIT, Judged, judge, load
from er_gym.data.critic import check, review
from er_gym.writing.atomic import write_atomic

_LANGUAGES = ("en", "zh")
_ROUNDS = 5


def share(those: Sequence[Judged]) -> float:
    """The share of some thoughts that are refused; 0.0 of none."""
    return sum(bool(each.refusals) for each in those) / len(those) if those else 0.0


def _rows(judged: Iterable[Judged]) -> Iterator[str]:
    sorts: defaultdict[str, list[Judged]] = defaultdict(list)
    for each in judged:
        sorts[each.written.sort].append(each)
        sorts["all lies"] += [each] * (each.written.sort != HONEST)
    last = ("all lies", HONEST)
    yield f"{'refused':<32}{'en':>12}{'zh':>12}{'both':>14}"
    for sort in (*sorted(sorts.keys() - {*last}), *last):
        cells = []
        for languages in (*((each,) for each in _LANGUAGES), _LANGUAGES):
            those = [each for each in sorts[sort] if each.written.language in languages]
            refused = sum(bool(each.refusals) for each in those)
            cells.append(f"{refused}/{len(those)}")
        whole = f"{cells[2]} {share(sorts[sort]):4.0%}"
        yield f"{sort:<32}{cells[0]:>12}{cells[1]:>12}{whole:>14}"


def _unknown(judged: Sequence[Judged]) -> float:
    """The share of sentences of which the critic judged nothing."""
    found = [review(each.written.text, "reasoning", each.known, limit=LIMIT) for each in judged]
    unknown = sum(each.unknown for each in found)
    return unknown / max(1, unknown + sum(each.true + each.false for each in found))


def _microseconds(judged: Sequence[Judged]) -> float:
    """CPU time a thought, in microseconds."""
    began = time.process_time()
    for _ in range(_ROUNDS):
        for each in judged:
            check(each.written.text, "reasoning", each.known, limit=LIMIT)
    return 1e6 * (time.process_time() - began) / (_ROUNDS * max(1, len(judged)))


@click.command(help=f"\b\n{__doc__}")
@click.argument(
    "files", nargs=-1, required=True, type=click.Path(exists=True, dir_okay=False, path_type=Path)
)
@click.option("--least", default=0.6, show_default=True, help="Share of lies to be refused.")
@click.option("--most", default=0.02, show_default=True, help="Share of honest ones that may be.")
@click.option(
    "--verdicts", type=click.Path(dir_okay=False, path_type=Path), help="Where to write them."
)
@click.option("--wrong", is_flag=True, help="Print each thought that is judged wrongly.")
def main(
    files: Sequence[Path], least: float, most: float, verdicts: Path | None, wrong: bool
) -> None:
    by_file = {path.stem: list(judge(load(path))) for path in files}
    judged = [each for those in by_file.values() for each in those]
    if verdicts:
        codes = {name: [each.verdict for each in those] for name, those in by_file.items()}
        rows = (f" {json.dumps(name)}: {json.dumps(those)}" for name, those in codes.items())
        write_atomic(verdicts, "{\n" + ",\n".join(rows) + "\n}\n")
    if wrong:
        for each in judged:
            if not each.right:
                one = each.written
                why = "; ".join(f"{refusal.code}: {refusal.detail}" for refusal in each.refusals)
                click.echo(f"{one.scene} {one.sort}: {one.text} {why}")
    click.echo("\n".join(_rows(judged)))
    click.echo(f"sentences of which no claim was judged: {_unknown(judged):.0%}")
    click.echo(f"CPU microseconds a thought: {_microseconds(judged):.0f}")
    lies = share([each for each in judged if each.written.sort != HONEST])
    honest = share([each for each in judged if each.written.sort == HONEST])
    sys.exit(int(lies < least or honest > most))


if __name__ == "__main__":
    main()
