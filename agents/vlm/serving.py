"""Chooses an existing inference server for a model and its command line for model agents.

Nothing here starts a server: :func:`command_for` makes a command line from the model, the options
and the machine.

Sources: ``vllm serve`` of vLLM 0.33, ``transformers serve`` of transformers 5.23, and
``llama_cpp.server`` of llama-cpp-python 0.3.36.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from agents.vlm.settings import Pictures
from er_gym.plugins import NOT_FROM_HERE

HOST = "127.0.0.1"
"""The only address that a server listens on, since none of the servers authenticates clients."""

_ONE_AT_A_TIME = ("--concurrency", "1")
"""For servers that generate one reply at a time: conversations that wait for each other would time
out."""
_EYES = "--clip_model_path"
"""The argument of llama.cpp's server that loads a model's vision encoder."""
_SECONDS = 30
"""The time limit of a program that inspects the machine."""


@dataclass(frozen=True)
class ServeOptions:
    """How a model is to be served.

    Attributes:
        port: on :data:`HOST`.
        engine: one of :data:`ENGINES`; "" to choose by model and machine.
        name: the model's name in requests; "" for the engine's own choice.
        pictures: the most pictures in a conversation.
        pixels: the least and the most pixels to which the model scales a picture.
        agent_config: a file of settings with which agents play the model; "" for none.
        context: the most tokens in a conversation; None for the engine's default here.
        gpus: the number of GPUs that share the model; None for all NVIDIA GPUs.
        more: further arguments of the server.
    """

    port: int
    engine: str = ""
    name: str = ""
    pictures: int = 40
    pixels: tuple[int, int] = Pictures().model_bounds
    agent_config: str = ""
    context: int | None = None
    gpus: int | None = None
    more: tuple[str, ...] = ()


@dataclass(frozen=True)
class Machine:
    """The machine that serves.

    Attributes:
        python: the path of the interpreter that runs the server.
        packages: the installed packages among those that engines need.
        gpus: the number of usable NVIDIA GPUs.
    """

    python: str
    packages: frozenset[str]
    gpus: int


@dataclass(frozen=True)
class Command:
    """A server's command.

    Attributes:
        engine: one of :data:`ENGINES`.
        argv: the command.
        environment: additional environment variables.
        name: the model's name in requests.
        base_url: the address of the OpenAI-compatible interface.
        ready_url: answers with 200 once the model is loaded.
        bench_options: options of ``er-gym bench`` that this server needs.
    """

    engine: str
    argv: tuple[str, ...]
    environment: Mapping[str, str]
    name: str
    base_url: str
    ready_url: str
    bench_options: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Engine:
    """A kind of server.

    Attributes:
        start: the beginning of its command, after the interpreter.
        arguments: the arguments, given the model, the options and the number of GPUs.
        name: the default name of a model in requests.
        ready: the path that answers once the model is loaded.
        needs: the packages that it needs, by import name.
        install: what ``pip install`` is given for them.
        cannot: the options that it does not support.
        bench: the options of ``er-gym bench`` that it needs, given the options.
        environment: environment variables, given the port.
    """

    start: tuple[str, ...]
    arguments: Callable[[str, ServeOptions, int], list[str]]
    name: Callable[[str], str]
    ready: str
    needs: frozenset[str]
    install: str
    cannot: tuple[str, ...] = ()
    bench: Callable[[ServeOptions], tuple[str, ...]] = lambda options: _ONE_AT_A_TIME
    environment: Callable[[int], dict[str, str]] = field(default=lambda port: {})


def _vllm(model: str, options: ServeOptions, gpus: int) -> list[str]:
    pixels = dict(zip(("min_pixels", "max_pixels"), options.pixels, strict=True))
    return [
        model,
        *("--host", HOST, "--port", str(options.port)),
        *("--served-model-name", options.name or model),
        *("--max-model-len", str(options.context or 32_768)),
        *("--tensor-parallel-size", str(max(gpus, 1))),
        # Each request repeats the previous one and adds a little.
        "--enable-prefix-caching",
        # Text-only models ignore both. No video: memory would be reserved for the longest one.
        *("--limit-mm-per-prompt", json.dumps({"image": options.pictures, "video": 0})),
        *("--mm-processor-kwargs", json.dumps(pixels)),
    ]


def _transformers(model: str, options: ServeOptions, gpus: int) -> list[str]:
    return [model, "--host", HOST, "--port", str(options.port)]


def _llama_cpp(model: str, options: ServeOptions, gpus: int) -> list[str]:
    return [
        *("--model", model, "--model_alias", options.name or Path(model).stem),
        *("--host", HOST, "--port", str(options.port)),
        *("--n_ctx", str(options.context or 8_192)),
        *("--n_gpu_layers", "-1" if gpus else "0"),
        # Otherwise it stores the logits of every token of the context.
        *("--logits_all", "false"),
    ]


def _bench_of_llama_cpp(options: ServeOptions) -> tuple[str, ...]:
    blind = () if _EYES in options.more else ("--agent-config", "text")
    return (*_ONE_AT_A_TIME, *blind)


ENGINES: dict[str, _Engine] = {
    "vllm": _Engine(
        ("-m", "vllm.entrypoints.cli.main", "serve"),
        _vllm,
        name=str,
        ready="/health",
        needs=frozenset({"vllm"}),
        install="vllm",
        bench=lambda options: (),
    ),
    "transformers": _Engine(
        ("-m", "transformers.cli.transformers", "serve"),
        _transformers,
        name=str,
        ready="/health",
        needs=frozenset({"transformers", "fastapi", "uvicorn", "openai", "torch"}),
        install="'transformers[serving]>=5.13' torchvision",
        cannot=("name", "context"),
        # Otherwise it checks online for a newer version of itself.
        environment=lambda port: {"HF_HUB_DISABLE_UPDATE_CHECK": "1"},
    ),
    "llama_cpp": _Engine(
        ("-m", "llama_cpp.server"),
        _llama_cpp,
        name=lambda model: Path(model).stem,
        ready="/v1/models",
        needs=frozenset({"llama_cpp", "fastapi", "uvicorn", "sse_starlette", "starlette_context"}),
        install="'llama-cpp-python[server]'",
        bench=_bench_of_llama_cpp,
        # These override its arguments, and a shell may have set them for another purpose.
        environment=lambda port: {"HOST": HOST, "PORT": str(port)},
    ),
}
"""The supported servers, by name."""


def command_for(model: str, options: ServeOptions, machine: Machine) -> Command:
    """The command that serves a model.

    llama.cpp serves a ``.gguf`` file. vLLM serves any other model if vLLM and a GPU are available;
    otherwise transformers does.

    Args:
        model: a directory, a ``.gguf`` file, or a name on a model hub.
        options: how to serve it.
        machine: the machine that serves.

    Raises:
        ValueError: no installed server can serve the model, or not with these options.
    """
    gpus = machine.gpus if options.gpus is None else options.gpus
    name = options.engine or _fitting(model, machine.packages, gpus)
    if name not in ENGINES:
        raise ValueError(f"unknown engine {name!r}; choose one of: {', '.join(ENGINES)}")
    engine = ENGINES[name]
    lacking = engine.needs - machine.packages
    if lacking:
        raise ValueError(
            f"{name} should serve {model}, but {machine.python} lacks "
            f"{', '.join(sorted(lacking))}: {machine.python} -m pip install {engine.install}, or "
            "name another Python that has it"
        )
    for setting in engine.cannot:
        if getattr(options, setting):
            raise ValueError(
                f"{name} has no setting for the {setting} {getattr(options, setting)!r}; leave it "
                "out, or choose another engine"
            )
    origin = f"http://{HOST}:{options.port}"
    return Command(
        engine=name,
        argv=(
            machine.python,
            *engine.start,
            *engine.arguments(model, options, gpus),
            *options.more,
        ),
        environment=engine.environment(options.port),
        name=options.name or engine.name(model),
        base_url=f"{origin}/v1",
        ready_url=f"{origin}{engine.ready}",
        bench_options=(
            *(("--agent-config", options.agent_config) if options.agent_config else ()),
            *engine.bench(options),
        ),
    )


def _fitting(model: str, packages: frozenset[str], gpus: int) -> str:
    if model.lower().endswith(".gguf"):
        return "llama_cpp"
    return "vllm" if gpus and "vllm" in packages else "transformers"


def inspect_machine(python: str, environment: Mapping[str, str] = os.environ) -> Machine:
    """Find the packages and GPUs of this machine.

    Args:
        python: the path of an interpreter. A server often has its own virtual environment.
        environment: the environment variables.

    Raises:
        ValueError: the interpreter does not run.
    """
    asked = sorted(set().union(*(engine.needs for engine in ENGINES.values())))
    question = f"import importlib.util as u; print(*filter(u.find_spec, {asked!r}))"
    try:
        has = _said([python, "-c", NOT_FROM_HERE + question])
    except (OSError, subprocess.SubprocessError) as error:
        raise ValueError(
            f"{python} does not run as a Python ({error}); give the path of one, such as "
            "venv/bin/python"
        ) from error
    return Machine(python, frozenset(has.split()), _gpus(environment))


def _gpus(environment: Mapping[str, str]) -> int:
    """The number of GPUs that ``nvidia-smi`` lists and ``CUDA_VISIBLE_DEVICES`` allows."""
    program = shutil.which("nvidia-smi", path=environment.get("PATH", os.defpath))
    if program is None:
        return 0
    try:
        there = _said([program, "-L"]).count("GPU ")
    except (OSError, subprocess.SubprocessError):
        return 0
    visible = environment.get("CUDA_VISIBLE_DEVICES")
    if visible is None:
        return there
    return min(there, len([each for each in visible.split(",") if each.strip() not in ("", "-1")]))


def _said(argv: list[str]) -> str:
    return subprocess.run(
        argv, capture_output=True, text=True, timeout=_SECONDS, check=True
    ).stdout.strip()
