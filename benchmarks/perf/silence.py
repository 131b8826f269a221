"""Measures for how long the commands of er-gym say nothing in a terminal.

    python -m benchmarks.perf.silence [NAME …] [--repo DIR --python FILE]

Each command is run in a pseudo-terminal, in a scratch folder, with small inputs. Printed are the
seconds until its first word, the longest silence after that, and the whole time. What is repeated
unchanged, and control codes, count as silence. A command that needs what others make runs after
them. With --repo and --python, another checkout with its own environment is measured. Only a quiet
machine gives figures to keep: the third column's sum is ten minutes on two cores.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import click

from benchmarks.harness.chat_server import ChatServer, counts, key_actions, replies
from benchmarks.harness.output import ROOT, Output, write_figures
from benchmarks.harness.processes import TerminalRun, plain_environment, run
from er_gym.tasks.suites import load_suite

FIRST, WITHIN = 1.0, 3.0
"""Seconds: what is allowed until the first word, and between two words."""
_SHAREGPT = "data export made --to sharegpt --out sharegpt"
_INSTALL = "make -C REPO VENV=WORK/venv PYTHON=PYTHON WORK/venv/.er-gym-core"


@dataclass(frozen=True)
class Row:
    """A command to measure.

    Attributes:
        name: to choose it by.
        line: its words. Those in capitals are replaced: see :func:`_words`.
        after: names of rows whose files it needs.
        until: the words after which it is ended by Ctrl-C, for servers.
        keys: what is typed.
        code: how it is to end; servers end with 0 or 130.
    """

    name: str
    line: str
    after: tuple[str, ...] = ()
    until: str = ""
    keys: str = ""
    code: tuple[int, ...] = (0,)


_TINY_TRAINING = "--set training.epochs=2 --set training.batch=4 --set training.log_every=1"
ROWS = (
    Row("help", "--help"),
    Row("suites", "suites"),
    Row("envs", "envs"),
    Row("zoo", "zoo"),
    Row("zoo-show", "zoo show er-tiny-text"),
    Row("player", "player path"),
    Row("doctor", "doctor"),
    Row("tasks-show", "tasks show mini --limit 1"),
    Row("tasks-stats", "tasks stats er-1k"),
    Row("tasks-verify", "tasks verify mini"),
    Row("tasks-generate", "tasks generate --total 22 --scenes FloorPlan1 --out made.jsonl"),
    Row("bench", "bench --suite mini --agent oracle --out oracle"),
    Row("bench-zoo", "bench --suite mini --agent zoo:er-tiny-text --limit 2 --out zoo"),
    Row(
        "bench-hf",
        "bench --suite mini --agent hf:model --limit 1 --set sees=text --out hf",
        ("new-model",),
    ),
    Row("bench-rl", "bench --suite mini --agent rl:rl --limit 2 --out rl-bench", ("train-rl",)),
    Row("bench-server", "bench --suite mini --agent openai:m --base-url SERVER --limit 4 --out s"),
    Row("bench-ray", "bench --suite mini --agent oracle --limit 6 --executor ray --out ray"),
    Row("report", "report oracle --by-type", ("bench",)),
    Row(
        "train-rl",
        "train-rl --config single_search --set total_steps=512 --set vec.workers=2 "
        "--set vec.envs=4 --set evaluation.every=512 --set evaluation.count=4 --out rl",
    ),
    Row(
        "collect",
        "collect --suite mini --types single_search,pickup_and_put --limit 6 --no-pictures "
        "--out made",
    ),
    Row("collect-select", "collect --select oracle --limit 8 --out selected", ("bench",)),
    Row("data-stats", "data stats made", ("collect",)),
    Row("data-verify", "data verify made", ("collect",)),
    Row("data-export", _SHAREGPT, ("collect",)),
    Row(
        "data-import",
        "data import sharegpt/dataset_info.json --dataset er_gym_train --out imported",
        ("data-export",),
    ),
    Row("data-show", "data show made --trajectory FIRST", ("collect",)),
    Row("data-frames", "data frames --suite train --frames 12 --out views"),
    Row("new-model", "new-model tiny-text --data made --out model", ("collect",)),
    Row(
        "finetune",
        f"finetune --config tiny --model model --data made --out tuned {_TINY_TRAINING}",
        ("new-model",),
    ),
    Row("ladder", "ladder --config tiny-text --print"),
    Row("ablate", "ablate --config tiny-text --print"),
    Row("render", "render --scene FloorPlan1 --out room.png"),
    Row("play", "play --seed 1 --no-window", keys="observe\nquit\n"),
    Row("ui", "ui oracle --port 0 --no-browser", ("bench",), "http://.*\n", code=(0, 130)),
    Row("serve", "serve model --port 0", ("new-model",), "ready after", code=(130,)),
    Row("match-server", "match-server --port 0", (), "http://.*\n", code=(0, 130)),
    Row(
        "inspect",
        "inspect --model openai-api/local/m --model-base-url SERVER --set sees=text --limit 2",
    ),
    Row("make", _INSTALL),
)
BY_NAME = {row.name: row for row in ROWS}


def in_order(names: Sequence[str]) -> list[Row]:
    """The rows of these names, or all but ``make``, each after those that it needs."""
    found: dict[str, Row] = {}

    def add(name: str) -> None:
        for other in BY_NAME[name].after:
            add(other)
        found.setdefault(name, BY_NAME[name])

    for name in names or [name for name in BY_NAME if name != "make"]:
        add(name)
    return list(found.values())


def measure(row: Row, work: Path, python: Path, repo: Path, server: str) -> TerminalRun:
    """Run a row's command in the folder ``work``, and see what it prints when."""
    return run(
        _words(row, work, python, repo, server),
        cwd=work,
        environment=plain_environment(
            OPENAI_API_KEY="none", LOCAL_API_KEY="none", HF_HUB_OFFLINE="1"
        ),
        until=row.until,
        keys=row.keys,
        seconds=900,
    )


