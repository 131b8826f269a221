"""Measures how well objects can be told apart in the pictures.

    python -m benchmarks.checks.recognisability [--seed 0] [--epochs 10] [--json FILE]
                                                [--sheet FILE.png]

A small convolutional network learns the 40 commonest object types from crops of the pictures of 90
scenes, and is tested on crops of the 30 others. It needs torch: pip install -e '.[rl]'.

A crop is the square around an instance in a picture, with its surroundings, as a person sees it.
Half of the poses are anywhere, half look at a thing from 0.5 to 2.5 m away.
"""

from __future__ import annotations

import importlib.util
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from benchmarks.harness.output import (
    Output,
    json_option,
    print_table,
    progress,
    write_figures,
)
from benchmarks.harness.samples import sheet
from er_gym.sim.render.camera import Camera
from er_gym.sim.render.scene_graph import scene_graph_of
from er_gym.sim.scene import SCENE_NAMES, load_scene
from er_gym.sim.settings import Settings
from er_gym.sim.world import World
from er_gym.writing import write_picture

TYPES, EVERY = 40, 4
"""How many types there are to tell apart, and which share of the scenes is held out: one in so
many, of each kind of room."""
PICTURE, FIELD_OF_VIEW, SIDE = 448, 90.0, 48
"""Pixels of a picture's side, degrees, and pixels of a crop's side."""
LEAST_PIXELS, LEAST_BOX, LEAST_INSIDE = 150, 12, 0.6
"""An instance is cropped that has so many pixels, in a box with such sides, and of whose own box no
less than this share is within the picture."""
MARGIN = 0.15
"""How much of its surroundings a crop shows on each side, as a share of its longer side."""
WANDERING, LOOKING = 30, 4
"""Poses in a scene: so many anywhere, and so many that look at a thing of each type there is."""
NEAREST, FARTHEST = 0.5, 2.5
LOWEST, HIGHEST = -30.0, 45.0
"""The camera's horizon, degrees; downwards is positive."""
BATCH, RATE = 128, 4e-3


@dataclass(frozen=True, eq=False)
class Crops:
    """Labelled crops: images (N, SIDE, SIDE, 3) uint8, and the number of each one's type (N,)."""

    images: NDArray[np.uint8]
    labels: NDArray[np.int64]

    @staticmethod
    def joined(parts: Sequence[Crops]) -> Crops:
        images, labels = zip(*((part.images, part.labels) for part in parts), strict=True)
        return Crops(np.concatenate(images), np.concatenate(labels))


@dataclass(frozen=True, eq=False)
class Classification:
    """The network's predictions for the held-out crops.

    Attributes:
        types: the names of the types, by number.
        truth, said: (N,) numbers of types.
    """

    types: tuple[str, ...]
    truth: NDArray[np.int64]
    said: NDArray[np.int64]

    @property
    def top1(self) -> float:
        """The share of the crops whose type is predicted correctly."""
        return float((self.said == self.truth).mean())

    def share_correct(self, kind: int) -> float:
        """The same for the crops of one type."""
        return float((self.said[self.truth == kind] == kind).mean())

    @property
    def mean_of_types(self) -> float:
        return float(np.mean([self.share_correct(kind) for kind in self.worst_first()]))

    def worst_first(self) -> list[int]:
        return sorted(set(self.truth.tolist()), key=self.share_correct)

    def taken_for(self, kind: int) -> list[tuple[str, float]]:
        """The wrong predictions for a type and their numbers, the most frequent first."""
        said = self.said[self.truth == kind]
        wrong = Counter(said[said != kind].tolist())
        return [(self.types[other], count / len(said)) for other, count in wrong.most_common()]


# -- the crops -------------------------------------------------------------------------------------


def commonest_types() -> tuple[str, ...]:
    """The types with most objects to see in the scenes as recorded; the Floor is not asked for."""
    counts: Counter[str] = Counter()
    for name in SCENE_NAMES:
        world = World.load(load_scene(name), Settings())
        counts.update(world.types[i] for i in np.flatnonzero(~world.hidden).tolist())
    del counts["Floor"]
    return tuple(sorted(counts, key=lambda kind: (-counts[kind], kind))[:TYPES])


