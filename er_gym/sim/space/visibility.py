"""What an agent sees.

An object is visible when two things hold. It is no farther than the visibility distance from the
agent (see :mod:`er_gym.sim.space.outlines`). And one of its sample points is inside the camera's
frustum, with nothing between it and the camera (see :mod:`er_gym.sim.space.line_of_sight`), and no
other agent either (see :mod:`er_gym.sim.space.bodies`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.agent import Agent
from er_gym.sim.space.bodies import Body, hidden, hiding, in_sight
from er_gym.sim.space.frustum import Lens, in_frustum
from er_gym.sim.space.line_of_sight import LinesOfSight
from er_gym.sim.space.line_of_sight_builder import lines_of_sight
from er_gym.sim.space.outlines import Outlines
from er_gym.sim.space.solids import solid_of
from er_gym.sim.space.solids.sample_points import sample_points
from er_gym.sim.world import World

_FLOOR = [0, 2]


class Sight(NamedTuple):
    """A camera that looks for objects.

    Attributes:
        position: (3,) from where distances count, metres.
        camera: (3,) where it is, metres.
        lens: its directions and its picture.
        distance: the largest to an object, along the floor, metres.
        bodies: the agents that may hide things from it.
    """

    position: NDArray[np.float64]
    camera: NDArray[np.float64]
    lens: Lens
    distance: float
    bodies: tuple[Body, ...]


def visible(world: World, agent: Agent | None = None) -> NDArray[np.bool_]:
    """(N,) whether the acting agent sees each object, from its pose or from another one."""
    agent = agent or world.agent
    known, settings = lines_of_sight(world), world.settings
    lens = (
        agent.rotation,
        agent.horizon,
        settings.field_of_view,
        settings.width / settings.height,
    )
    distance, bodies = settings.visibility_distance, hiding(world)
    if bodies:
        bodies = _shown(bodies, agent.eye, lens)
    question = (*agent.position.tolist(), agent.standing, *lens, distance, *bodies)
    found = known.cached(
        question,
        lambda: _look(known, Sight(agent.position, agent.camera, lens, distance, bodies)),
    ).copy()
    held = world.in_hand
    if held:
        found[[i for i in held if not world.hidden[i]]] = True
    if world.held_elsewhere:
        found |= _carried(world, Sight(agent.position, agent.camera, lens, distance, bodies))
    return found


def seen_by(world: World, sight: Sight) -> NDArray[np.bool_]:
    """(N,) whether a camera sees each object that is not in the acting agent's hand."""
    sight = sight._replace(bodies=_shown(sight.bodies, sight.camera.tolist(), sight.lens))
    found = _look(lines_of_sight(world), sight).copy()
    if world.held_elsewhere:
        found |= _carried(world, sight)
    return found


def _shown(bodies: tuple[Body, ...], eye: Sequence[float], lens: Lens) -> tuple[Body, ...]:
    """Those of some bodies that may be in the picture: no others hide anything in it."""
    return tuple(body for body in bodies if in_sight(body, eye, lens))


def _look(known: LinesOfSight, sight: Sight) -> NDArray[np.bool_]:
    found = known.look(sight.camera, sight.lens)
    near = known.within_distance(sight.position, sight.distance)
    found = found if near is None else found & near
    return _not_behind(known, found, sight) if sight.bodies else found


def _not_behind(known: LinesOfSight, found: NDArray[np.bool_], sight: Sight) -> NDArray[np.bool_]:
    """Those of some objects that are also seen past the bodies."""
    found, camera = found.copy(), sight.camera
    behind = hidden(sight.bodies, camera[None], known.points)[0]
    for i in np.flatnonzero(found).tolist():
        first = known.first_point[i]
        own = slice(first, first + known.point_count[i])
        if behind[own].any():
            points = known.points[own]
            free = ~behind[own] & in_frustum(points - camera, *sight.lens)
            found[i] = known.unobstructed(camera[None], points[free], i).any()
    return found


def _carried(world: World, sight: Sight) -> NDArray[np.bool_]:
    """(N,) whether a camera sees each object in the hands of the agents that do not act."""
    found, known = np.zeros(len(world), dtype=bool), lines_of_sight(world)
    eye = sight.camera[None]
    for i in set(world.carried).difference(world.in_hand):
        if world.hidden[i]:
            continue
        if Outlines.of([solid_of(world, i)]).gaps(sight.position[None, _FLOOR])[0, 0] > (
            sight.distance
        ):
            continue
        points = sample_points(world, i).astype(np.float32)
        points = points[in_frustum(points - sight.camera, *sight.lens)]
        clear = known.unobstructed(eye, points, i) & ~hidden(sight.bodies, eye, points)
        found[i] = clear.any()
    return found