def _words(row: Row, work: Path, python: Path, repo: Path, server: str) -> list[str]:
    """The command: SERVER, WORK, REPO, PYTHON and FIRST (a trajectory's id) are replaced."""
    known = {"SERVER": server, "WORK": str(work), "REPO": str(repo), "PYTHON": str(python)}
    if "FIRST" in row.line:
        with (work / "made" / "trajectories.jsonl").open() as file:
            known["FIRST"] = json.loads(file.readline())["id"]
    line = row.line
    for word, value in known.items():
        line = line.replace(word, value)
    words = line.split()
    return words if words[0] == "make" else [str(python.parent / "er-gym"), *words]


@click.command()
@click.argument("names", nargs=-1, metavar="[NAME]...", type=click.Choice(tuple(BY_NAME)))
@click.option("--repo", type=click.Path(exists=True, path_type=Path), default=ROOT)
@click.option(
    "--python",
    type=click.Path(exists=True, path_type=Path),
    default=Path(sys.executable),
    help="The Python beside whose er-gym is run.  [default: this one]",
)
@click.option("--out", type=Output(), help="Also write the figures into this file, as JSON.")
def main(names: tuple[str, ...], repo: Path, python: Path, out: Path | None) -> None:
    """Measure commands, all by default, and print a table; exit code 1 if one says too little."""
    figures: dict[str, dict[str, float]] = {}
    short = 0
    print(f"{'':16} {'first word':>10} {'silence':>8} {'in all':>7}  seconds")
    say, tokens = key_actions(load_suite("mini").tasks), counts(400, 20)
    speaks = replies(say, latency=0.05, keep=True, tokens=tokens)
    with tempfile.TemporaryDirectory() as folder, ChatServer(speaks) as server:
        work = Path(folder)
        for row in in_order(names):
            done = measure(row, work, python.absolute(), repo.resolve(), server.url)
            failed = done.late or done.code not in row.code
            silence, followed = done.silence
            bad = failed or done.first > FIRST or silence > WITHIN
            short += bad and (not names or row.name in names)
            print(
                f"{row.name:16} {done.first:10.2f} {silence:8.2f} {done.seconds:7.2f}"
                f"{'  too long' if bad else ''}{f'  exit code {done.code}' if failed else ''}",
                flush=True,
            )
            figures[row.name] = {
                "first": done.first,
                "silence": silence,
                "seconds": done.seconds,
            }
            if failed:
                print(done.text()[-3000:])
            elif silence > WITHIN:
                print(f"    {silence:.2f} s after {followed[-80:]!r}")
    print(f"{short} of {len(figures)} say nothing for too long")
    write_figures(out, figures)
    sys.exit(int(short > 0))


if __name__ == "__main__":
    main()
