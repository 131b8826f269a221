"""The files that ``er-gym player install`` writes to the client's folder, and those it keeps."""

from __future__ import annotations

import itertools
import json
import os
import subprocess
import sys
import traceback
from collections.abc import Callable
from pathlib import Path

import pytest
from ai2thor.platform import Linux64, Request

from er_gym.thor import BackendError, client_hook, make_controller
from er_gym.thor import player_install as players
from er_gym.thor.client_folder import GpuMapping, Release

RELEASES = players.RELEASES


@pytest.fixture(autouse=True)
def home(monkeypatch, tmp_path):
    home = tmp_path / "home"
    home.mkdir()
    monkeypatch.setenv("HOME", str(home))
    monkeypatch.delenv("DISPLAY", raising=False)
    return home


@pytest.fixture(autouse=True)
def packages(monkeypatch, tmp_path):
    """Where hooks go: not into this Python's own packages."""
    folder = tmp_path / "packages"
    folder.mkdir()
    monkeypatch.setattr(players, "hook_folders", lambda python: [folder])
    return folder


def files(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def put_unity(release: Release) -> None:
    release.path.mkdir(parents=True)
    release.executable.write_text(f"Unity for {release.platform}")


def put_mapping(text: str) -> None:
    GpuMapping().path.parent.mkdir(exist_ok=True)
    GpuMapping().path.write_text(text)


# -- what is there afterwards ----------------------------------------------------------------------


def test_twice_is_as_good_as_once_and_uninstall_leaves_nothing(home, packages):
    players.install()
    once = files(home)
    installed = players.install()
    assert files(home) == once
    assert [release.platform for release in installed.releases] == ["Linux64", "CloudRendering"]
    for release in installed.releases:
        assert os.access(release.executable, os.X_OK)
        assert json.loads((release.path / "metadata.json").read_text()) == {
            "server_types": ["FIFO", "WSGI"]
        }
    assert players.uninstall() == ()
    assert list(home.iterdir()) == list(packages.iterdir()) == []


def test_what_an_older_er_gym_installed_is_renewed(home):
    """CloudRendering alone, FIFO alone, neither a hook nor a mapping."""
    old = Release("CloudRendering")
    put_unity(old)
    (old.path / client_hook.MARKER).write_text('{"python": "/usr/bin/python3"}\n')
    (old.path / "metadata.json").write_text('{"server_types": ["FIFO"]}\n')
    players.install()
    assert "WSGI" in (old.path / "metadata.json").read_text()
    players.uninstall()
    assert files(home) == {}


def test_an_older_er_gyms_installation_can_be_uninstalled(home):
    old = Release("CloudRendering")
    put_unity(old)
    (old.path / client_hook.MARKER).write_text("{}")
    players.uninstall()
    assert files(home) == {}


# -- what is somebody else's -----------------------------------------------------------------------


@pytest.mark.parametrize("there", [RELEASES[:1], RELEASES[1:], RELEASES])
def test_a_real_build_is_not_touched_without_being_told(home, packages, there):
    for release in there:
        put_unity(release)
    before = files(home)
    with pytest.raises(players.PlayerError, match="--force"):
        players.install()
    with pytest.raises(players.PlayerError, match=r"installed nothing .* other builds are"):
        players.uninstall()
    assert files(home) == before
    assert list(packages.iterdir()) == []
    players.install(force=True)
    assert all(release.is_ours and not release.is_unity for release in RELEASES)
    assert players.uninstall() == there
    assert files(home) == before


def test_a_build_that_is_set_aside_is_never_written_over(home):
    put_unity(RELEASES[0])
    players.install(force=True)
    (RELEASES[0].path / client_hook.MARKER).unlink()  # the client has fetched the build again
    before = files(home)
    with pytest.raises(players.PlayerError, match="set aside already"):
        players.install(force=True)
    assert files(home) == before


@pytest.mark.parametrize(
    "text", ['{"0": 1, "1": 0}', "{}", "[]", "no JSON", '{"GPU": 7}', '{"0": ']
)
def test_a_mapping_of_the_users_own_comes_back_as_it_was(home, text):
    put_mapping(text)
    players.install()
    players.install()
    devices = {int(k): v for k, v in json.loads(GpuMapping().path.read_text()).items()}
    assert [devices[number] for number in (0, 1, 2, 255)] == (
        [1, 0, 2, 255] if "1" in text else [0, 1, 2, 255]
    )
    players.uninstall()
    assert files(home) == {".ai2thor/cuda-vulkan-mapping.json": text.encode()}


def test_a_mapping_that_is_changed_afterwards_stays(home):
    put_mapping('{"0": 1}')
    players.install()
    put_mapping('{"0": 5}')
    with pytest.raises(players.PlayerError, match="set aside already"):
        players.install()
    players.uninstall()
    assert GpuMapping().path.read_text() == '{"0": 5}'
    assert GpuMapping().set_aside.read_text() == '{"0": 1}'


def test_a_mapping_that_is_a_link_comes_back_as_one(home):
    put_mapping("")
    GpuMapping().path.unlink()
    GpuMapping().path.symlink_to("elsewhere.json")  # beside it; nothing is there
    players.install()
    players.uninstall()
    assert os.readlink(GpuMapping().path) == "elsewhere.json"


def killed_at(turn: int, act: Callable[[], object]) -> bool:
    """Do it in a process that is killed before its nth change of a name on the disk; whether it
    was, or had ended by then."""
    child = os.fork()
    if child == 0:
        calls = itertools.count(1)
        for name in ("rename", "replace", "unlink", "mkdir", "rmdir"):
            change = getattr(os, name)

            def counted(*arguments, _change=change, **named):
                if next(calls) == turn:
                    os._exit(9)  # as at a kill, nothing is tidied up
                return _change(*arguments, **named)

            setattr(os, name, counted)
        try:
            act()
            os._exit(0)
        except BaseException:
            traceback.print_exc()
            os._exit(1)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    assert code in (0, 9)
    return code == 9


@pytest.mark.parametrize("act", ["install", "uninstall"])
def test_a_kill_loses_nothing(home, packages, act):
    """Whenever it comes; uninstall then restores all that was there."""
    acts = {"install": lambda: players.install(force=True), "uninstall": players.uninstall}
    put_mapping('{"0": 1}')
    for release in RELEASES:
        put_unity(release)
    before = files(home)
    for turn in itertools.count(1):
        if act == "uninstall":
            players.install(force=True)
        killed = killed_at(turn, acts[act])
        kept = files(home)
        assert all(content in kept.values() for content in before.values()), turn
        if not killed:
            break
        if kept != before or list(packages.iterdir()):
            players.uninstall()
        assert files(home) == before, turn
        assert list(packages.iterdir()) == []
    assert turn > 15


def test_a_kill_does_not_hinder_the_next_install(home):
    turn = 0
    while killed_at(turn := turn + 1, players.install):
        players.install()
        assert all(release.is_ours for release in RELEASES)
        assert GpuMapping().is_ours
        players.uninstall()
        assert files(home) == {}


# -- where it cannot be ----------------------------------------------------------------------------


def test_uninstalling_nothing_says_so(home):
    with pytest.raises(players.PlayerError, match="nothing"):
        players.uninstall()
    assert list(home.iterdir()) == []


def test_a_home_whose_path_the_client_would_split_is_refused(monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path / "two words"))
    with pytest.raises(players.PlayerError, match="splits the path"):
        players.install()
    assert not (tmp_path / "two words").exists()


