"""Panda3D without a window: draws triangles into colour, instance and depth images.

It draws on the CPU with Panda3D's software rasteriser. On a GPU with EGL it can use OpenGL with the
same scene graph, if :func:`use_device` asks for it.

A process has one engine and one buffer. Code that changes or draws a scene graph holds
:data:`DRAWING`. A picture depends on the scene graph alone. Of surfaces at the same depth the one
drawn first is seen, so the graph itself defines the order of drawing. The instance ids are drawn
together with the colours, as the alpha channel, so there are at most :data:`MOST_INSTANCES` of
them. Panda's frame is right-handed with z up: our x, y and z are its x, z and y.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from math import atan, degrees, radians, tan
from threading import RLock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.render.camera import Camera
from er_gym.sim.render.libx11 import provide_libx11
from er_gym.sim.render.materials import MATERIALS
from er_gym.sim.render.pieces import Piece
from er_gym.sim.render.textures import texture, veil

NEAR, FAR = 0.1, 40.0
"""The near and the far plane, metres from the camera."""
SMALLEST_FOV = 1e-3
"""Degrees. AI2-THOR takes any field of view above 0, but a smaller one makes Panda's lens NaN."""
MOST_INSTANCES = 254
DEVICES = {
    "cpu": ("p3tinydisplay", "TinyOffscreenGraphicsPipe"),
    "gpu": ("p3headlessgl", "eglGraphicsPipe"),
}
"""The devices that can draw: Panda3D's module, and the pipe in it."""
_CONFIGURATION = """
load-display {module}
audio-library-name null
window-type offscreen
notify-level error
textures-power-2 down
garbage-collect-states 0
uniquify-transforms 0
bounds-type box
transform-cache 0
"""
"""Panda would otherwise merge transforms that are nearly equal and keep the older one, and find
fewer things to be out of sight, since most are no balls."""
DRAWING = RLock()
"""The lock for making, changing or drawing a scene graph: all threads share Panda's objects."""
_GPU_SHIFT = 0.25
"""How far right and down OpenGL's pictures lie of the software rasteriser's, pixels. It rounds
corners to whole pixels; this shift, found by trying, makes most pixels show the same instance."""
_DEPTH_STEPS = float(1 << 20)
_NO_IDS = np.empty((0, 0), np.uint8)


@dataclass(frozen=True, eq=False)
class Frames:
    """The images of a camera, top row first.

    Attributes:
        rgb: (H, W, 3) uint8.
        ids: (H, W) uint8 number of the instance, 0 for none; empty unless asked for.
        depth: (H, W) float32 metres along the view axis, None unless asked for.
    """

    rgb: NDArray[np.uint8]
    ids: NDArray[np.uint8]
    depth: NDArray[np.float32] | None


class RenderDeviceError(RuntimeError):
    """The device cannot draw. The message says why and what to do."""


_chosen: list[str] = []


def use_device(name: str) -> None:
    """Choose the device of this process, "cpu" (the default) or "gpu", before anything is drawn.

    Raises:
        ValueError: there is no such device.
        RenderDeviceError: this process already draws with another one.
    """
    if name not in DEVICES:
        raise ValueError(f"unknown render_device {name!r}; choose one of: {', '.join(DEVICES)}")
    if not _chosen:
        _chosen.append(name)
    if _chosen != [name]:
        raise RenderDeviceError(
            f"this process draws with the {_chosen[0]} already; use the {name} in another process"
        )


def _device() -> str:
    return _chosen[0] if _chosen else "cpu"


@cache
def core() -> Any:
    """The module ``panda3d.core``, configured to need neither a window nor a settings file."""
    use_device(_device())
    if _device() == "cpu":
        provide_libx11()
    from panda3d import core as module

    module.loadPrcFileData("er-gym", _CONFIGURATION.format(module=DEVICES[_device()][0]))
    # Panda would sort opaque nodes by the addresses of their states.
    bins = module.CullBinManager.getGlobalPtr()
    bins.setBinType(bins.findBin("opaque"), module.CullBinManager.BTFixed)
    return module


def _pipe() -> Any:
    selection, wanted = core().GraphicsPipeSelection.getGlobalPtr(), DEVICES[_device()][1]
    kinds = {kind.getName(): kind for kind in selection.getPipeTypes()}
    pipe = selection.makePipe(kinds[wanted]) if wanted in kinds else None
    if pipe is None or not pipe.isValid():
        raise RenderDeviceError(
            f"render_device={_device()!r} cannot draw here: Panda3D's {wanted} does not start. "
            "The gpu needs a driver with EGL; render_device='cpu' needs nothing."
        )
    return pipe


