from __future__ import annotations

import ctypes
import shutil
import struct
import subprocess
import sys
from pathlib import Path

import pytest

from er_gym.sim.render import libx11

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="other systems need no libX11")
NAMES = ("XOpenDisplay", "XFree", "_XPrivate")
DRAW = """
import sys
from er_gym import shared_library
from er_gym.sim.render import libx11
libx11._SONAME = "libZ11.so.6"
BEFORE
from er_gym.sim.render.camera import Camera
from er_gym.sim.render.panda import core, geometry, rasteriser
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.pieces import pieces_of
assert core().__file__.startswith(sys.argv[1]), core().__file__
mesh = Mesh()
mesh.box((0, 0, 3), (1, 1, 1), (1, 0, 0))
root = core().NodePath("root")
root.attachNewNode(geometry(pieces_of(mesh.patches()), 7, "box"))
frames = rasteriser().draw(root, Camera((0, 0, 0), 0, 0, 90, 64, 64))
assert frames.ids[32, 32] == 7 and frames.rgb[32, 32].tolist() == [255, 0, 0]
mapped = {line.split()[-1] for line in open("/proc/self/maps") if "libp3tinydisplay" in line}
assert mapped == {sys.argv[1] + "/panda3d/libp3tinydisplay.so"}, mapped
print("drawn")
"""


def rasteriser() -> Path:
    found = libx11._rasteriser()
    if found is None:
        pytest.skip("this Panda3D is not the wheel")
    return found


def test_the_wheel_wants_functions_of_x_and_nothing_else() -> None:
    machine, names = libx11.wanted_symbols(rasteriser())
    assert machine in libx11._RETURN_0
    assert {"XOpenDisplay", "XCreateWindow", "XkbKeycodeToKeysym"} <= set(names)
    assert all(name.startswith("X") for name in names)


def test_what_is_no_library_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "no.so"
    path.write_bytes(b"#!/bin/sh\n")
    with pytest.raises(ImportError, match="ELF"):
        libx11.wanted_symbols(path)


def test_all_functions_of_the_stand_in_return_0(tmp_path: Path) -> None:
    machine, names = libx11.wanted_symbols(rasteriser())
    path = tmp_path / "libQ11.so.6"
    path.write_bytes(libx11.stand_in(path.name, names, machine))
    library = ctypes.CDLL(str(path))
    assert [getattr(library, name)(1, 2, 3) for name in names] == [0] * len(names)
    with pytest.raises(AttributeError):
        _ = library.XNoSuchFunction


@pytest.mark.parametrize("machine", sorted(libx11._RETURN_0))
def test_nothing_is_both_written_to_and_executed(machine: int) -> None:
    content = libx11.stand_in("libX11.so.6", NAMES, machine)
    assert struct.unpack_from("<H", content, 18) == (machine,)
    segments = [struct.unpack_from("<IIQQQQQQ", content, 64 + 56 * k) for k in range(4)]
    assert all(flags & 3 != 3 for _, flags, *_ in segments)
    stack = [flags for kind, flags, *_ in segments if kind == libx11._STACK]
    assert stack == [6]
    for kind, _, offset, address, _, size, _, align in segments:
        if kind == libx11._LOAD:
            assert (address - offset) % align == 0
            assert offset + size <= len(content)


def test_where_libx11_is_installed_nothing_is_loaded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(libx11, "load", lambda name: name if name == "libX11.so.6" else None)
    monkeypatch.setattr(libx11, "wanted_symbols", lambda path: pytest.fail("looked for a stand-in"))
    libx11.provide_libx11()


def test_a_system_that_loads_no_stand_in_is_told_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rasteriser()
    monkeypatch.setattr(libx11, "load", lambda name: None)
    monkeypatch.setattr(libx11, "load_bytes", lambda content, name: None)
    with pytest.raises(ImportError, match="apt-get install libx11-6"):
        libx11.provide_libx11()


@pytest.fixture(scope="module")
def without_x(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a Panda3D whose rasteriser needs a libX11 that no system has."""
    wheel = rasteriser().parent
    folder = tmp_path_factory.mktemp("site")
    (folder / "panda3d").mkdir()
    for path in wheel.iterdir():
        if path.name.startswith("libp3dtool."):  # where it really is, Panda3D looks for the others
            shutil.copy(path, folder / "panda3d")
        elif path.name not in (libx11._RASTERISER, "__pycache__"):
            (folder / "panda3d" / path.name).symlink_to(path)
    content = (wheel / libx11._RASTERISER).read_bytes()
    assert content.count(b"\0libX11.so.6\0") == 1
    changed = content.replace(b"\0libX11.so.6\0", b"\0libZ11.so.6\0")
    (folder / "panda3d" / libx11._RASTERISER).write_bytes(changed)
    return folder


def draw(folder: Path, before: str) -> subprocess.CompletedProcess[str]:
    start = f"import sys; sys.path.insert(0, {str(folder)!r})"
    return subprocess.run(
        [sys.executable, "-c", start + DRAW.replace("BEFORE", before), str(folder)],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


@pytest.mark.parametrize("way", ["load_from_memory", "load_from_file"])
def test_a_picture_is_drawn_without_libx11(without_x: Path, way: str) -> None:
    done = draw(without_x, f"shared_library.{way} = lambda content, name: None")
    assert done.stdout == "drawn\n", done.stderr


def test_without_a_stand_in_nothing_could_be_drawn(without_x: Path) -> None:
    done = draw(without_x, "libx11.provide_libx11 = lambda: None")
    assert done.returncode != 0
    assert done.stdout == ""