def test_a_home_that_cannot_be_written_is_named(monkeypatch, home):
    (home / "file").touch()
    monkeypatch.setenv("HOME", str(home / "file"))
    with pytest.raises(players.PlayerError, match="HOME") as caught:
        players.install()
    assert "file" in str(caught.value)
    with pytest.raises(players.PlayerError, match="nothing"):
        players.uninstall()


def test_packages_that_cannot_be_written_are_done_without(monkeypatch, tmp_path):
    (tmp_path / "file").touch()
    monkeypatch.setattr(players, "hook_folders", lambda python: [tmp_path / "file" / "packages"])
    assert players.install().hook is None
    players.uninstall()


def test_anothers_hook_in_the_same_environment_is_used_and_left(monkeypatch, home, packages):
    players.install()
    theirs = files(packages)
    monkeypatch.setenv("HOME", str(home.parent))
    assert players.install().hook is not None
    players.uninstall()
    assert files(packages) == theirs


@pytest.mark.parametrize(
    ("client", "words"),
    [
        (None, "cannot import ai2thor"),
        ("COMMIT_ID = 'abc'", "starts the build abc"),
        ("1 / 0", "cannot import ai2thor"),
    ],
)
def test_a_python_with_another_client_is_refused(home, monkeypatch, tmp_path, client, words):
    monkeypatch.undo()
    monkeypatch.setenv("HOME", str(home))
    packages = tmp_path / "theirs" / "ai2thor"
    packages.mkdir(parents=True)
    if client is not None:
        (packages / "__init__.py").touch()
        (packages / "_builds.py").write_text(client)
    python = tmp_path / "python"
    python.write_text(
        f'#!/bin/sh\nexport PYTHONPATH={packages.parent}\nexec {sys.executable} -S "$@"\n'
    )
    python.chmod(0o755)
    with pytest.raises(players.PlayerError, match=words) as caught:
        players.install(python=str(python))
    assert "pip install ai2thor==5.0.0" in str(caught.value)
    assert "\n" not in str(caught.value)
    assert files(home) == {}