class Rasteriser:
    """A buffer to draw into; use :func:`rasteriser`. Each picture may have another size."""

    def __init__(self) -> None:
        p3d, pipe = core(), _pipe()
        self._engine = p3d.GraphicsEngine(pipe)
        wanted = p3d.FrameBufferProperties()
        wanted.setRgbColor(True)
        wanted.setRgbaBits(8, 8, 8, 8)
        wanted.setDepthBits(24)
        # Resizeable, because the software rasteriser never frees the memory of a buffer.
        flags = p3d.GraphicsPipe.BFRefuseWindow | p3d.GraphicsPipe.BFResizeable
        size = p3d.WindowProperties.size(300, 300)
        self._buffer = self._engine.makeOutput(pipe, "frames", 0, wanted, size, flags)
        if self._buffer is None:
            raise RenderDeviceError(f"the {_device()} makes no buffer to draw into")
        self._size = (300, 300)
        self._picture = p3d.Texture()
        self._buffer.addRenderTexture(
            self._picture, p3d.GraphicsOutput.RTMCopyRam, p3d.GraphicsOutput.RTPColor
        )
        self._steps = None  # the depth image; the software rasteriser has another way
        if _device() == "gpu":
            self._steps = p3d.Texture()
            self._steps.setFormat(p3d.Texture.FDepthComponent)
            self._buffer.addRenderTexture(
                self._steps, p3d.GraphicsOutput.RTMTriggeredCopyRam, p3d.GraphicsOutput.RTPDepth
            )
        self._buffer.setClearColorActive(True)
        self._buffer.setClearColor(p3d.LColor(0.0, 0.0, 0.0, 0.0))
        self._pinhole, self._orthographic = p3d.PerspectiveLens(), p3d.OrthographicLens()
        for lens in (self._pinhole, self._orthographic):
            lens.setNearFar(NEAR, FAR)
        self._camera = p3d.NodePath(p3d.Camera("camera", self._pinhole))
        self._room = self._buffer.makeDisplayRegion()
        self._room.setCamera(self._camera)
        # Shadows have a pass of their own, since they write depths: the software rasteriser draws
        # the pixels on the edge between two triangles with both, and would darken them twice.
        self._veils = p3d.NodePath(p3d.Camera("veils", self._pinhole))
        self._over = self._buffer.makeDisplayRegion()
        self._over.setSort(1)
        self._over.setCamera(self._veils)
        self._show_depth = p3d.ConfigVariableBool("td-show-zbuffer", False)

    def draw(
        self,
        root: Any,
        camera: Camera,
        depth: bool = False,
        *,
        ids: bool = True,
        veils: Any = None,
    ) -> Frames:
        """The images of a camera in a scene graph; the caller owns the arrays.

        Args:
            veils: a graph of shadows to draw over it; they have neither an instance nor a depth.
                With both these and depths, everything is drawn twice.
        """
        with DRAWING:
            width, height = camera.width, camera.height
            if (width, height) != self._size:
                self._size = (0, 0)  # the size is unknown if the next line is interrupted
                self._buffer.setSize(width, height)
                self._size = (width, height)
            lens = self._set_lens(camera)
            x, y, z = (float(value) for value in camera.position)
            # Not a node of the graph: moving it there would compute the graph's bounds again.
            self._camera.node().setScene(root)
            self._camera.setPosHpr(x, z, y, -camera.yaw, -camera.horizon, -camera.roll)
            self._over.setActive(False)
            measured = None
            self._show_depth.setValue(depth)
            if self._steps is not None:
                shift, film = _GPU_SHIFT, lens.getFilmSize()
                lens.setFilmOffset(shift * film[0] / width, -shift * film[1] / height)
            if depth:
                if self._steps is not None:
                    self._buffer.triggerCopy()
                self._engine.renderFrame()
                measured = self._depth(width, height, lens is self._orthographic)
                self._show_depth.setValue(False)
            if veils is not None:
                self._veils.node().setScene(veils)
                self._veils.setTransform(self._camera.getTransform())
                self._over.setActive(True)
            if veils is not None or not depth:
                self._engine.renderFrame()
            pixels = np.frombuffer(self._picture.getRamImage(), np.uint8)
            pixels = pixels.reshape(height, width, 4)[::-1]
            rgb = np.empty((height, width, 3), dtype=np.uint8)
            for channel in range(3):  # faster than all channels at once
                rgb[..., channel] = pixels[..., 2 - channel]
            seen = pixels[..., 3].copy() if ids else _NO_IDS
            return Frames(rgb, seen, measured)

    def _set_lens(self, camera: Camera) -> Any:
        """Give both passes the lens of a camera."""
        aspect, size = camera.width / camera.height, camera.orthographic_size
        lens = self._pinhole if size is None else self._orthographic
        if size is None:
            fov = max(camera.fov, SMALLEST_FOV)
            half = tan(radians(fov) / 2)
            lens.setFov(2 * degrees(atan(half * aspect)), fov)
        else:
            lens.setFilmSize(2 * size * aspect, 2 * size)
        for path in (self._camera, self._veils):
            if path.node().getLens() != lens:
                path.node().setLens(lens)
        return lens

    def _depth(self, width: int, height: int, orthographic: bool) -> NDArray[np.float32]:
        if self._steps is None:  # 0 is far, 2**20 is near
            raw = np.frombuffer(self._buffer.getScreenshot().getRamImage(), np.uint32)
            found = raw.astype(np.float32)
            found *= np.float32((FAR - NEAR) / _DEPTH_STEPS)
        else:  # 0 is near, 1 is far
            found = 1.0 - np.frombuffer(self._steps.getRamImage(), np.float32)
            found *= np.float32(FAR - NEAR)
        if orthographic:  # their steps are equal, those of a pinhole camera finer nearby
            np.subtract(np.float32(FAR), found, out=found)
        else:
            found += np.float32(NEAR)
            np.divide(np.float32(NEAR * FAR), found, out=found)
        return np.asarray(found.reshape(height, width)[::-1], dtype=np.float32)


