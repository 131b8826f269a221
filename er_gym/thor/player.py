"""Where the official client finds the player: by a path, or as its own CloudRendering build."""

from __future__ import annotations

import json
import os
import shlex
import shutil
import sys
import tempfile
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

_START = Path(__file__).with_name("start_player.py")
_SERVER_TYPES = {"server_types": ["FIFO"]}
"""What the client reads from a build's metadata.json: how the build can be spoken to."""
MARKER = "installed-by-er-gym.json"
"""A file in a release folder that says: er-gym may remove this folder."""


class PlayerError(RuntimeError):
    """The player cannot be installed or uninstalled; the message says why and what to do."""


def thor_executable() -> str:
    """What ``Controller(local_executable_path=…, x_display=":0")`` launches to get our engine.

    It is the path of a launcher for this Python and this er-gym, which is written to the user's
    cache (``$XDG_CACHE_HOME`` or ``~/.cache``) when it is not there yet. The client splits it as a
    shell would, so that a path with spaces comes quoted. Where nothing can be written it is the
    command that the launcher would run.
    """
    text = _launcher()
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser()) / "er-gym"
    path = cache / f"player-{sha256(text.encode()).hexdigest()[:12]}"
    try:
        if not (os.access(path, os.X_OK) and path.read_text() == text):
            cache.mkdir(parents=True, exist_ok=True)
            _write_executable(path, text)
    except OSError:
        return shlex.join(_command())
    return shlex.quote(str(path))


def _command() -> list[str]:
    return [sys.executable, str(_START)]


def _launcher() -> str:
    # A shell script: a `#!` line takes neither spaces nor more than some hundred characters. The
    # shell is there at once, to see whose child it is; Python may come after the parent's death.
    return (
        "#!/bin/sh\n"
        "# er-gym's player, which AI2-THOR's client starts in place of Unity's.\n"
        f'exec {shlex.join(_command())} -parent "$PPID" "$@"\n'
    )


def _write_executable(path: Path, text: str) -> None:
    """Write a program so that nobody ever finds half of it there."""
    file, draft = tempfile.mkstemp(dir=path.parent, prefix=path.name)
    with os.fdopen(file, "w") as stream:
        stream.write(text)
    os.chmod(draft, 0o755)
    os.replace(draft, path)


@dataclass(frozen=True)
class Release:
    """The place of a build of this client's version for one of its platforms."""

    platform: str = "CloudRendering"

    @property
    def home(self) -> Path:
        """The folder of all that the client keeps."""
        return Path("~/.ai2thor").expanduser()

    @property
    def name(self) -> str:
        from ai2thor._builds import COMMIT_ID

        return f"thor-{self.platform}-{COMMIT_ID}"

    @property
    def folder(self) -> Path:
        return self.home / "releases" / self.name

    @property
    def executable(self) -> Path:
        return self.folder / self.name

    @property
    def set_aside(self) -> Path:
        """Where a real build waits; the client prunes only what is in ``releases``."""
        return self.home / "set-aside-by-er-gym" / self.name

    @property
    def is_ours(self) -> bool:
        """Whether er-gym has put its player there."""
        return (self.folder / MARKER).is_file()

    @property
    def is_unity(self) -> bool:
        """Whether something else is there: a real build."""
        return self.folder.is_dir() and not self.is_ours


def install(*, force: bool = False) -> Release:
    """Put the player where ``Controller(platform=CloudRendering)`` finds it, without a download.

    Again is harmless, and mends an installation whose Python has moved.

    Args:
        force: set a real build aside that is there; :func:`uninstall` brings it back.

    Raises:
        PlayerError: a real build is there, or the client could not start the player from there.
    """
    release = Release()
    if shlex.split(str(release.executable)) != [str(release.executable)]:
        raise PlayerError(
            f"AI2-THOR's client splits the path {release.executable} at its spaces and quotes, so "
            "it cannot start anything there; use Controller(local_executable_path="
            "er_gym.thor_executable(), x_display=':0')"
        )
    if release.is_unity:
        if not force:
            raise PlayerError(
                f"{release.folder} holds a build that er-gym did not put there; --force sets it "
                "aside, and uninstall brings it back"
            )
        if release.set_aside.exists():
            raise PlayerError(f"{release.set_aside} is set aside already; remove one of the two")
        release.set_aside.parent.mkdir(parents=True, exist_ok=True)
        release.folder.rename(release.set_aside)
    release.folder.parent.mkdir(parents=True, exist_ok=True)
    draft = Path(tempfile.mkdtemp(dir=release.home, prefix="er-gym-"))
    draft.chmod(0o755)
    _write_executable(draft / release.name, _launcher())
    (draft / "metadata.json").write_text(json.dumps(_SERVER_TYPES) + "\n")
    (draft / MARKER).write_text(json.dumps({"python": sys.executable}) + "\n")
    if release.is_ours:
        shutil.rmtree(release.folder)
    draft.rename(release.folder)
    return release


def uninstall() -> Release:
    """Remove what :func:`install` has put there, and bring back what it had set aside.

    Raises:
        PlayerError: nothing of er-gym's is there.
    """
    release = Release()
    if not release.is_ours:
        found = "a build that er-gym did not put there" if release.is_unity else "nothing"
        raise PlayerError(f"there is {found} in {release.folder}, so nothing is removed")
    shutil.rmtree(release.folder)
    if release.set_aside.is_dir():
        release.set_aside.rename(release.folder)
        if not any(release.set_aside.parent.iterdir()):
            release.set_aside.parent.rmdir()
    return release


def vulkan_is_there() -> bool:
    """Whether the client's own test for Vulkan, which CloudRendering has to pass, does."""
    from ctypes.util import find_library

    return find_library("vulkan") is not None
