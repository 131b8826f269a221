"""``er-gym player`` and ``er-gym doctor`` as a user runs them."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from benchmarks.cli import doctor_checks
from benchmarks.cli import main as cli
from benchmarks.cli.extras import extras, state_of
from er_gym.integrations.plugs import PLUGS, lacks
from er_gym.thor import player_install as players
from er_gym.thor.client_folder import GpuMapping, Release


@pytest.fixture(autouse=True)
def home(monkeypatch, tmp_path):
    """A home of its own; hooks go to a folder in it, not into this Python's packages."""
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setattr(players, "hook_folders", lambda python: [tmp_path / "packages"])
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


# -- player ----------------------------------------------------------------------------------------


def test_path_prints_a_program(er_gym):
    code, out, _ = er_gym("player", "path")
    assert code == 0
    assert subprocess.run([out.strip()], capture_output=True).returncode == 2


def test_install_says_what_it_has_put_where(er_gym, home):
    code, out, _ = er_gym("player", "install")
    assert code == 0
    for release in players.RELEASES:
        assert f"{release.platform}: {release.path}\n" in out
    assert "ai2thor 5.0.0, commit_id f082576" in out
    assert f"hook: {home / 'packages'}" in out
    assert "three builds" not in out
    assert er_gym("player", "uninstall")[0] == 0
    assert not any(release.path.exists() for release in players.RELEASES)


def test_install_says_what_it_could_not_do_and_what_the_client_will(er_gym, monkeypatch, home):
    (home / "file").touch()
    monkeypatch.setattr(players, "hook_folders", lambda python: [home / "file" / "packages"])
    for name in ("one", "two"):
        (Release().path.parent / name).mkdir(parents=True)
        os.utime(Release().path.parent / name, (1, 1))
    out = er_gym("player", "install")[1]
    assert "er-gym doctor says what to do" in out
    assert out.count("it deletes") == 1


def test_a_real_build_is_kept_unless_forced(er_gym):
    release = Release("Linux64")
    release.path.mkdir(parents=True)
    code, out, err = er_gym("player", "install")
    assert (code, out) == (2, "")
    assert "--force" in err
    assert err.count("\n") == 1
    assert er_gym("player", "install", "--force")[0] == 0
    assert release.is_ours
    assert f"Unity's build is there again: {release.path}" in er_gym("player", "uninstall")[1]
    assert release.is_unity


def test_what_cannot_come_back_is_named(er_gym):
    mapping = GpuMapping()
    mapping.path.parent.mkdir()
    for text in ('{"0": 1}', '{"0": 2}'):
        mapping.path.write_text(text)
        if "1" in text:
            er_gym("player", "install")
    assert str(mapping.set_aside) in er_gym("player", "uninstall")[1]


def test_uninstalling_nothing_is_bad_input(er_gym):
    code, _, err = er_gym("player", "uninstall")
    assert code == 2
    assert "nothing" in err


# -- doctor ----------------------------------------------------------------------------------------


PROGRAMS = ["Controller(scene=…)", "platform=CloudRendering", "gpu_device=…"]


def lines(out: str) -> dict[str, str]:
    """A part's name to its whole line."""
    parts = [
        "embedded engine",
        "renderer",
        "compiled kernel",
        "player",
        *PROGRAMS,
        "Unity build",
        "GPU",
        "memory allocator",
    ]
    parts += ["package agents", "package benchmarks", "package cv2"]
    parts += [f"extra {name}" for name in extras()]
    parts += [f"plug {plug.name}" for plug in PLUGS]
    found = {
        part: line for line in out.splitlines() for part in parts if line[4:].startswith(f"{part} ")
    }
    assert list(found) == parts
    assert len(out.splitlines()) == len(parts)
    return found


@pytest.fixture
def the_client(monkeypatch):
    """Says what AI2-THOR's client misses; tests/programs has doctor ask the client itself."""

    def misses(*what: str) -> None:
        missing = {platform: list(what) for platform in ("Linux64", "CloudRendering")}
        monkeypatch.setattr(doctor_checks, "_missing_for_client", lambda: missing)
        monkeypatch.setattr(
            doctor_checks, "find_library", lambda name: None if what else f"lib{name}.so"
        )

    return misses


def left_in(home):
    """What a look at the machine has left there, beside the engine's cache."""
    return [path.name for path in home.iterdir() if path.name != ".cache"]


def test_commands_that_only_look_leave_nothing_at_home(er_gym, home):
    for words in (("envs",), ("zoo",), ("tasks", "show", "mini"), ("--version",)):
        assert er_gym(*words)[0] == 0
    assert left_in(home) == []


