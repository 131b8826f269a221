"""Installs :mod:`er_gym.thor.client_hook` where Python loads it at its start, and removes it."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

from er_gym.plugins import NOT_FROM_HERE
from er_gym.thor import client_hook
from er_gym.thor.client_folder import PlayerError, client_home
from er_gym.writing import write_atomic

_HOOK = "er_gym_player_hook"
"""The name of the copied module."""
_FOR_ALL = 0o644
"""Readable by all: Python prints an error at each start if its user may not read a hook."""
_ASK_PYTHON = """
import json, site, sysconfig
from ai2thor._builds import COMMIT_ID
user = [site.getusersitepackages()] if site.ENABLE_USER_SITE else []
print(json.dumps({"commit": COMMIT_ID, "folders": [sysconfig.get_path("purelib"), *user]}))
"""


def hook_folders(python: str) -> list[Path]:
    """The folders whose ``.pth`` files a Python reads at its start, the preferred one first.

    Raises:
        PlayerError: that Python lacks the version of AI2-THOR's client that this Python has.
    """
    from ai2thor._builds import COMMIT_ID

    try:
        command = [python, "-c", NOT_FROM_HERE + _ASK_PYTHON]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60)
        told = json.loads(done.stdout)
    except (OSError, ValueError, subprocess.SubprocessError) as error:
        reason = str(error) if isinstance(error, OSError) else "it cannot import ai2thor._builds"
        raise PlayerError(
            f"{python} cannot run AI2-THOR programs: {reason}; pip install ai2thor=="
            f"{version('ai2thor')} there, or name another Python"
        ) from error
    if told["commit"] != COMMIT_ID:
        raise PlayerError(
            f"the ai2thor of {python} starts the build {told['commit']}, which the player does not "
            f"replace; pip install ai2thor=={version('ai2thor')} there (build {COMMIT_ID})"
        )
    return [Path(folder) for folder in told["folders"]]


def write_hook(folders: Sequence[Path]) -> Path | None:
    """Make sure that one of the folders has the hook; return its path, None if none can have it."""
    for folder in folders:
        if all(_has_text(folder / name, text) for name, text in _hook_files().items()):
            return folder / f"{_HOOK}.pth"  # another user may own it; only the owner removes it
    for folder in folders:
        with contextlib.suppress(OSError):
            folder.mkdir(parents=True, exist_ok=True)
            if os.access(folder, os.W_OK):
                # Record the folder first, so that uninstall finds what a kill leaves behind.
                hooks = sorted({*_hooks(), str(folder)})
                write_atomic(_record(), json.dumps({"hooks": hooks}) + "\n", mode=_FOR_ALL)
                for name, text in _hook_files().items():
                    write_atomic(folder / name, text, mode=_FOR_ALL)
                return folder / f"{_HOOK}.pth"
    return None


def _hook_files() -> dict[str, str]:
    # In this order: Python prints an error at each start if a .pth file names a missing module.
    module = Path(client_hook.__file__).read_text(encoding="utf-8")
    return {f"{_HOOK}.py": module, f"{_HOOK}.pth": f"import {_HOOK}; {_HOOK}.activate()\n"}


def _has_text(path: Path, text: str) -> bool:
    try:
        return path.read_text(encoding="utf-8") == text
    except (OSError, ValueError):
        return False


def _record() -> Path:
    """The file that lists the folders with this user's hooks."""
    return client_home() / "hooks-by-er-gym.json"


def _hooks() -> list[str]:
    try:
        found: list[str] = json.loads(_record().read_text(encoding="utf-8"))["hooks"]
    except (OSError, ValueError, KeyError, TypeError):
        return []
    return found


def remove_hooks() -> bool:
    """Remove this user's hooks and their record; return whether there was a record."""
    for folder in map(Path, _hooks()):
        (folder / f"{_HOOK}.pth").unlink(missing_ok=True)  # before the module that it names
        for path in (*folder.glob(f"{_HOOK}.*"), *folder.glob(f"__pycache__/{_HOOK}.*")):
            path.unlink(missing_ok=True)
    records = list(client_home().glob(f"{_record().name}*"))  # also what a kill has left
    for path in records:
        path.unlink(missing_ok=True)
    return bool(records)
