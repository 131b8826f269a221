"""``er-gym serve`` and ``er-gym match-server``: servers for vision-language agents."""

from __future__ import annotations

import shlex
import signal
import socket
import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from benchmarks.cli.activity import doing
from benchmarks.cli.errors import INTERRUPTED, BadInput, bad_input, print_problem
from benchmarks.cli.options import (
    Finite,
    OptionGroup,
    agent_config_option,
    option,
    overrides_option,
    port_option,
    shared_option,
    with_options,
)
from benchmarks.terminal import echo, without_control_codes

if TYPE_CHECKING:
    from agents.vlm.serving import Command
    from benchmarks.cli.server_process import ServerProcess

ENGINE_CHOICES = ("vllm", "transformers", "llama_cpp")
"""As in ``agents.vlm.serving``, which is too heavy to import for ``--help``; a test compares."""

_TERMINATED = 143


@dataclass(frozen=True)
class ServerOptions(OptionGroup):
    """How a model is served."""

    engine: str | None = option(
        type=click.Choice(ENGINE_CHOICES),
        help="The server program.  [default: chosen by model and machine]",
    )
    port: int = shared_option(port_option(8000))
    name: str = option(default="", help="The model's name in requests.")
    context: int | None = option(
        type=click.IntRange(min=1),
        help="The most tokens in a conversation; not for transformers.",
    )
    pictures: int = option(
        type=click.IntRange(min=0),
        default=40,
        show_default=True,
        help="The most pictures in a conversation; vllm only.",
    )
    gpus: int | None = option(
        type=click.IntRange(min=0), help="The number of GPUs to use.  [default: all]"
    )
    python: str = option(
        default=sys.executable,
        help="The Python that has the server's packages.  [default: this one]",
    )
    patience: float = option(
        type=Finite(min=0, min_open=True),
        default=1200.0,
        show_default=True,
        metavar="SECONDS",
        help="How long the server may take to load the model.",
    )
    verbose: bool = option(is_flag=True, help="Show what the server writes.")
    dry_run: bool = option(is_flag=True, help="Only print the server's command.")


@click.command(epilog="Arguments after -- go to the server unchanged.")
@click.argument("model")
@click.argument("more", nargs=-1, metavar="[-- ARGUMENTS...]", type=click.UNPROCESSED)
@with_options(server_options=ServerOptions)
def serve(model: str, more: tuple[str, ...], server_options: ServerOptions) -> int:
    """Start a server for a model, for `er-gym bench --agent openai:MODEL` to play with.

    MODEL is a directory, a run of er-gym finetune, a .gguf file or a name on a model hub. llama.cpp
    serves .gguf files. vLLM serves other models if it is installed and there is a GPU; otherwise
    transformers does. An adapter is first merged into its model, once, in the directory merged
    beside it. The server listens on 127.0.0.1 only, and ends when this command does.
    """
    from agents.factory import load_settings
    from agents.vlm.clients.merging import merge, merged_directory
    from agents.vlm.serving import ServeOptions, command_for, inspect_machine
    from agents.vlm.tuned_model import agent_file, model_directory

    _must_be_there(model)
    with bad_input():
        tuned_for = agent_file(model)
        settings = load_settings(None, (), tuned_for)
        directory = Path(model_directory(model))
        whole = str(merged_directory(directory)) if directory.is_dir() else model
        options = ServeOptions(
            port=_usable_port(server_options.port),
            engine=server_options.engine or "",
            name=server_options.name,
            pictures=server_options.pictures,
            pixels=settings.pictures.model_bounds,
            agent_config=str(tuned_for or ""),
            context=server_options.context,
            gpus=server_options.gpus,
            more=more,
        )
        command = command_for(whole, options, inspect_machine(server_options.python))
    if server_options.dry_run:
        echo(_as_shell(command))
        return 0
    if directory.is_dir() and whole != str(directory):
        echo(f"merging the adapter {directory} into {whole}", err=True)
        doing("merging")
        with bad_input():
            merge(directory)
    return run_server(command, patience=server_options.patience, verbose=server_options.verbose)


