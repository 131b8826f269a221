"""The files in the client's folder that ``er-gym player install`` fills.

Under each name stands nothing, or a file or folder of er-gym or of another program. One rename
moves a foreign file aside and one rename restores it, so that a kill in between loses nothing.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import sys
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from er_gym.thor.client_hook import MARKER
from er_gym.thor.launcher import EXECUTABLE, launcher
from er_gym.writing import write_atomic

_GPUS = 256
"""The number of devices in the mapping; no machine has more."""
_OURS = {"-1": "installed by er-gym"}
"""An entry of the mapping that the client never looks up: device numbers begin at 0."""


class PlayerError(RuntimeError):
    """The player cannot be installed or uninstalled; the message says why and what to do."""


def client_home() -> Path:
    """The folder in which the client keeps its files."""
    return Path("~/.ai2thor").expanduser()


class ClientFile(ABC):
    """A file or folder in the client's folder, under a name that the client looks up."""

    @property
    @abstractmethod
    def path(self) -> Path:
        """Where the client looks for it."""

    @property
    @abstractmethod
    def is_ours(self) -> bool:
        """Whether er-gym's file is there."""

    @abstractmethod
    def write(self, path: Path) -> None:
        """Write er-gym's file to another path."""

    @property
    def is_foreign(self) -> bool:
        """Whether a file is there that is not er-gym's."""
        return os.path.lexists(self.path) and not self.is_ours

    @property
    def set_aside(self) -> Path:
        """Where a foreign file waits; the client prunes only the folder ``releases``."""
        return client_home() / "set-aside-by-er-gym" / self.path.name

    def put(self) -> None:
        """Put er-gym's file there, and move a foreign file aside."""
        with _drafts() as drafts:
            self.write(drafts / "new")
            if self.is_foreign:
                self.set_aside.parent.mkdir(exist_ok=True)
                self.path.rename(self.set_aside)
            elif self.is_ours:
                # Not deleted in place, since a kill meanwhile would leave half of it.
                self.path.rename(drafts / "old")
            self.path.parent.mkdir(exist_ok=True)
            (drafts / "new").rename(self.path)

    def clear(self) -> bool:
        """Remove er-gym's file and restore a foreign one; return whether either was there."""
        ours = self.is_ours
        if ours:
            with _drafts() as drafts:
                self.path.rename(drafts / "old")
        back = os.path.lexists(self.set_aside) and not os.path.lexists(self.path)
        if back:
            self.set_aside.rename(self.path)
            with contextlib.suppress(OSError):  # other foreign files are set aside there
                self.set_aside.parent.rmdir()
        return ours or back


@contextlib.contextmanager
def _drafts() -> Iterator[Path]:
    """An empty folder on the same disk as the files, removed afterwards."""
    sweep()
    folder = _drafts_folder()
    folder.mkdir(parents=True)
    try:
        yield folder
    finally:
        sweep()


def sweep() -> bool:
    """Remove drafts, including those that a killed process left; return whether there were any."""
    folder = _drafts_folder()
    left = folder.exists()
    shutil.rmtree(folder, ignore_errors=True)
    return left


def _drafts_folder() -> Path:
    return client_home() / "er-gym-drafts"


@dataclass(frozen=True)
class Release(ClientFile):
    """A build of this client's version for one of its platforms."""

    platform: str = "CloudRendering"

    @property
    def name(self) -> str:
        """The client's name for the build, its folder and its program."""
        from ai2thor._builds import COMMIT_ID

        return f"thor-{self.platform}-{COMMIT_ID}"

    @property
    def path(self) -> Path:
        return client_home() / "releases" / self.name

    @property
    def executable(self) -> Path:
        """The program that the client starts."""
        return self.path / self.name

    @property
    def is_ours(self) -> bool:
        return (self.path / MARKER).is_file()

    @property
    def is_unity(self) -> bool:
        """Whether a real build is there."""
        return self.is_foreign and self.path.is_dir()

    def write(self, path: Path) -> None:
        path.mkdir()
        write_atomic(path / self.name, launcher(), mode=EXECUTABLE)
        # The servers that the build supports; without this file the client asks the network.
        (path / "metadata.json").write_text(json.dumps({"server_types": ["FIFO", "WSGI"]}) + "\n")
        (path / MARKER).write_text(json.dumps({"python": sys.executable}) + "\n")


@dataclass(frozen=True)
class GpuMapping(ClientFile):
    """The file in which the client stores which Vulkan device belongs to a CUDA device.

    If the file is missing and a program asks for a GPU (``gpu_device``, ``CUDA_VISIBLE_DEVICES``),
    the client runs vulkaninfo and nvidia-smi. The player uses no GPU, so the file maps every
    number. Numbers in the user's own file keep their values, for real builds beside the player.
    """

    @property
    def path(self) -> Path:
        return client_home() / "cuda-vulkan-mapping.json"

    @property
    def is_ours(self) -> bool:
        return _devices(self.path).items() >= _OURS.items()

    def write(self, path: Path) -> None:
        devices: dict[str, Any] = {str(number): number for number in range(_GPUS)}
        theirs = _devices(self.path if self.is_foreign else self.set_aside)
        # The client reads every key as a number, and fails if a key is not a number.
        devices |= {number: device for number, device in theirs.items() if number.isdecimal()}
        path.write_text(json.dumps(_OURS | devices) + "\n")


def _devices(path: Path) -> dict[str, Any]:
    """The content of a mapping file; empty if the file is missing or damaged."""
    try:
        devices = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return devices if isinstance(devices, dict) else {}
