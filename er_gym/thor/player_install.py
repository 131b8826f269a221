"""Installs the player where AI2-THOR's client looks for its own builds, and removes it again."""

from __future__ import annotations

import contextlib
import os
import shlex
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from er_gym.thor import client_hook
from er_gym.thor.client_folder import (
    ClientFile,
    GpuMapping,
    PlayerError,
    Release,
    client_home,
    sweep,
)
from er_gym.thor.hooks import hook_folders, remove_hooks, write_hook

RELEASES = tuple(Release(platform) for platform in client_hook.PLATFORMS)
_CLIENT_FILES: tuple[ClientFile, ...] = (*RELEASES, GpuMapping())


@dataclass(frozen=True)
class Installed:
    """The result of :func:`install`.

    Attributes:
        releases: the builds that the player replaces.
        hook: the file by which Python programs skip the client's test of the machine; None if it
            could not be written.
        pruned: other builds that the client, which keeps three, deletes at its next start.
    """

    releases: tuple[Release, ...]
    hook: Path | None
    pruned: tuple[Path, ...]


def install(*, force: bool = False, python: str = sys.executable) -> Installed:
    """Put the player where ``Controller(…)`` finds it as its own build, without a download.

    Installing again is harmless, and repairs an installation whose Python has moved.

    Args:
        force: set real builds aside; :func:`uninstall` restores them.
        python: the interpreter whose programs the hook serves, if it is not this one.

    Raises:
        PlayerError: a real build is there, the client could not start the player from there, or
            the interpreter has no such client.
    """
    for release in RELEASES:
        _check_path(release)
    folders = hook_folders(python)
    with _installation_lock():
        for release in RELEASES:
            _check_build(release, force)
        if GpuMapping().is_foreign and os.path.lexists(GpuMapping().set_aside):
            raise _both_occupied(GpuMapping())
        for file in _CLIENT_FILES:
            file.put()
        return Installed(RELEASES, write_hook(folders), tuple(_soon_pruned()))


def _check_path(release: Release) -> None:
    if shlex.split(str(release.executable)) != [str(release.executable)]:
        raise PlayerError(
            f"AI2-THOR's client splits the path {release.executable} at its spaces and quotes, so "
            "it cannot start anything there; use Controller(local_executable_path="
            "er_gym.thor_executable(), x_display=':0')"
        )


def _check_build(release: Release, force: bool) -> None:
    if release.is_foreign:
        if not force:
            raise PlayerError(
                f"{release.path} holds a build that er-gym did not put there; --force sets it "
                "aside, and uninstall brings it back"
            )
        if os.path.lexists(release.set_aside):
            raise _both_occupied(release)


def _both_occupied(file: ClientFile) -> PlayerError:
    return PlayerError(
        f"{file.path} is not er-gym's, and neither is {file.set_aside}, which is set aside "
        "already; move one of the two away"
    )


def uninstall() -> tuple[Release, ...]:
    """Remove what :func:`install` has installed, and restore what it had set aside.

    Returns:
        The Unity builds that are installed now.

    Raises:
        PlayerError: er-gym has installed nothing.
    """
    unity = [str(release.path) for release in RELEASES if release.is_unity]
    others = f"; other builds are there: {', '.join(unity)}" if unity else ""
    nothing = PlayerError(f"er-gym has installed nothing in {client_home()}{others}")
    if not client_home().is_dir():
        raise nothing
    with _installation_lock():
        removed = [sweep(), *(file.clear() for file in _CLIENT_FILES), remove_hooks()]
    if not any(removed):
        raise nothing
    with contextlib.suppress(OSError):  # they are not empty: the client keeps its logs there
        (client_home() / "releases").rmdir()
        client_home().rmdir()
    return tuple(release for release in RELEASES if release.is_unity)


def still_aside() -> list[Path]:
    """Files that :func:`install` set aside and whose place is taken, so that they stay there."""
    return [file.set_aside for file in _CLIENT_FILES if os.path.lexists(file.set_aside)]


@contextlib.contextmanager
def _installation_lock() -> Iterator[None]:
    """Keep other installations of er-gym out meanwhile, and turn disk errors into a PlayerError."""
    from filelock import lock_descriptor

    try:
        client_home().mkdir(parents=True, exist_ok=True)
        folder = os.open(client_home(), os.O_RDONLY)
        try:
            lock_descriptor(folder)
            yield
        finally:
            os.close(folder)
    except OSError as error:
        raise PlayerError(
            f"er-gym cannot write its files ({error}); AI2-THOR's client keeps everything in "
            f"{client_home()}: make that writable, or set HOME to a folder that is"
        ) from error


def _soon_pruned() -> list[Path]:
    """Other builds that the client, which keeps the newest three, deletes at its next start."""
    folders = [path for path in RELEASES[0].path.parent.iterdir() if path.is_dir()]
    newest_last = sorted(folders, key=lambda path: path.stat().st_mtime)
    return [path for path in newest_last[:-3] if not (path / client_hook.MARKER).is_file()]