def test_doctor_has_a_line_for_each_part(er_gym, the_client, home):
    the_client("all sorts of things")
    code, out, err = er_gym("doctor")
    assert (code, err) == (0, "")
    assert left_in(home) == []
    line = lines(out)
    for part in ("embedded engine", "renderer", "player"):
        assert line[part].startswith("ok ")
    for part in PROGRAMS:
        assert line[part].startswith("--")
        assert line[part].endswith("; er-gym player install")
    assert line["Unity build"].startswith("--")
    for lacking in ("build missing", "Vulkan missing", "display missing", "libvulkan1", "network"):
        assert lacking in line["Unity build"]
    assert {"rl", "trl", "vlm", "local", "inspect", "charts", "match", "all"} <= set(extras())
    for name in extras():
        state = state_of(name)
        assert line[f"extra {name}"].startswith("ok " if state.complete else "--")
        assert all(f"{each} missing" in line[f"extra {name}"] for each in state.missing)
        if state.missing:
            assert line[f"extra {name}"].endswith(f"; pip install 'er-gym[{name}]'")
    for plug in PLUGS:
        problems = ", ".join(lacks(plug))
        assert line[f"plug {plug.name}"].startswith("--" if problems else "ok ")
        assert (f"  {problems}; {plug.install}" if problems else plug.page) in line[
            f"plug {plug.name}"
        ]


@pytest.mark.parametrize(
    ("loaded", "works", "told"),
    [
        ("/lib/libc.so.6\n/usr/lib/libtcmalloc_minimal.so.4.5.10", True, "TCMalloc"),
        ("/lib/libc.so.6", False, "LD_PRELOAD=libtcmalloc_minimal.so.4"),
    ],
)
def test_doctor_says_whether_tcmalloc_is_loaded(monkeypatch, loaded, works, told):
    monkeypatch.setattr(doctor_checks, "_loaded_libraries", lambda: loaded)
    (check,) = doctor_checks._memory_allocator()
    assert check.works == works
    assert told in f"{check.detail}; {check.fix}"


def test_doctor_says_nothing_of_memory_where_it_cannot_tell(monkeypatch):
    monkeypatch.setattr(doctor_checks, "_loaded_libraries", lambda: "")
    assert list(doctor_checks._memory_allocator()) == []


def test_doctor_tells_the_player_from_unity(er_gym, the_client):
    the_client()
    er_gym("player", "install")
    line = lines(er_gym("doctor")[1])
    for part in PROGRAMS:
        assert line[part].startswith("ok ")
    assert "starts the player; ai2thor 5.0.0, commit_id f082576" in line["Controller(scene=…)"]
    assert "build missing, Vulkan found" in line["Unity build"]
    assert "er-gym player uninstall" in line["Unity build"]


def test_doctor_says_what_the_client_wants_beside_the_player(er_gym, the_client):
    the_client("No valid X display found")
    er_gym("player", "install")
    line = lines(er_gym("doctor")[1])
    for part, mend in zip(PROGRAMS, ("xvfb-run", "libvulkan1"), strict=False):
        assert line[part].startswith("--")
        assert "No valid X display found; er-gym player install in this Python" in line[part]
        assert mend in line[part]


def test_doctor_finds_builds_that_can_run(er_gym, the_client):
    the_client()
    for release in players.RELEASES:
        release.path.mkdir(parents=True)
    line = lines(er_gym("doctor")[1])
    assert line["Unity build"].startswith("ok ")
    for part in PROGRAMS[:2]:
        assert line[part].startswith("ok ")
        assert "Unity's build" in line[part]


def test_doctor_says_that_the_client_is_of_another_version(er_gym, the_client, monkeypatch):
    the_client()
    er_gym("player", "install")
    monkeypatch.setattr(doctor_checks, "_CLIENT", "4.3.0")
    assert "er-gym was written for 4.3.0" in lines(er_gym("doctor")[1])["Controller(scene=…)"]


def test_doctor_fails_where_er_gym_does(er_gym, monkeypatch):
    def broken(**arguments):
        raise OSError("no room")

    monkeypatch.setattr(doctor_checks, "make_controller", broken)
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


def test_doctor_says_that_er_gym_is_not_installed(monkeypatch):
    """As when the command runs from a checkout by PYTHONPATH alone."""
    monkeypatch.setattr("benchmarks.cli.extras.PROJECT", "er-gym-that-nobody-installed")
    (check,) = doctor_checks._extras()
    assert (check.part, check.works) == ("extras", False)
    assert "pip install" in check.fix


def test_help_imports_nothing_heavy():
    program = (
        "import sys, runpy; sys.argv = ['er-gym', 'player', '--help']\n"
        "try: runpy.run_module('benchmarks.cli', run_name='__main__')\n"
        "except SystemExit: pass\n"
        "print([name for name in ('numpy', 'ai2thor', 'gymnasium') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout.splitlines()[-1] == "[]", done.stderr