def split(seed: int) -> tuple[list[str], list[str]]:
    """The scenes to learn from and those held out: of each kind of room the same share."""
    random = np.random.default_rng(seed)
    kinds = np.array(SCENE_NAMES).reshape(4, -1)  # a row for each kind of room
    by_turns = np.transpose([random.permutation(kind) for kind in kinds]).ravel()
    held = set(by_turns[: len(by_turns) // EVERY].tolist())
    return [n for n in SCENE_NAMES if n not in held], [n for n in SCENE_NAMES if n in held]


def crops_of(name: str, types: Sequence[str], most: int, random: np.random.Generator) -> Crops:
    """Crops from one scene, at most so many of a type."""
    world = World.load(load_scene(name), Settings())
    number = {kind: k for k, kind in enumerate(types)}
    label = [number.get(kind, -1) for kind in world.types]
    found: dict[int, list[NDArray[np.uint8]]] = {k: [] for k in set(label) - {-1}}
    for camera in poses(world, types, random):
        frames = scene_graph_of(name).draw(world, camera)
        pixels = np.bincount(frames.ids.ravel(), minlength=len(world) + 1)[1:]
        for i in np.flatnonzero(pixels >= LEAST_PIXELS).tolist():
            if label[i] >= 0 and share_inside(camera, world.low[i], world.high[i]) >= LEAST_INSIDE:
                box = box_of(frames.ids == i + 1)
                if min(box[2:]) >= LEAST_BOX:
                    found[label[i]].append(crop(frames.rgb, box))
    kept = [(k, images[j]) for k, images in found.items()
            for j in random.permutation(len(images))[:most]]  # fmt: skip
    images = np.array([image for _, image in kept], np.uint8).reshape(-1, SIDE, SIDE, 3)
    return Crops(images, np.array([k for k, _ in kept], np.int64))


def box_of(mask: NDArray[np.bool_]) -> tuple[int, int, int, int]:
    """The box around what is True: left, top, width, height, pixels; at least one must be."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    left, top = int(columns[0]), int(rows[0])
    return left, top, int(columns[-1]) - left + 1, int(rows[-1]) - top + 1


def poses(world: World, types: Sequence[str], random: np.random.Generator) -> list[Camera]:
    """Camera poses: random ones, and some that look at objects of each type."""
    places = world.scene.reachable
    height = float(world.agent.camera[1])
    found = []
    for x, z in random.choice(places, WANDERING):
        yaw, horizon = random.uniform(0, 360), random.uniform(LOWEST, HIGHEST)
        found.append(_camera(x, height, z, yaw, horizon))
    for kind in types:
        rows = [i for i in world.of_type(kind) if not world.hidden[i]]
        for i in random.choice(rows, LOOKING) if rows else ():
            x, y, z = (world.low[i] + world.high[i]) / 2
            away = np.hypot(*(places - (x, z)).T)
            near = places[(away >= NEAREST) & (away <= FARTHEST)]
            if len(near):
                from_x, from_z = near[random.integers(len(near))]
                ahead = np.hypot(x - from_x, z - from_z)
                yaw = np.degrees(np.arctan2(x - from_x, z - from_z)) + random.normal(0, 8)
                horizon = np.degrees(np.arctan2(height - y, ahead)) + random.normal(0, 8)
                horizon = np.clip(horizon, LOWEST, HIGHEST)
                found.append(_camera(from_x, height, from_z, yaw, horizon))
    return found


def _camera(x: float, y: float, z: float, yaw: float, horizon: float) -> Camera:
    return Camera((x, y, z), float(yaw), float(horizon), FIELD_OF_VIEW, PICTURE, PICTURE)


def share_inside(camera: Camera, low: NDArray[np.float64], high: NDArray[np.float64]) -> float:
    """Of the rectangle around a box as seen, the share within the picture; 0 if it is not ahead."""
    corners = np.where(np.array(list(np.ndindex(2, 2, 2)), dtype=bool), high, low)
    x, y, depth = camera.project(corners).T
    if depth.min() <= 0.05:
        return 0.0
    whole = np.ptp(x) * np.ptp(y)
    inside = np.ptp(np.clip(x, 0, camera.width)) * np.ptp(np.clip(y, 0, camera.height))
    return float(inside / whole)


def crop(picture: NDArray[np.uint8], box: Sequence[int]) -> NDArray[np.uint8]:
    """The square around a box (left, top, width, height) and its margin, (SIDE, SIDE, 3).

    Where it leaves the picture, the picture's edge goes on.
    """
    left, top, width, height = box
    side = round(max(width, height) * (1 + 2 * MARGIN))
    left, top = left + (width - side) // 2, top + (height - side) // 2
    inside = picture[max(top, 0) : top + side, max(left, 0) : left + side]
    beyond = (
        (max(-top, 0), max(top + side - picture.shape[0], 0)),
        (max(-left, 0), max(left + side - picture.shape[1], 0)),
        (0, 0),
    )
    square = Image.fromarray(np.pad(inside, beyond, mode="edge"))
    how = Image.Resampling.BOX if side > SIDE else Image.Resampling.BILINEAR
    return np.asarray(square.resize((SIDE, SIDE), how), np.uint8)


# -- the network -----------------------------------------------------------------------------------


def train_and_classify(
    learnt: Crops, asked: Crops, classes: int, epochs: int, seed: int
) -> NDArray[np.int64]:
    """Train a network of 0.4 million weights on some crops; returns its predictions for others,
    (N,).
    """
    import torch
    import torch.nn.functional as F
    from torch import Tensor, nn

    torch.manual_seed(seed)
    torch.set_num_threads(2)

    def block(taken: int, given: int) -> nn.Sequential:  # (B, taken, S, S) -> (B, given, S/2, S/2)
        convolution = nn.Conv2d(taken, given, 3, padding=1, bias=False)
        return nn.Sequential(convolution, nn.BatchNorm2d(given), nn.ReLU(), nn.MaxPool2d(2))

    network = nn.Sequential(
        block(3, 32), block(32, 64), block(64, 128), block(128, 256),  # (B, 256, 3, 3)
        nn.AdaptiveAvgPool2d(1), nn.Flatten(), nn.Dropout(0.3), nn.Linear(256, classes),
    ).to(memory_format=torch.channels_last)  # type: ignore[call-overload]  # fmt: skip

    def prepared(images: NDArray[np.uint8]) -> Tensor:  # (B, S, S, 3) -> (B, 3, S, S) about 0
        return torch.from_numpy(images).permute(0, 3, 1, 2).float() / 64 - 2

    def varied(x: Tensor) -> Tensor:
        """Flipped, shifted by up to 8 %, zoomed by up to 12 %, brighter or darker."""
        n = len(x)
        zoom = 1 + 0.12 * (2 * torch.rand(n) - 1)
        flip = torch.randint(0, 2, (n,)) * 2 - 1
        shift = 0.16 * (2 * torch.rand(n, 2) - 1)
        none = torch.zeros(n)
        across = torch.stack([zoom * flip, none, shift[:, 0]], 1)
        down = torch.stack([none, zoom, shift[:, 1]], 1)
        grid = F.affine_grid(torch.stack([across, down], 1), list(x.shape), align_corners=False)
        x = F.grid_sample(x, grid, padding_mode="border", align_corners=False)
        light = 1 + 0.2 * (2 * torch.rand(n, 1, 1, 1) - 1)
        tint = 0.1 * torch.randn(n, 3, 1, 1)
        return ((x + 2) * light - 2 + tint).contiguous(memory_format=torch.channels_last)

    labels = torch.from_numpy(learnt.labels)
    batches = len(labels) // BATCH
    optimiser = torch.optim.AdamW(network.parameters(), lr=RATE, weight_decay=0.02)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, RATE, epochs * batches)
    for epoch in progress(range(epochs), "epochs"):
        network.train()
        total = 0.0
        for chosen in torch.randperm(len(labels))[: batches * BATCH].view(batches, BATCH):
            logits = network(varied(prepared(learnt.images[chosen.numpy()])))  # (BATCH, classes)
            loss = F.cross_entropy(logits, labels[chosen], label_smoothing=0.1)
            optimiser.zero_grad(set_to_none=True)
            loss.backward()
            optimiser.step()
            schedule.step()
            total += loss.item()
        click.echo(f"epoch {epoch + 1}: loss {total / batches:.3f}", err=True)
    network.eval()
    with torch.no_grad():
        parts = np.array_split(asked.images, max(1, len(asked.images) // 512))
        told = [network(prepared(part)).argmax(1).numpy() for part in parts]
    return np.concatenate(told)


# -- what is printed -------------------------------------------------------------------------------


def _show(result: Classification, figures: dict[str, float]) -> None:
    rows = [
        (
            result.types[kind],
            f"{result.share_correct(kind):.1%}",
            int((result.truth == kind).sum()),
            ", ".join(f"{name} {share:.0%}" for name, share in result.taken_for(kind)[:3]),
        )
        for kind in result.worst_first()[:10]
    ]
    head = ("type", "top-1", "crops", "taken for")
    print_table("types told apart in unseen scenes", head, rows)
    texts = {name: f"{x:.1%}" if x <= 1 else f"{x:.0f}" for name, x in figures.items()}
    print_table("in all; target of top-1: >= 80 %", ("figure", "value"), texts.items())


def draw_sheet(result: Classification, images: NDArray[np.uint8], file: Path) -> None:
    """A contact sheet of wrong crops, worst types first: under each its type, and the type said."""
    columns, tile = 12, 120
    pictures = []
    for kind in result.worst_first():
        wrong = np.flatnonzero((result.truth == kind) & (result.said != kind))
        for j in wrong[:: max(1, -(-len(wrong) // columns))].tolist():
            large = Image.fromarray(images[j]).resize((tile, tile), Image.Resampling.NEAREST)
            name = f"{result.types[kind]}: {result.types[result.said[j]]}"
            pictures.append((name, np.asarray(large)))
    write_picture(file, sheet(pictures, columns))


@click.command()
@click.option("--seed", default=0, show_default=True, type=click.IntRange(0))
@click.option("--epochs", default=10, show_default=True, type=click.IntRange(1))
@click.option(
    "--crops-per-scene", "most", default=8, show_default=True, type=click.IntRange(1),
    help="At most so many of a type.",
)  # fmt: skip
@json_option
@click.option("--sheet", "sheet_file", type=Output(), help="Wrong crops.")
def main(seed: int, epochs: int, most: int, file: Path | None, sheet_file: Path | None) -> None:
    """Draw crops, train the network, and print the types that it confuses."""
    if importlib.util.find_spec("torch") is None:
        raise click.ClickException("this needs torch: pip install -e '.[rl]'")
    start, parts = time.perf_counter(), dict[str, Crops]()
    types, (learning, held) = commonest_types(), split(seed)
    for name in progress(SCENE_NAMES, "scenes"):
        random = np.random.default_rng([seed, SCENE_NAMES.index(name)])
        parts[name] = crops_of(name, types, most, random)
    learnt, asked = (Crops.joined([parts[name] for name in names]) for names in (learning, held))
    drawn = time.perf_counter()
    said = train_and_classify(learnt, asked, len(types), epochs, seed)
    result = Classification(types, asked.labels, said)
    figures: dict[str, float] = {
        "top-1": result.top1,
        "top-1, mean of the types": result.mean_of_types,
        "crops for training": len(learnt.labels),
        "crops for testing": len(asked.labels),
        "seconds to draw": drawn - start,
        "seconds to train": time.perf_counter() - drawn,
    }
    _show(result, figures)
    if sheet_file is not None:
        draw_sheet(result, asked.images, sheet_file)
    told = {
        types[kind]: {
            "crops": int((result.truth == kind).sum()),
            "top-1": result.share_correct(kind),
            "taken for": dict(result.taken_for(kind)),
        }
        for kind in result.worst_first()
    }
    write_figures(file, {**figures, "types": told})


if __name__ == "__main__":
    main()
