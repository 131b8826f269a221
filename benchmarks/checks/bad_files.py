"""Bad files, by the names that the bad command lines use. No command may crash on them."""

from __future__ import annotations

import gzip
import json
import os
import shutil
from pathlib import Path
from typing import Any

from er_gym.tasks.config_folder import config_directory
from er_gym.tasks.jsonl_format import FORMAT, write_tasks
from er_gym.tasks.paper_format import write_tasks as write_paper_tasks
from er_gym.tasks.suites import load_suite

HOSTILE = "\x1b[31mred\x1b]0;title\x07 [bold]x[/] \u202e\u009b31m"
"""Control codes of a terminal, markup of Rich, and a character that reorders a line."""

_LAUGHS = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{after}: &{after} [{', '.join([f'*{before}'] * 9)}]\n"
    for before, after in zip("abcdefghij", "bcdefghijk", strict=True)
)
_MERGES = "a: &a {x: 1}\n" + "".join(
    f"{after}: &{after} {{<<: [{', '.join([f'*{before}'] * 9)}]}}\n"
    for before, after in zip("abcdefghij", "bcdefghijk", strict=True)
)

YAML: dict[str, str | bytes] = {
    "laughs.yaml": _LAUGHS,
    "merges.yaml": _MERGES,
    "deep.yaml": "a: " + "[" * 60_000,
    "indented.yaml": "".join(" " * i + "- \n" for i in range(300)),
    "itself.yaml": "a: &a [*a]",
    "long.yaml": "a: " + "x" * 1_000_000,
    "number.yaml": f"seed: {'9' * 5000}",
    "sexagesimal.yaml": f"seed: {'59:' * 2000}59",
    "python.yaml": "a: !!python/object/apply:os.system ['touch owned']",
    "kind.yaml": "a: !!int ''",
    "date.yaml": "a: 2001-99-99",
    "nan.yaml": "sampling: {temperature: .nan}\nenv: {shaping: .nan}\ntotal_steps: 10",
    "nul.yaml": "a: \0",
    "latin.yaml": "a: é".encode("latin-1"),
    "list.yaml": "[1, 2]",
    "text.yaml": "just words",
    "two.yaml": "a: 1\n---\nb: 2",
    "keys.yaml": "1: 2",
    "hostile.yaml": f"{json.dumps(HOSTILE)}: 1",
    "surrogate.yaml": 'a: "\\ud800"',
}
"""YAML files that are neither an agent's settings nor a training run."""

_HEADER = json.dumps({"format": FORMAT, "tasks": 1}) + "\n"
JSON: dict[str, str | bytes] = {
    "empty.jsonl": "",
    "blank.jsonl": "\n" * 3_000_000,
    "deep.jsonl": _HEADER + "[" * 100_000,
    "nested.jsonl": _HEADER + "[" * 900 + "]" * 900,
    "deep.json": "[" * 100_000,
    "objects.json": '{"a":' * 900 + "1" + "}" * 900,
    "many.json": "[" + "{}," * 900_000 + "{}]",
    "values.json": "[" + "1," * 3_000_000 + "1]",
    "line.jsonl": _HEADER + f'["{"x" * 6_000_000}"]',
    "number.jsonl": _HEADER + "9" * 5000,
    "number.json": f'[{{"identity": {"9" * 4000}}}]',
    "infinite.jsonl": _HEADER + '{"id": 1e999}',
    "nan.jsonl": _HEADER + '{"id": NaN}',
    "surrogate.jsonl": _HEADER + '{"id": "\\ud800"}',
    "nul.jsonl": _HEADER + "\0\0\0",
    "latin.jsonl": _HEADER.encode() + '{"id": "é"}'.encode("latin-1"),
    "utf16.jsonl": _HEADER.encode("utf-16"),
    "foreign.jsonl": '{"messages": []}\n',
    "format.jsonl": json.dumps({"format": HOSTILE, "tasks": 1}),
    "list.jsonl": "[1, 2, 3]\n",
    "word.json": '"word"',
    "hostile.json": json.dumps([{"scene": HOSTILE, "tasktype": HOSTILE}]),
    "null.json": "null",
    "cut.json": '[{"scene": "FloorPlan1"',
}
"""Task files that cannot be used."""


def make(folder: Path) -> None:
    """Write all of them into a folder, with some valid files."""
    folder.mkdir()
    for name, content in {**YAML, **JSON}.items():
        data = content if isinstance(content, bytes) else content.encode("utf-8", "surrogatepass")
        (folder / name).write_bytes(data)
    _task_files(folder)
    with gzip.open(folder / "bomb.jsonl.gz", "wb", compresslevel=1) as file:
        for _ in range(1_000):
            file.write(bytes(1 << 20))
    whole = (folder / "bomb.jsonl.gz").read_bytes()
    (folder / "cut.jsonl.gz").write_bytes(whole[:-500])
    (folder / "words.jsonl.gz").write_bytes(b"no gzip")
    for ending in ("jsonl", "json", "yaml"):
        os.mkfifo(folder / f"pipe.{ending}")
        (folder / f"zero.{ending}").symlink_to("/dev/zero")
        (folder / f"stdin.{ending}").symlink_to("/dev/stdin")
        (folder / f"folder.{ending}").mkdir()
        (folder / f"loop.{ending}").symlink_to(f"loop.{ending}")
        with open(folder / f"huge.{ending}", "wb") as file:
            file.truncate(5 << 30)
    (folder / "notes.md").write_text("My notes.\n")
    (folder / "notes.jsonl").write_text("My notes.\n")
    (folder / "notes.png").write_text("My notes.\n")
    _runs(folder)
    _prompts(folder)
    _models(folder)


