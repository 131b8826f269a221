"""Measures er-gym ui over a large run: the time of its pages, and the server's memory.

    python -m benchmarks.perf.monitor [--episodes 10000 --pictures 10]

The run is made of real episodes of ``mini``, copied under other names, each with a conversation and
pictures. Pages are asked for one after the other, as a browser on this machine does.
"""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
import time
import urllib.parse
import urllib.request
from io import BytesIO
from pathlib import Path
from statistics import median
from typing import Any

import click
from PIL import Image

from benchmarks.harness.measuring import timed
from benchmarks.harness.processes import ER_GYM
from benchmarks.monitor.directories import Directories
from er_gym.rollout.records import EpisodeRecord
from er_gym.rollout.run_directory import CONVERSATIONS, PICTURES, Manifest, RunDirectory
from er_gym.writing import file_stem

_TIMES = 15
"""Every page is asked for so often, at different places; the median and the worst are told."""
_MOST_LINKS = 20_000
"""A file system allows only so many names for one file."""


@click.command()
@click.option("--episodes", type=click.IntRange(1), default=10_000, show_default=True)
@click.option("--pictures", type=click.IntRange(0), default=10, show_default=True)
def main(episodes: int, pictures: int) -> None:
    """Make the run, start the server, ask for pages."""
    with tempfile.TemporaryDirectory() as folder:
        run = Path(folder) / "run"
        keys = make_run(run, episodes, pictures)
        click.echo(f"{episodes:,} episodes, {episodes * pictures:,} pictures")
        measure(run, keys, pictures)


def make_run(run: Path, episodes: int, pictures: int) -> list[str]:
    """Write a large run directory; returns the names of its episodes."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "mini"
        command = [*ER_GYM, "bench", "--suite", "mini", "--agent", "random", "--out", str(source)]
        subprocess.run(command, check=True, capture_output=True)
        played = RunDirectory.open(source)
        records = list(played.episodes())
        lines = (source / "events.jsonl").read_bytes().splitlines(keepends=True)
        manifest = Manifest.model_validate(
            played.manifest.model_dump() | {"suite_size": episodes, "agent": "openai:synthetic"}
        )
    target = RunDirectory.create(run, manifest)
    events: dict[str, list[bytes]] = {}
    for line in lines:
        events.setdefault(json.loads(line).get("task_id", ""), []).append(line)
    for name in (CONVERSATIONS, PICTURES):
        (run / name).mkdir(exist_ok=True)
    frame = _frame()
    links: list[Path] = []
    keys = []
    with (run / "events.jsonl").open("wb") as stream:
        begun = json.loads(events[""][0]) | {"tasks": episodes, "done": 0}
        stream.write(json.dumps(begun, separators=(",", ":")).encode() + b"\n")
        for number in range(episodes):
            record = records[number % len(records)]
            key = f"{record.task_id}-{number}"
            target.write(record.model_copy(update={"task_id": key}))
            old, new = (f'"task_id":"{each}"'.encode() for each in (record.task_id, key))
            stream.writelines(line.replace(old, new) for line in events[record.task_id])
            shown = []
            for index in range(pictures):
                path = run / PICTURES / f"{number}-{index}.jpg"
                if (number * pictures + index) % _MOST_LINKS == 0:
                    links.append(path)
                    path.write_bytes(frame)
                else:
                    os.link(links[-1], path)
                shown.append(f"{PICTURES}/{path.name}")
            conversation = json.dumps(_conversation(record, key, shown))
            (run / CONVERSATIONS / f"{file_stem(key)}.json").write_text(conversation)
            keys.append(key)
    return keys


def _frame() -> bytes:
    """A picture, as JPEG."""
    data = BytesIO()
    Image.effect_noise((448, 252), 60).convert("RGB").save(data, "JPEG")
    return data.getvalue()


def _conversation(record: EpisodeRecord, key: str, pictures: list[str]) -> dict[str, Any]:
    messages: list[dict[str, Any]] = []
    rounds = []
    for number, step in enumerate(record.steps[1:]):
        path = pictures[number % len(pictures)] if pictures else ""
        picture = {"path": path, "digest": "", "width": 448, "height": 252}
        messages += [
            {"role": "user", "parts": [step.feedback, *([picture] if path else [])]},
            {"role": "assistant", "parts": [f"<Planning>{'word ' * 60}</Planning>{step.text}"]},
        ]
        thoughts = [{"kind": "Planning", "text": "word " * 60}]
        rounds.append({"message": len(messages) - 1, "thoughts": thoughts, "seconds": 0.5})
    return {
        "task_id": key,
        "scene": record.scene,
        "instruction": record.instruction,
        "agent": "openai:synthetic",
        "settings": {},
        "prompts": "plain",
        "prompts_digest": "",
        "messages": messages,
        "rounds": rounds,
        "prompt_tokens": 1000,
        "completion_tokens": 100,
        "cost": 0.0,
    }


def measure(run: Path, keys: list[str], pictures: int) -> None:
    """Start a server over a run, and tell how long its pages take."""
    begin = time.perf_counter()
    server = subprocess.Popen(
        [*ER_GYM, "ui", str(run.parent), "--no-browser", "--port=0"],
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert server.stdout is not None
        address = server.stdout.readline().strip()
        _tell("the server starts", [time.perf_counter() - begin])
        (directory,) = Directories([run.parent]).all()
        here = f"{address}runs/{directory.id}"
        some = [urllib.parse.quote(keys[k * len(keys) // _TIMES]) for k in range(_TIMES)]
        _tell("the first page", [_seconds(address)])
        _tell("the first page again", [_seconds(address) for _ in some])
        _tell("the run", [_seconds(here) for _ in some])
        _tell(
            "the run, filtered and sorted", [_seconds(f"{here}?steps=5-&sort=-steps") for _ in some]
        )
        _tell("an episode", [_seconds(f"{here}/episode?key={key}") for key in some])
        if pictures:
            _tell("a picture", [_seconds(f"{here}/picture?key={key}&n=0") for key in some])
        status = Path(f"/proc/{server.pid}/status").read_text()
        resident = next(line for line in status.splitlines() if line.startswith("VmHWM"))
        click.echo(
            f"{'memory of the server, at most':<32}{int(resident.split()[1]) / 1024:8.0f} MB"
        )
    finally:
        server.terminate()
        server.wait(30)


def _seconds(address: str) -> float:
    def ask() -> None:
        with urllib.request.urlopen(address) as answer:
            answer.read()

    return timed(ask).clock


def _tell(what: str, seconds: list[float]) -> None:
    worst = f", at most {1000 * max(seconds):.0f}" if len(seconds) > 1 else ""
    click.echo(f"{what:<32}{1000 * median(seconds):8.0f} ms{worst}")


if __name__ == "__main__":
    main()