def test_builds_that_the_client_will_delete_are_named(home):
    for age, name in enumerate(("newest", "older", "oldest")):
        build = RELEASES[0].path.parent / name
        build.mkdir(parents=True)
        os.utime(build, (1e9 - age, 1e9 - age))
    assert [path.name for path in players.install().pruned] == ["oldest", "older"]


def test_unity_is_not_the_embedded_engine_under_another_name():
    players.install()
    for platform in ({}, {"platform": "Linux64"}, {"platform": Linux64}):
        with pytest.raises(BackendError, match="er-gym player uninstall"):
            make_controller("unity", scene="FloorPlan1", **platform)


# -- the hook --------------------------------------------------------------------------------------


def test_the_hook_adapts_a_client_of_another_make(packages, monkeypatch, tmp_path):
    """Other versions of the client have other platforms, and no release of ours."""
    client = tmp_path / "client" / "ai2thor"
    client.mkdir(parents=True)
    (client / "__init__.py").touch()
    (client / "_builds.py").write_text("COMMIT_ID = 'other'\n")
    (client / "platform.py").write_text(
        "class Linux64:\n"
        "    @classmethod\n"
        "    def validate(cls, request): return ['no display']\n"
        "    @classmethod\n"
        "    def launch_env(cls, width, height, x_display): return {'DISPLAY': x_display}\n"
    )
    players.install()
    program = (
        f"import sys; sys.path[:0] = [{str(packages)!r}, {str(client.parent)!r}]\n"
        f"{(packages / 'er_gym_player_hook.pth').read_text()}"
        "from ai2thor.platform import Linux64\n"
        "print(Linux64.validate(None), Linux64.launch_env(1, 1, None))\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout == "['no display'] {'DISPLAY': None}\n", done.stderr


def test_without_the_hook_the_client_asks_for_a_display():
    """What the hook is for: were this to pass one day, the hook could go."""
    assert Linux64.validate(Request("Linux", 300, 300, ":99", False))


def test_the_hook_costs_next_to_nothing_when_python_starts(packages):
    players.install()
    program = (
        f"import sys; sys.path.insert(0, {str(packages)!r}); before = set(sys.modules)\n"
        f"{(packages / 'er_gym_player_hook.pth').read_text()}"
        "print(sorted(set(sys.modules) - before - {'__future__'}))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout == "['er_gym_player_hook']\n", done.stderr