@click.command(name="match-server")
@port_option(8001)
@agent_config_option
@overrides_option("matching.fuzzy=90")
def match_server(port: int, agent_config: str | None, overrides: tuple[str, ...]) -> int:
    """Match names to object types over HTTP, at /match.

    The server matches as an agent with these settings does. It listens on 127.0.0.1 only.
    """
    from agents.factory import load_settings
    from agents.vlm.match_server import serve as serve_matches
    from agents.vlm.matching import Matcher

    with bad_input():
        settings = load_settings(agent_config, overrides)
        doing("loading the matcher")
        serve_matches(Matcher(settings.matching), port)
    return 0


def run_server(command: Command, *, patience: float, verbose: bool = False) -> int:
    """Run a server until it or this command ends; print how to play with it once it is ready.

    Args:
        command: the server's.
        patience: seconds that it may take to get ready.
        verbose: whether to show everything that it writes.

    Returns:
        130, after Ctrl-C.

    Raises:
        SystemExit: with 143, after SIGTERM.
        click.ClickException: the server ended, or was not ready in time.
    """
    from benchmarks.cli.server_process import ServerError, ServerProcess

    before = signal.signal(signal.SIGTERM, lambda *_: sys.exit(_TERMINATED))
    show = partial(echo, err=True)
    listeners = [show] if verbose else []
    try:
        with ServerProcess(command.argv, command.environment, *listeners) as server:
            try:
                seconds = _wait(server, command, patience, verbose)
                echo(f"ready after {seconds:.0f} s: {command.base_url}")
                echo(_how_to_play(command))
                server.wait()
            except ServerError as error:
                server.stop()
                if not verbose:
                    show("\n".join(server.last_lines))
                raise click.ClickException(f"{command.engine}: {error}") from error
    except KeyboardInterrupt:
        print_problem("the server has ended")
    finally:
        signal.signal(signal.SIGTERM, before)
    return INTERRUPTED


def _wait(server: ServerProcess, command: Command, patience: float, verbose: bool) -> float:
    """Wait until the server is ready; show its progress where there is a terminal."""
    latest = ""

    def hear(since: float, last: str) -> None:
        nonlocal latest
        latest = without_control_codes(last)

    if verbose or not sys.stderr.isatty():
        echo(f"starting {command.engine} for {command.name}", err=True)
    if not verbose:
        doing(f"starting {command.engine} for {command.name}", lambda: latest)
    seconds = server.wait_until_ready(command.ready_url, patience, hear)
    doing("")
    return seconds


def _how_to_play(command: Command) -> str:
    player = ["--agent", f"openai:{command.name}", "--base-url", command.base_url]
    return shlex.join(["er-gym", "bench", "--suite", "mini", *player, *command.bench_options])


def _as_shell(command: Command) -> str:
    variables = [f"{name}={shlex.quote(value)}" for name, value in command.environment.items()]
    return " ".join([*variables, shlex.join(command.argv)])


def _must_be_there(model: str) -> None:
    """Refuse a model that can only be a path and does not exist."""
    path = Path(model)
    if model.lower().endswith(".gguf") and not path.is_file():
        raise BadInput(f"{model} is not a file; give the path of one, or another kind of model")
    if model.startswith(("/", "./", "../", "~")) and not path.exists():
        raise BadInput(f"{model} does not exist; give a model's directory, or its name on a hub")


def _usable_port(port: int) -> int:
    """The port, or a free one for 0."""
    from agents.vlm.serving import HOST

    with socket.socket() as probe:
        # As servers do: a port that has just been closed can be used.
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((HOST, port))
        except OSError as error:
            raise BadInput(
                f"port {port} of {HOST} cannot be used ({error.strerror}); choose another --port, "
                "or 0 for a free one"
            ) from error
        return int(probe.getsockname()[1])
