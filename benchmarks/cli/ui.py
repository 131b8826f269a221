"""``er-gym ui``."""

from __future__ import annotations

import contextlib
import os
import secrets
import shutil
import subprocess
import sys
import threading
from pathlib import Path
from types import FrameType

import click

from benchmarks.cli.errors import BadInput, needing
from benchmarks.cli.listener import LOOPBACK, listen
from benchmarks.cli.options import EXISTING_FOLDER, FOLDER, port_option, with_options
from benchmarks.cli.ui_export import FileOptions, write_files
from benchmarks.cli.vlm_options import VLMOptions
from benchmarks.terminal import echo

_SCREENS = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
"""One of these is set where xdg-open can show something."""


def _open_browser(address: str) -> None:
    """Open a browser where there is a screen for one. What it prints is not the command's to say;
    the address has been printed."""
    if sys.platform != "linux":
        click.launch(address)
        return
    program = shutil.which("xdg-open")
    if program is not None and any(map(os.environ.get, _SCREENS)):
        nowhere = subprocess.DEVNULL
        with contextlib.suppress(OSError):
            subprocess.Popen(
                [program, address],
                stdin=nowhere,
                stdout=nowhere,
                stderr=nowhere,
                start_new_session=True,
            )


@click.command(name="ui")
@click.argument("folders", nargs=-1, type=EXISTING_FOLDER, metavar="[FOLDER]...")
@click.option(
    "--host",
    default=LOOPBACK,
    show_default=True,
    help="The address to listen on. Any other than this machine's own needs a token, which is "
    "printed.",
)
@port_option(8010)
@click.option("--token", help="The token for another --host.  [default: a random one]")
@click.option("--no-browser", is_flag=True, help="Do not open a browser.")
@click.option(
    "--play",
    type=FOLDER,
    metavar="OUT",
    help="Let a person play, alone or in place of an agent; the runs are written below OUT.",
)
@with_options(files=FileOptions, vlm_options=VLMOptions)
def ui(
    folders: tuple[Path, ...],
    host: str,
    port: int,
    token: str | None,
    no_browser: bool,
    play: Path | None,
    vlm_options: VLMOptions,
    files: FileOptions,
) -> int:
    """Show runs in the browser, during the run or afterwards.

    FOLDERs hold run directories, at any depth; without one, ./runs. Nothing in them is changed. The
    options from --agent-config on are for vision-language agents that a person watches with --play.

    With --export or --video it starts no server, and writes a run's pages or an episode's video.
    """
    with needing("er-gym ui", "er-gym[ui]"):
        import uvicorn

        from benchmarks.monitor.app import make_app

        if write_files(files):
            return 0
    if play is None and vlm_options.given:
        raise BadInput(f"{vlm_options.given[0]} is for agents that a person watches; give --play")
    usual = Path("runs")
    roots = folders or ((usual,) if play is None or usual.is_dir() else ())
    missing = next((root for root in roots if not root.is_dir()), None)
    if missing is not None:
        raise BadInput(f"{missing} does not exist; give the folder that holds your runs")
    local = host in (LOOPBACK, "localhost", "::1")
    secret = "" if local and token is None else (token or secrets.token_urlsafe(18))
    listener, place = listen(host, port)
    address = f"http://{place}/"
    address += f"?token={secret}" if secret else ""
    echo(address)
    if not no_browser:
        _open_browser(address)
    closing = threading.Event()
    app = make_app(roots, secret, closing, play=play, vlm_run=vlm_options.run)
    config = uvicorn.Config(app, log_level="error", access_log=False, timeout_graceful_shutdown=5)
    server = uvicorn.Server(config)
    leave = server.handle_exit

    def handle_exit(number: int, frame: FrameType | None) -> None:
        closing.set()
        leave(number, frame)

    server.handle_exit = handle_exit  # type: ignore[assignment, method-assign]
    with contextlib.suppress(KeyboardInterrupt):  # Ctrl-C is how it ends
        server.run(sockets=[listener])
    return 0
