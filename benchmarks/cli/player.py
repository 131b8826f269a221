"""``er-gym player``: AI2-THOR programs on the embedded engine."""

from __future__ import annotations

import sys

import click

from benchmarks.cli.errors import bad_input
from benchmarks.terminal import echo


@click.group()
def player() -> None:
    """Run unmodified AI2-THOR programs on the embedded engine."""


@player.command()
def path() -> None:
    """Print the path for Controller(local_executable_path=…, x_display=":0")."""
    from er_gym.thor import thor_executable

    echo(thor_executable())


@player.command()
@click.option("--force", is_flag=True, help="Set real Unity builds aside; uninstall restores them.")
@click.option(
    "--python",
    type=click.Path(exists=True, dir_okay=False),
    help="The Python that runs your AI2-THOR programs, if that is another.",
)
def install(force: bool, python: str | None) -> None:
    """Make Controller(scene=…) start the player: offline, without a GPU or an X server.

    The player takes the place of Unity's builds in ~/.ai2thor, for the platforms Linux64 (the
    client's default) and CloudRendering, and of the file in which the client looks up GPUs. A hook
    in Python's site-packages skips the client's tests for an X server and Vulkan. Install again
    after moving Python, and for each Python that runs AI2-THOR programs.
    """
    from benchmarks.cli.doctor_checks import version_of_client
    from er_gym.thor import player_install as players
    from er_gym.thor.client_folder import PlayerError

    with bad_input(PlayerError):
        installed = players.install(force=force, python=python or sys.executable)
    for release in installed.releases:
        echo(f"{release.platform}: {release.path}")
    echo(f"for {version_of_client()}; programs with another version do not use it")
    if installed.hook is not None:
        echo(f"hook: {installed.hook}")
    else:
        echo(
            "no hook, since the site-packages of Python cannot be written: AI2-THOR's client "
            "still needs an X server or a Vulkan library; er-gym doctor says what to do"
        )
    for build in installed.pruned:
        echo(f"AI2-THOR's client keeps three builds: at its next start it deletes {build}")


@player.command()
def uninstall() -> None:
    """Remove what install wrote, and restore what it set aside."""
    from er_gym.thor import player_install as players
    from er_gym.thor.client_folder import PlayerError, client_home

    with bad_input(PlayerError):
        unity = players.uninstall()
    echo(f"removed from {client_home()}")
    for release in unity:
        echo(f"Unity's build is there again: {release.path}")
    for path in players.still_aside():
        echo(f"not restored, since another file has its place: {path}")
