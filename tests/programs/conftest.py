"""AI2-THOR programs as their users run them: an environment, a home and a process of their own.

No program here knows of er-gym. What starts the player is ``er-gym player install``, given once.
"""

from __future__ import annotations

import os
import subprocess
import sys
import venv
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import pytest

FROM_OUTSIDE = ("DISPLAY", "XDG_CACHE_HOME", "PYTHONPATH", "CUDA_VISIBLE_DEVICES")
"""What would change how the client behaves; a test that wants one sets it."""


@dataclass(frozen=True)
class User:
    """Somebody with a home folder and a Python environment.

    Attributes:
        home: the home folder.
        python: the interpreter; it sees every package that the tests see.
        variables: what is set in the environment beside the home.
    """

    home: Path
    python: Path
    variables: dict[str, str] = field(default_factory=dict)

    def start(self, *arguments: str, **variables: str) -> subprocess.Popen[str]:
        """Start Python with these arguments, in the home folder."""
        environment = {k: v for k, v in os.environ.items() if k not in FROM_OUTSIDE}
        environment |= {"HOME": str(self.home), **self.variables, **variables}
        return subprocess.Popen(
            [str(self.python), *arguments],
            cwd=self.home,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def try_to(self, *arguments: str, **variables: str) -> tuple[int, str, str]:
        """Run Python with these arguments: exit code, stdout and stderr."""
        process = self.start(*arguments, **variables)
        out, err = process.communicate(timeout=120)
        return process.returncode, out, err

    def run(self, program: str, **variables: str) -> list[str]:
        """The lines that a program prints; it must end well."""
        code, out, err = self.try_to("-c", program, **variables)
        assert code == 0, err
        return out.splitlines()

    def er_gym(self, *arguments: str, **variables: str) -> list[str]:
        """The lines that ``er-gym`` prints; it must end well."""
        code, out, err = self.try_to("-m", "benchmarks.cli", *arguments, **variables)
        assert code == 0, err
        return out.splitlines()


def make_user(folder: Path, repository: Path) -> User:
    """Somebody whose environment is empty but for the packages of this one."""
    home, environment = folder / "home", folder / "environment"
    home.mkdir(parents=True)
    venv.create(environment, symlinks=True)
    user = User(home, environment / "bin" / "python")
    (packages,) = user.run("import sysconfig; print(sysconfig.get_path('purelib'))")
    outside = [str(repository), *(path for path in sys.path if path.endswith("-packages"))]
    lines = [f"import site; site.addsitedir({path!r})\n" for path in outside]
    (Path(packages) / "packages.pth").write_text("".join(lines))
    return user


@pytest.fixture
def new_user(tmp_path: Path, repository: Path) -> Callable[[str], User]:
    """Makes users who have installed nothing yet, each by a name."""
    return lambda name: make_user(tmp_path / name, repository)


@pytest.fixture(scope="session")
def user(tmp_path_factory: pytest.TempPathFactory, repository: Path) -> User:
    """Somebody who has given ``er-gym player install``, and nothing else."""
    user = make_user(tmp_path_factory.mktemp("user"), repository)
    user.er_gym("player", "install")
    return user
