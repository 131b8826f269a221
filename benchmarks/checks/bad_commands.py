"""Bad command lines of ``er-gym``, and how each should end."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from benchmarks.checks.bad_files import HOSTILE, JSON, PROMPTS, YAML

REFUSED = frozenset({2})


@dataclass(frozen=True)
class Line:
    """A command line, given in an empty folder beside ``../files``.

    Attributes:
        words: what follows ``er-gym``; ``{port}`` is a port that is taken.
        codes: the exit codes that it may have.
        holds: files of ``../files`` that the folder holds, and that must stay as they are.
        says: the text on stdin.
    """

    words: tuple[str, ...]
    codes: frozenset[int] = REFUSED
    holds: tuple[str, ...] = ()
    says: str = ""

    def __str__(self) -> str:
        return " ".join(word if len(word) < 60 else f"{word[:50]}…" for word in self.words)


ORACLE = ("bench", "--agent", "oracle")
MINI = ("bench", "--suite", "mini", "--agent", "oracle")
SPEAKS = ("bench", "--suite", "mini", "--agent", "openai:m", "--base-url", "http://127.0.0.1:9/v1")
RENDER = ("render", "--scene", "FloorPlan1")
GENERATE = ("tasks", "generate", "--out", "new.jsonl", "--scenes", "FloorPlan401", "--total", "2")
TRAIN = ("train-rl", "--config", "single_search")
SERVE = ("serve", "../files/notes.md", "--dry-run")

_WORDS = ("", "x", "-1", "1.5", "NaN", "1e3", "9" * 5000, HOSTILE, "０x", "1 2")
_WHOLE = {
    MINI: ("--workers", "--limit", "--seed", "--concurrency"),
    SPEAKS: ("--max-tokens",),
    RENDER: ("--width", "--height"),
    ("play",): ("--seed",),
    ("tasks", "show", "mini"): ("--limit",),
    ("tasks", "verify", "mini"): ("--workers",),
    ("data", "verify", "../files/run-hostile"): ("--workers", "--limit", "--tasks-file"),
    GENERATE: ("--total", "--layouts", "--per-layout", "--seed", "--workers"),
    TRAIN: ("--seed",),
    SERVE: ("--port", "--context", "--pictures", "--gpus"),
    ("match-server",): ("--port",),
}
_REAL = ("", "x", "nan", "-inf", "inf", "1e999", "-1", "--1", HOSTILE)
_REALS = {
    MINI: ("--faults",),
    SPEAKS: ("--max-usd", "--max-minutes"),
    RENDER: ("--fov",),
    SERVE: ("--patience",),
    GENERATE: ("--hidden-depth", "--distractors", "--distance"),
}
_CHOICES = {
    MINI: (
        "--protocol",
        "--faults",
        "--scorer",
        "--backend",
        "--instances",
        "--shard",
        "--task-ids",
        "--poses",
    ),
    RENDER: ("--what", "--pose", "--scene"),
    ("report", "../files/run-hostile"): ("--format", "--scorer"),
    ("play",): ("--suite", "--task", "--scene"),
    GENERATE: ("--suite", "--scenes", "--types"),
    ("tasks", "show", "mini"): ("--types",),
    SERVE: ("--engine", "--python"),
    ("inspect", "--model", "mockllm/model"): ("--suite", "--agent-config", "--set", "--limit"),
}
_TASK_FILES = (
    *JSON, "bomb.jsonl.gz", "cut.jsonl.gz", "words.jsonl.gz", "nowhere.jsonl", "pipe.jsonl",
    "zero.jsonl", "stdin.jsonl", "folder.jsonl", "loop.jsonl", "huge.jsonl", "pipe.json",
    "zero.json", "huge.json", "named.jsonl", "typed.jsonl", "placed.jsonl", "state.jsonl",
    "temperature.jsonl", "notes.md",
)  # fmt: skip
_YAML_FILES = (
    *YAML, "nowhere.yaml", "pipe.yaml", "zero.yaml", "stdin.yaml", "folder.yaml", "loop.yaml",
    "huge.yaml", "notes.md",
)  # fmt: skip
_SETTINGS = (
    "", "x", "=", "=1", "x=1", "seed", "seed=-1", "seed=[", "seed=.nan", f"seed={'9' * 5000}",
    "pictures.width=0", "pictures.width=999999999", "pictures.quality=NaN", "pictures=1",
    "seed.x=1", "sampling.temperature=.inf", "sampling.max_tokens=true", "prompts.language=xx",
    "prompts.profile=/dev/zero", "prompts.profile=nowhere", f"prompts.profile={HOSTILE}",
    'prompts.profile="a\\0b"', "prompts.dataset=/dev/zero", "prompts.dataset=../files/pipe.json",
    'prompts.dataset="a\\0b"', "server.timeout=.inf", "server.tries=0",
    f"{HOSTILE}=1", f"seed={HOSTILE}", "seed=!!python/name:os.system", "seed=&a [*a]",
    f"seed={'[' * 5000}", "prompts.dataset=../files/objects.json", "matching.fuzzy=101",
)  # fmt: skip
_TRAINED = (
    "total_steps=0", "total_steps=.inf", "env.width=99999999", "env.frames=99999999",
    "vec.envs=999999999", "vec.workers=100000", "seed=99999999999999", "env.types=[x]",
    "network.width=999999999", "algorithm.learning_rate=.nan", f"env.episodes={HOSTILE}",
    "env.episodes=/dev/zero", "env.episodes=../files/pipe.jsonl", "threads=99999999",
    "evaluation.episodes=../files/bomb.jsonl.gz",
)  # fmt: skip
_AGENTS = (
    "", "nobody", "openai", "openai:", "hf:", "rl:", "recorded:", "rl:nowhere", "rl:/dev/zero",
    "rl:../files/pipe.json", "recorded:nowhere", "recorded:../files/run-words",
    "recorded:../files/pipe.json", "recorded:../files/deep.json", "recorded:../files/zero.json",
    "hf:/nowhere", HOSTILE, f"rl:{HOSTILE}", f"recorded:{HOSTILE}", "[/]", "[red]", "x" * 5000,
    "openai:m\udc80", "recorded:\ud800",
)  # fmt: skip


def lines() -> Iterator[Line]:
    """All of them."""
    words: tuple[str, ...]
    for words in (
        ("nonsense",), ("--nonsense",), (HOSTILE,), (f"--{HOSTILE}",), ("",), ("bench",),
        ("bench", "--suite", "mini"), ("render",), ("report",), ("serve",), ("train-rl",),
        ("tasks", "nonsense"), ("player", HOSTILE), ("player", "install", "--python", "/nowhere"),
        ("player", "install", "--python", HOSTILE), ("inspect",), ("envs", "x"), ("suites", "x"),
        ("doctor", HOSTILE), ("play", "x"), ("tasks", "show"), ("tasks", "convert", "mini"),
        ("data", "stats", HOSTILE), ("data", "verify", "../files"), ("data", "show", "../files"),
        ("data", "show", "../files/run-hostile", "--trajectory", HOSTILE),
    ):  # fmt: skip
        yield Line(words)
    for options, values in ((_WHOLE, _WORDS), (_REALS, _REAL), (_CHOICES, ("", HOSTILE, "[/]"))):
        for words, names in options.items():
            for name in names:
                for value in values:
                    if not _is_fine(name, value):
                        yield Line((*words, f"{name}={value}"))
    yield from _of_files()
    yield from _of_runs()
    for setting in _SETTINGS:
        yield Line((*SPEAKS, "--set", setting))
    for setting in (*_SETTINGS[:10], *_TRAINED):
        yield Line((*TRAIN, "--set", setting))
    for agent in _AGENTS:
        yield Line(("bench", "--suite", "mini", "--agent", agent))
    for name in (*PROMPTS, "pipe"):
        yield Line((*SPEAKS, "--set", f"prompts.profile=../files/prompts-{name}"))
    yield from _contradictions()
    yield from _drawn()
    yield from _made()


def _is_fine(name: str, value: str) -> bool:
    """Values that are valid, or that lead to the network or a server."""
    return (name, value) in {
        ("--task-ids", ""),
        ("--types", ""),
        ("--max-minutes", ""),
        ("--suite", ""),
    } or (value == "" and name in ("--scenes", "--poses", "--python", "--task", "--agent-config"))


def _of_files() -> Iterator[Line]:
    for name in _TASK_FILES:
        file = f"../files/{name}"
        yield Line((*ORACLE, "--tasks-file", file))
        yield Line(("tasks", "show", file))
        yield Line(("tasks", "stats", file))
        yield Line(("tasks", "convert", file, "new.jsonl"))
    for name in ("bomb.jsonl.gz", "pipe.jsonl", "state.jsonl", "deep.jsonl", "values.json"):
        yield Line(("tasks", "verify", f"../files/{name}", "--workers", "1"))
    for name in ("deep.json", "pipe.json", "zero.json", "huge.json", "null.json", "folder.json"):
        given = ("--tasks-file", "../files/good.json", "--poses", f"../files/{name}")
        yield Line((*ORACLE, *given))
        yield Line((*SPEAKS, "--prompts-from", f"../files/{name}"))
    for name in _YAML_FILES:
        file = f"../files/{name}"
        yield Line((*SPEAKS, "--agent-config", file))
        yield Line(("train-rl", "--config", file))
        yield Line(("match-server", "--agent-config", file, "--port", "{port}"))
    for name in ("said.jsonl", "difficult.jsonl"):
        yield Line(("tasks", "show", f"../files/{name}"), frozenset({0}))
        yield Line(("tasks", "stats", f"../files/{name}"), frozenset({0}))


def _of_runs() -> Iterator[Line]:
    for name in (
        "nowhere", "good.json", "run-deep", "run-nan", "run-number", "run-empty", "run-foreign",
        "run-latin", "run-pipe", "run-zero", HOSTILE, "run-words",
    ):  # fmt: skip
        yield Line(("report", f"../files/{name}"))
    for layout in ("table", "md", "csv", "json"):
        yield Line(("report", "../files/run-hostile", "--format", layout), frozenset({0}))
        yield Line(("report", "../files/run-odd", "--format", layout), frozenset({0}))
    yield Line(("report", "../files/run-hostile", "--misses", "--format", "csv"))
    for name in ("run-odd", "run-deep", "run-pipe", "run-zero", "good.json", "pipe.json"):
        yield Line((*MINI, "--limit", "1", "--out", f"../files/{name}"))


def _contradictions() -> Iterator[Line]:
    good = "../files/good.jsonl"
    for words in (
        (*MINI, "--tasks-file", good),
        (*MINI, "--poses", "../files/good.json"),
        (*MINI, "--set", "seed=1"),
        (*MINI, "--max-usd", "1"),
        (*MINI, "--base-url", "http://127.0.0.1"),
        (*MINI, "--prompts-from", "../files/good.json"),
        (*MINI, "--agent-config", "text"),
        (*MINI, "--protocol", "paper", "--instances", "explore"),
        (*MINI, "--shard", "0/0"), (*MINI, "--shard", "3/2"), (*MINI, "--shard", HOSTILE),
        (*MINI, "--shard", "1/"),
        (*MINI, "--shard", f"1/{'9' * 5000}"), (*MINI, "--task-ids", "nobody,nothing"),
        (*MINI, "--workers", "100000"), (*MINI, "--out", "/dev/null/x"),
        (*MINI, "--out", "/proc/x"), (*MINI, "--out", ""),
        (*ORACLE,), (*SPEAKS, "--max-usd", "1"), (*SPEAKS, "--max-usd", "0"),
        (*SPEAKS, "--max-tokens", "0"), (*SPEAKS, "--base-url", "nonsense"),
        (*SPEAKS, "--base-url", "ftp://x"), (*SPEAKS, "--base-url", HOSTILE),
        (*SPEAKS, "--base-url", "file:///etc/passwd"), (*SPEAKS, "--base-url", "http://"),
        (*SPEAKS, "--base-url", "http://[::1"), (*SPEAKS, "--base-url", "http://x:99999/v1"),
        (*SPEAKS[:5], "--limit", "1"), (*SPEAKS, "--concurrency", "99999999"),
        ("match-server", "--port", "{port}"), (*SERVE, "--port", "{port}"),
        ("serve", "nothing.gguf"), ("serve", "/nowhere"), ("serve", HOSTILE, "--gpus", "x"),
        ("serve", "../files/notes.md", "--engine", "vllm", "--python", "/bin/false"),
        ("play", "--frames", "/dev/null/x"), ("play", "--frames", "/proc/x"),
        ("play", "--frames", "../files/notes.md"), ("play", "--suite", HOSTILE),
        ("play", "--task", HOSTILE), ("play", "--scene", "FloorPlan999"),
        ("tasks", "show", "mini", HOSTILE), ("tasks", "show", HOSTILE),
        ("tasks", "verify", HOSTILE), ("tasks", "stats", "mini", "--out", "/dev/null/x"),
        ("tasks", "stats", HOSTILE), ("tasks", "convert", HOSTILE, "new.jsonl"),
        ("tasks", "convert", good, "new.txt"), ("tasks", "convert", good, "/dev/full/new.jsonl"),
        ("tasks", "convert", good, "nowhere/new.jsonl"), ("train-rl", "--config", "/proc/kmsg"),
        ("tasks", "convert", "../files", "new.jsonl"), ("tasks", "convert", good, ""),
        ("tasks", "stats", good, "--out", ""), ("play", "--frames", ""), (*TRAIN, "--out", ""),
        ("tasks", "convert", good, f"{HOSTILE}/new.jsonl"),
        ("tasks", "convert", good, "new.jsonl", "--task-ids", "nobody"),
        ("tasks", "convert", good, "new.jsonl", "--task-ids", HOSTILE),
        ("prompts", "copy", ""), ("prompts", "copy", "/dev/null"), ("prompts", "copy", "/proc/x"),
        ("prompts", "copy", "../files/good.json"), ("prompts", "copy"), ("prompts", "x"),
        *(("prompts", "copy", "new", "--from", name) for name in ("", "..", HOSTILE, "heard")),
        ("tasks", "show", "mini", "\udc80"), ("report", "\udc80"), (*MINI, "--task-ids", "\udc80"),
        (*SPEAKS, "--set", "seed=\udc80"), (*SPEAKS, "--base-url", "http://\udc80"),
        ("inspect", "--model", "nobody/x"), ("inspect", "--model", HOSTILE),
        ("inspect", "--model", "mockllm/model", "--model-base-url", "http://[::1"),
        (*TRAIN, "--out", "/dev/null/x"), (*TRAIN, "--out", "../files/notes.md"),
        ("train-rl", "--config", HOSTILE), ("train-rl", "--config", "single_search", "--set"),
    ):  # fmt: skip
        yield Line(words)
    for name in ("notes.jsonl", "notes.png"):
        yield Line(("tasks", "convert", good, name), holds=(name,))
    yield Line(("render", "--scene", "FloorPlan401", "--out", "notes.png"), holds=("notes.png",))
    yield Line((*GENERATE, "--out", "notes.jsonl"), holds=("notes.md", "notes.jsonl"))
    yield Line((*GENERATE, "--out", "notes.jsonl.gz"), holds=("notes.md",))


def _drawn() -> Iterator[Line]:
    for pose in (
        "1,1", "1,1,1,1,1", "nan,0,0", "0,inf,0", "1e999,0,0", "x,y,z", ",,,", "99,99,0",
        "1,1,0,9999", f"1,1,{'9' * 5000}", HOSTILE,
    ):  # fmt: skip
        yield Line((*RENDER, "--pose", pose))
    for out in (
        "new", "new.gif", "new.png.", "nowhere/new.png", "/dev/full", "/dev/null/new.png",
        "/proc/new.png", HOSTILE, ".", "../files/notes.md", f"{'x' * 300}.png", "new.svg",
    ):  # fmt: skip
        yield Line((*RENDER, "--out", out))
    yield Line((*RENDER, "--what", "depth", "--out", "new.jpg"))
    for size in ("0", "63", "100000", "2147483648", "9" * 400):
        yield Line((*RENDER, "--width", size))
        yield Line((*RENDER, "--height", size))


def _made() -> Iterator[Line]:
    for out in ("new.txt", "", "/dev/null/new.jsonl", "/proc/new.jsonl", f"{'x' * 300}.jsonl"):
        yield Line((*GENERATE, "--out", out))
    for words in (
        ("--scenes", "FloorPlan0"), ("--scenes", ","), ("--types", "nothing"),
        ("--distance", "5-2"), ("--distance", "nan"), ("--distance", "1-inf"),
        ("--hidden-depth", "-1"), ("--layouts", "99999999"), ("--suite", "nothing"),
        ("--workers", "99999"), ("--paraphraser", "x"), ("--paraphraser", "models:"),
        ("--paraphraser", ":none"), ("--paraphraser", "nowhere:none"),
        ("--paraphraser", "models:nothing"), ("--paraphraser", "models:word"),
        ("--paraphraser", "ends:ask"), ("--paraphraser", HOSTILE), ("--paraphraser", "../x:y"),
    ):  # fmt: skip
        yield Line((*GENERATE, *words))
    yield Line(("tasks", "generate"))
    yield Line(("tasks", "generate", "--suite", "mini"))