def _task_files(folder: Path) -> None:
    tasks = load_suite("mini").tasks[:2]
    write_tasks(folder / "good.jsonl", tasks)
    write_paper_tasks(folder / "good.json", tasks)
    header, *lines = (folder / "good.jsonl").read_text().splitlines()
    record = json.loads(lines[0])
    changes: dict[str, dict[str, Any]] = {
        "said": {"instruction": f"Find it. {HOSTILE}"},
        "named": {"id": HOSTILE},
        "typed": {"type": HOSTILE},
        "placed": {"scene": HOSTILE},
        "state": {"goal": [{"object_type": "Mug", "state": {"isWarm": True}}]},
        "temperature": {"goal": [{"object_type": "Mug", "state": {"temperature": "Warm"}}]},
        "difficult": {"extra": {"difficulty": dict.fromkeys(
            ("hidden_depth", "distractors", "distance", "length"), HOSTILE)}},
    }  # fmt: skip
    for name, change in changes.items():
        only = json.dumps({**json.loads(header), "tasks": 1})
        (folder / f"{name}.jsonl").write_text(f"{only}\n{json.dumps({**record, **change})}\n")


def _runs(folder: Path) -> None:
    manifest: dict[str, Any] = {
        "suite": HOSTILE, "suite_digest": "0", "suite_size": 1, "agent": f"openai:x: {HOSTILE}",
        "env": {}, "seed": 0, "er_gym": "0", "set_aside": [{"task": HOSTILE, "reason": HOSTILE}],
    }  # fmt: skip
    runs: dict[str, object] = {
        "run-hostile": json.dumps(manifest),
        "run-deep": "[" * 100_000,
        "run-nan": json.dumps({**manifest, "seed": float("nan")}),
        "run-number": '{"seed": ' + "9" * 5000 + "}",
        "run-empty": "",
        "run-foreign": '{"name": "some other program\'s"}',
        "run-latin": b'{"suite": "\xe9"}',
    }
    for name, text in runs.items():
        (folder / name / "episodes").mkdir(parents=True)
        data = text if isinstance(text, bytes) else str(text).encode()
        (folder / name / "run.json").write_bytes(data)
    (folder / "run-pipe").mkdir()
    os.mkfifo(folder / "run-pipe" / "run.json")
    (folder / "run-zero").mkdir()
    (folder / "run-zero" / "run.json").symlink_to("/dev/zero")
    odd = folder / "run-odd"
    shutil.copytree(folder / "run-hostile", odd)
    (odd / "episodes" / "zero.json").symlink_to("/dev/zero")
    (odd / "episodes" / "deep.json").write_text("[" * 100_000)
    os.mkfifo(odd / "episodes" / "pipe.json")
    (folder / "run-words" / "conversations").mkdir(parents=True)
    os.mkfifo(folder / "run-words" / "conversations" / "pipe.json")


PROMPTS = {
    "loops": "{% for a in range(99999) %}{% for b in range(99999) %}{% endfor %}{% endfor %}",
    "times": "{{ 'x' * 10 ** 10 }}",
    "power": "{{ 9 ** (9 ** 9) }}",
    "width": "{{ '%9999999999d' % 1 }}",
    "center": "{{ 'x' | center(9999999999) }}",
    "doubles": "{% set a = namespace(x='abc') %}{% for i in range(99) %}"
    "{% set a.x = a.x ~ a.x %}{% endfor %}{{ a.x }}",
    "includes": "{% include 'system.jinja' %}{% include 'system.jinja' %}",
    "macros": "{% macro m(n) %}{% if n %}{{ m(n - 1) }}{{ m(n - 1) }}{% endif %}{% endmacro %}"
    "{{ m(60) }}",
    "nested": "{% if 1 %}" * 500 + "{% endif %}" * 500,
    "long": "x" * 1_000_000,
    "insides": "{{ ''.__class__.__mro__[1].__subclasses__() }}",
    "syntax": f"{{% {HOSTILE} %}}",
    "unknown": "{{ nothing }}",
}
"""Templates that cannot be used."""


def _prompts(folder: Path) -> None:
    good = config_directory("prompts") / "default" / "en"
    for name, text in PROMPTS.items():
        shutil.copytree(good, folder / f"prompts-{name}" / "en")
        (folder / f"prompts-{name}" / "en" / "system.jinja").write_text(text)
    piped = folder / "prompts-pipe" / "en"
    shutil.copytree(good, piped)
    (piped / "first.jinja").unlink()
    os.mkfifo(piped / "first.jinja")


def _models(folder: Path) -> None:
    (folder / "models.py").write_text(
        "import sys\n"
        "def none(prompt): return None\n"
        "def number(prompt): return 7\n"
        "def ends(prompt): sys.exit(0)\n"
        f"def raises(prompt): raise KeyError({HOSTILE!r})\n"
        "word = 'no function'\n"
    )
    (folder / "ends.py").write_text("import sys; sys.exit(0)\n")
