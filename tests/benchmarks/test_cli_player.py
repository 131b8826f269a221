"""``er-gym player`` and ``er-gym doctor`` as a user gives them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks import cli, doctor
from er_gym.thor.player import Release


@pytest.fixture(autouse=True)
def home(monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.delenv("DISPLAY", raising=False)
    return tmp_path


@pytest.fixture
def er_gym(capsys):
    """Runs the command in this process; returns exit code, stdout and stderr."""

    def run(*arguments: str) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as left:
            cli.main(arguments)
        out, err = capsys.readouterr()
        return left.value.code, out, err

    return run


def without_vulkan(monkeypatch):
    monkeypatch.setattr("ctypes.util.find_library", lambda name: None)


# -- player ----------------------------------------------------------------------------------------


def test_path_prints_a_program(er_gym):
    code, out, _ = er_gym("player", "path")
    assert code == 0
    assert subprocess.run([out.strip()], capture_output=True).returncode == 2


def test_install_says_where_and_what_the_client_still_lacks(er_gym, monkeypatch):
    without_vulkan(monkeypatch)
    code, out, _ = er_gym("player", "install")
    assert code == 0
    assert str(Release().folder) in out
    assert "apt install libvulkan1" in out
    assert er_gym("player", "uninstall")[0] == 0
    assert not Release().folder.exists()


def test_with_vulkan_nothing_is_lacking(er_gym, monkeypatch):
    monkeypatch.setattr("ctypes.util.find_library", lambda name: f"lib{name}.so.1")
    assert "Vulkan" not in er_gym("player", "install")[1]


def test_a_real_build_is_kept_unless_forced(er_gym):
    release = Release()
    release.folder.mkdir(parents=True)
    code, out, err = er_gym("player", "install")
    assert (code, out) == (2, "")
    assert "--force" in err
    assert err.count("\n") == 1
    assert er_gym("player", "install", "--force")[0] == 0
    assert release.is_ours
    assert "Unity's build is there again" in er_gym("player", "uninstall")[1]
    assert release.is_unity


def test_uninstalling_nothing_is_bad_input(er_gym):
    code, _, err = er_gym("player", "uninstall")
    assert code == 2
    assert "nothing" in err


# -- doctor ----------------------------------------------------------------------------------------


def lines(out: str) -> dict[str, str]:
    """A part's name to its whole line."""
    parts = ["embedded engine", "renderer", "player", "Unity build", "GPU"]
    parts += [f"extra {name}" for name in doctor.EXTRAS]
    found = {part: line for line in out.splitlines() for part in parts if line[4:].startswith(part)}
    assert list(found) == parts
    assert len(out.splitlines()) == len(parts)
    return found


def test_doctor_has_a_line_for_each_part(er_gym, monkeypatch):
    without_vulkan(monkeypatch)
    code, out, err = er_gym("doctor")
    assert (code, err) == (0, "")
    line = lines(out)
    for part in ("embedded engine", "renderer", "player"):
        assert line[part].startswith("ok ")
    assert line["Unity build"].startswith("--")
    for lacking in ("build missing", "Vulkan missing", "display missing", "libvulkan1", "network"):
        assert lacking in line["Unity build"]


def test_doctor_tells_the_player_from_unity(er_gym, monkeypatch):
    monkeypatch.setattr("ctypes.util.find_library", lambda name: f"lib{name}.so.1")
    er_gym("player", "install")
    line = lines(er_gym("doctor")[1])
    assert "installed as CloudRendering" in line["player"]
    assert "build missing, Vulkan found" in line["Unity build"]
    assert "er-gym player uninstall" in line["Unity build"]


def test_doctor_finds_a_build_that_can_run(er_gym, monkeypatch):
    monkeypatch.setattr("ctypes.util.find_library", lambda name: f"lib{name}.so.1")
    Release().folder.mkdir(parents=True)
    assert lines(er_gym("doctor")[1])["Unity build"].startswith("ok ")


def test_doctor_fails_where_er_gym_does(er_gym, monkeypatch):
    def broken(**arguments):
        raise OSError("no room")

    monkeypatch.setattr(doctor, "make_controller", broken)
    code, out, _ = er_gym("doctor")
    assert code == 1
    assert "--  embedded engine" in out
    assert "no room" in out


def test_a_gpu_is_named(er_gym, monkeypatch, home):
    program = home / "bin" / "nvidia-smi"
    program.parent.mkdir()
    program.write_text("#!/bin/sh\necho 'Tesla K80, 11441 MiB'\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(program.parent), prepend=":")
    assert "Tesla K80" in lines(er_gym("doctor")[1])["GPU"]
    program.write_text("#!/bin/sh\nexit 9\n")
    assert lines(er_gym("doctor")[1])["GPU"].startswith("--")


def test_extras_are_those_of_the_project(repository: Path):
    tomllib = pytest.importorskip("tomllib")  # Python 3.11
    project = tomllib.loads((repository / "pyproject.toml").read_text())["project"]
    for extra, packages in doctor.EXTRAS.items():
        wanted = project["optional-dependencies"][extra]
        names = [name.split(">")[0].split("=")[0] for name in wanted]
        assert [name for name in names if not name.startswith("er-gym")] == list(packages)


def test_help_imports_nothing_heavy():
    program = (
        "import sys, runpy; sys.argv = ['er-gym', 'player', '--help']\n"
        "try: runpy.run_module('benchmarks.cli', run_name='__main__')\n"
        "except SystemExit: pass\n"
        "print([name for name in ('numpy', 'ai2thor', 'gymnasium') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout.splitlines()[-1] == "[]", done.stderr
