"""``er-gym openenv`` and ``er-gym mcp``: servers on which others play."""

from __future__ import annotations

import contextlib
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from benchmarks.cli.errors import bad_input, needing
from benchmarks.cli.listener import LOOPBACK, listen
from benchmarks.cli.options import (
    FOLDER,
    Finite,
    OptionGroup,
    given_size,
    option,
    port_option,
    protocol_option,
    shared_option,
    size_option,
    with_options,
    workers_type,
)
from benchmarks.terminal import echo

_LONGEST_MESSAGE = 2**20
"""Bytes of a client's message; an action has some dozens."""


@dataclass(frozen=True)
class SessionOptions(OptionGroup):
    """What is played; the same for all sessions."""

    suite: str = option(
        default="mini",
        show_default=True,
        help="Where tasks come from: a suite, a task file, or 'generate'.",
    )
    types: str | None = option(metavar="NAMES", help="Only these task types, between commas.")
    scaffold: str = option(
        default="hints/key_actions",
        show_default=True,
        help="What the text tells (picture, caption, targets, hints) and what is rewarded "
        "(success, key_actions, shaping).",
    )
    pictures: bool = option(is_flag=True, help="Send the agent's view as well.")
    width: int | None = shared_option(size_option("--width"))
    height: int | None = shared_option(size_option("--height"))
    max_steps: int | None = option(
        type=click.IntRange(min=1), help="The most steps.  [default: the task type's own]"
    )
    instances: str | None = option(
        type=click.Choice(("target", "explore")),
        help="Which object a type's name stands for.  [default: target]",
    )
    protocol: str = shared_option(protocol_option)
    sessions: int = option(
        type=click.IntRange(1, 4096),
        default=64,
        show_default=True,
        help="The most sessions at a time, in each process.",
    )
    idle: float = option(
        type=Finite(min=0, min_open=True),
        default=600.0,
        show_default=True,
        metavar="SECONDS",
        help="After so long without a message a session is closed.",
    )

    @property
    def session(self) -> dict[str, Any]:
        """The arguments of a session."""
        types = None if self.types is None else [each.strip() for each in self.types.split(",")]
        given = {
            "task_type": types,
            "max_steps": self.max_steps,
            "instances": self.instances,
            "pictures": self.pictures or None,
        }
        return {
            "episode_source": self.suite,
            "scaffold": self.scaffold,
            "protocol": self.protocol,
            **given_size(self.width, self.height),
            **{name: value for name, value in given.items() if value is not None},
        }


@click.command()
@click.option(
    "--host",
    default=LOOPBACK,
    show_default=True,
    help="The address to listen on. Who reaches it can play: the server asks for no password.",
)
@port_option(8000)
@click.option(
    "--workers",
    type=workers_type,
    default=1,
    show_default=True,
    help="The number of processes; each connection stays with one of them.",
)
@click.option(
    "--hub-folder",
    type=FOLDER,
    metavar="DIR",
    help="Serve nothing, and write the folder that OpenEnv's hub builds a server from.",
)
@with_options(options=SessionOptions)
def openenv(
    host: str, port: int, workers: int, hub_folder: Path | None, options: SessionOptions
) -> int:
    """Serve er-gym to clients of OpenEnv: each connection plays in an environment of its own."""
    with needing("er-gym openenv", "er-gym[openenv]"):
        import uvicorn

        from er_gym.integrations.openenv import SETTINGS, make_app, write_hub_folder
    if hub_folder is not None:
        with bad_input():
            write_hub_folder(hub_folder)
        echo(f"{hub_folder}: put a wheel of er-gym into {hub_folder}/wheels, then openenv push")
        return 0
    given = {
        "max_sessions": options.sessions,
        "idle_seconds": options.idle,
        **options.session,
    }
    with bad_input():
        make_app(**given)
    listener, place = listen(host, port)
    free = listener.getsockname()[1]
    listener.close()  # with several processes uvicorn wants to open it itself
    echo(f"http://{place}")
    os.environ[SETTINGS] = json.dumps(given)
    with contextlib.suppress(KeyboardInterrupt):  # Ctrl-C is how it ends
        uvicorn.run(
            "er_gym.integrations.openenv:app_of_variable",
            factory=True,
            host=host,
            port=free,
            workers=workers,
            # OpenEnv leaves an error in the log for each connection that breaks, after tidying up.
            log_level="critical",
            ws_max_size=_LONGEST_MESSAGE,
            timeout_graceful_shutdown=5,
        )
    return 0


@click.command()
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    help="Serve over HTTP on this port of this machine; 0 for a free one.  [default: over standard "
    "input and output]",
)
@with_options(options=SessionOptions)
def mcp(port: int | None, options: SessionOptions) -> int:
    """Serve er-gym to clients of the Model Context Protocol: its tools are the verbs."""
    with needing("er-gym mcp", "er-gym[mcp]"):
        import uvicorn

        from er_gym.integrations.mcp import Episodes, make_server
    with bad_input():
        episodes = Episodes(options.sessions, options.idle, **options.session)
    server = make_server(episodes)
    with contextlib.suppress(KeyboardInterrupt):
        if port is None:
            server.run("stdio")
            return 0
        listener, place = listen(LOOPBACK, port)
        echo(f"http://{place}/mcp")
        config = uvicorn.Config(
            server.streamable_http_app(), log_level="error", timeout_graceful_shutdown=5
        )
        uvicorn.Server(config).run(sockets=[listener])
    return 0