@cache
def rasteriser() -> Rasteriser:
    """The rasteriser of this process."""
    return Rasteriser()


@cache
def _texture(name: str) -> Any:
    return _uploaded(name, texture(name), core().Texture.FRgb)


@cache
def _veil() -> Any:
    alpha = veil()
    white = np.full((*alpha.shape, 3), 255, np.uint8)
    return _uploaded("veil", np.dstack([alpha, white]), core().Texture.FRgba)


def _uploaded(name: str, picture: NDArray[np.uint8], form: int) -> Any:
    """A texture of a picture, top row first; the channels are red, green and blue, or alpha first.

    Panda3D wants the bottom row first and the channels the other way round.
    """
    p3d = core()
    found = p3d.Texture(name)
    found.setup2dTexture(picture.shape[1], picture.shape[0], p3d.Texture.TUnsignedByte, form)
    found.setRamImage(np.ascontiguousarray(picture[::-1, :, ::-1]).tobytes())
    found.setMinfilter(p3d.SamplerState.FTNearestMipmapNearest)
    found.setMagfilter(p3d.SamplerState.FTNearest)
    return found


@cache
def state(material: str) -> Any:
    """The render state of a material."""
    p3d, surface = core(), MATERIALS[material]
    # Draw one material after another, and within each in the order of the graph.
    order = p3d.CullBinAttrib.make("opaque", list(MATERIALS).index(material))
    if surface.veil:
        return p3d.RenderState.make(
            p3d.TransparencyAttrib.make(p3d.TransparencyAttrib.MAlpha),
            p3d.ColorWriteAttrib.make(7),
            p3d.TextureAttrib.make(_veil()),
            p3d.ColorAttrib.makeVertex(),
        ).addAttrib(order)
    if surface.glass:
        return p3d.RenderState.make(
            p3d.TransparencyAttrib.make(p3d.TransparencyAttrib.MAlpha),
            p3d.ColorWriteAttrib.make(7),  # colours only: the instance behind stays
            p3d.DepthWriteAttrib.make(p3d.DepthWriteAttrib.MOff),
            p3d.ColorAttrib.makeFlat(p3d.LColor(0.75, 0.9, 0.95, 0.22)),
        )
    colours = p3d.ColorAttrib.makeVertex()
    if surface.texture is None:
        return p3d.RenderState.make(colours, order)
    return p3d.RenderState.make(p3d.TextureAttrib.make(_texture(surface.texture)), colours, order)


def geometry(pieces: Iterable[Piece], number: int, name: str) -> Any:
    """A node that draws pieces as instance ``number`` (0: none)."""
    if number > MOST_INSTANCES:
        raise ValueError(f"there can be {MOST_INSTANCES} instances, not {number}")
    p3d = core()
    node = p3d.GeomNode(name)
    for piece in pieces:
        # With a texture, the software rasteriser lowers each alpha by 1.
        textured = MATERIALS[piece.material].texture is not None and _device() == "cpu"
        rows = piece.vertices.copy()
        if not MATERIALS[piece.material].veil:
            rows["colour"][:, 3] = number + (1 if textured and number else 0)
        data = p3d.GeomVertexData(name, p3d.GeomVertexFormat.getV3c4t2(), p3d.Geom.UHStatic)
        data.uncleanSetNumRows(len(rows))
        data.modifyArrayHandle(0).copyDataFrom(rows.tobytes())
        wide = piece.triangles.dtype == np.uint32
        primitive = p3d.GeomTriangles(p3d.Geom.UHStatic)
        primitive.setIndexType(p3d.Geom.NTUint32 if wide else p3d.Geom.NTUint16)
        # Panda's frame is right-handed, so mirrored triangles go round the other way.
        array = primitive.modifyVertices()
        array.uncleanSetNumRows(piece.triangles.size)
        array.modifyHandle().copyDataFrom(piece.triangles.tobytes())
        geom = p3d.Geom(data)
        geom.addPrimitive(primitive)
        node.addGeom(geom, state(piece.material))
    return node
