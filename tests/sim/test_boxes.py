"""The plain renderer, against what geometry says must be seen."""

from __future__ import annotations

import numpy as np
import pytest

from er_gym.sim.render.boxes import BACKGROUND, NO_BOX, Frames, render_boxes, type_color
from er_gym.sim.render.camera import Camera
from er_gym.sim.scene import load_scene

RED, BLUE = (200, 0, 0), (0, 0, 200)


def camera(
    position: tuple[float, float, float] = (0, 0, 0),
    yaw: float = 0,
    horizon: float = 0,
    width: int = 400,
    height: int = 200,
) -> Camera:
    return Camera(position, yaw, horizon, 90, width, height)


def draw_floorplan1(at: Camera) -> Frames:
    scene = load_scene("FloorPlan1")
    low = scene.aabb_center - scene.aabb_size / 2
    high = scene.aabb_center + scene.aabb_size / 2
    colors = [type_color(name) for name in scene.types]
    return render_boxes(at, low, high, colors, room_min=low.min(0), room_max=high.max(0))


class TestCamera:
    def test_axes_at_rest_are_the_worlds(self) -> None:
        assert np.allclose(camera().axes, np.eye(3))

    def test_yaw_turns_right_and_horizon_down(self) -> None:
        right, _, forward = camera(yaw=90).axes
        assert np.allclose(right, [0, 0, -1])
        assert np.allclose(forward, [1, 0, 0])
        _, up, forward = camera(horizon=30).axes
        assert np.allclose(forward, [0, -0.5, np.sqrt(3) / 2])
        assert np.allclose(up, [0, np.sqrt(3) / 2, 0.5])

    def test_project(self) -> None:
        # 90 degrees over 200 pixels: 100 pixels are one metre at one metre.
        at = camera(position=(1, 2, 3))
        points = [[1, 2, 5], [2, 2, 5], [1, 3, 5], [1, 4, 5]]
        expected = [[200, 100, 2], [250, 100, 2], [200, 50, 2], [200, 0, 2]]
        assert np.allclose(at.project(points), expected)

    def test_rays_undo_projection(self) -> None:
        at = camera(position=(1, 2, 3), yaw=37, horizon=-20, width=31, height=17)
        x, y, depth = 4, 11, 2.5
        point = at.position + depth * at.rays()[:, y, x]
        assert np.allclose(at.project(point), [x + 0.5, y + 0.5, depth], atol=1e-4)


class TestOneBox:
    def test_extent_and_depth_of_the_front_face(self) -> None:
        # The front face, 2 m away, spans -1..1 m: pixels 150..250 and 75..125.
        frames = render_boxes(camera(), [[-1, -0.5, 2]], [[1, 0.5, 3]], [RED])
        expected = np.full((200, 400), NO_BOX)
        expected[75:125, 150:250] = 0
        assert np.array_equal(frames.ids, expected)
        assert np.allclose(frames.depth[expected == 0], 2)
        assert np.isinf(frames.depth[expected != 0]).all()
        assert frames.rgb.shape == (200, 400, 3)
        assert tuple(frames.rgb[0, 0]) == BACKGROUND
        assert frames.rgb[100, 200, 0] > 0
        assert not frames.rgb[100, 200, 1:].any()

    def test_depth_is_along_the_view_axis_on_a_slanted_face(self) -> None:
        # The left face of a box on the right, x = 1: a pixel u from the middle sees it at 100 / u.
        frames = render_boxes(camera(), [[1, -5, 1]], [[2, 5, 9]], [RED])
        columns = np.arange(220, 290)
        assert np.allclose(frames.depth[100, columns], 100 / (columns + 0.5 - 200), rtol=1e-5)

    def test_two_faces_are_shaded_and_parted_by_a_line(self) -> None:
        below = camera(position=(0, 2, 0), horizon=45)
        frames = render_boxes(below, [[-1, 0, 1.5]], [[1, 0.5, 3]], [RED])
        column = frames.rgb[:, 200, 0][frames.ids[:, 200] == 0]
        bright, dark = column[len(column) // 4], column[-5]
        assert bright > dark
        assert column.min() < dark

    @pytest.mark.parametrize("yaw", [0, 77, 180, 250])
    @pytest.mark.parametrize("horizon", [-30, 0, 45])
    def test_extent_is_that_of_the_corners_from_any_direction(
        self, yaw: float, horizon: float
    ) -> None:
        at = camera(yaw=yaw, horizon=horizon)
        middle = 3 * at.axes[2] + 0.3 * at.axes[0]
        half = np.array([0.3, 0.2, 0.4])
        low, high = middle - half, middle + half
        corners = np.array(np.meshgrid(*np.stack([low, high], axis=1))).reshape(3, 8).T
        pixels = at.project(corners)
        rows, columns = np.nonzero(render_boxes(at, [low], [high], [RED]).ids == 0)
        assert abs(columns.min() - pixels[:, 0].min()) <= 1
        assert abs(columns.max() + 1 - pixels[:, 0].max()) <= 1
        assert abs(rows.min() - pixels[:, 1].min()) <= 1
        assert abs(rows.max() + 1 - pixels[:, 1].max()) <= 1

    def test_behind_the_camera_and_nearer_than_near_is_not_drawn(self) -> None:
        behind, near = ([-1, -1, -3], [1, 1, -2]), ([-1, -1, 0.01], [1, 1, 0.04])
        low, high = zip(behind, near, strict=True)
        assert (render_boxes(camera(), low, high, [RED, BLUE]).ids == NO_BOX).all()

    def test_box_that_reaches_behind_the_camera(self) -> None:
        # A counter 0.5 m below the eye: seen from the lower edge up to its far edge at 2 m.
        frames = render_boxes(camera(), [[-9, -1, -2]], [[9, -0.5, 2]], [RED])
        assert (frames.ids[125:] == 0).all()
        assert (frames.ids[:125] == NO_BOX).all()

    def test_flat_box_is_seen(self) -> None:
        frames = render_boxes(camera(), [[-1, -1, 2]], [[1, 1, 2]], [RED])
        assert np.allclose(frames.depth[100, 200], 2)


class TestSeveralBoxes:
    def test_nearer_hides_farther_in_either_order(self) -> None:
        low = np.array([[-0.5, -0.5, 2], [-1, -1, 4]])
        high = np.array([[0.5, 0.5, 3], [1, 1, 5]])
        for order in ([0, 1], [1, 0]):
            frames = render_boxes(camera(), low[order], high[order], [RED, BLUE])
            assert frames.ids[100, 200] == order.index(0)
            assert np.isclose(frames.depth[100, 200], 2)

    def test_smaller_of_two_coinciding_faces_is_seen(self) -> None:
        low, high = [[-0.5, -0.5, 2], [-1, -1, 2]], [[0.5, 0.5, 2.1], [1, 1, 4]]
        frames = render_boxes(camera(), low, high, [RED, BLUE])
        assert frames.ids[100, 200] == 0
        assert frames.ids[60, 200] == 1

    def test_hollow_box_shows_its_contents_and_inner_faces(self) -> None:
        low, high = [[-1, -1, 2], [-0.2, -1, 3]], [[1, 1, 4], [0.2, -0.5, 3.5]]
        closed = render_boxes(camera(), low, high, [RED, BLUE])
        opened = render_boxes(camera(), low, high, [RED, BLUE], hollow=[True, False])
        assert (closed.ids == 1).sum() == 0
        assert (opened.ids == 1).sum() > 0
        assert np.isclose(opened.depth[90, 200], 4)
        assert np.array_equal(closed.ids >= 0, opened.ids >= 0)

    def test_no_boxes(self) -> None:
        empty = np.zeros((0, 3))
        assert (render_boxes(camera(), empty, empty, empty).ids == NO_BOX).all()


class TestInside:
    def test_inner_faces_of_a_box_around_the_camera(self) -> None:
        frames = render_boxes(camera(), [[-2, -1, -1]], [[2, 1, 3]], [RED])
        assert (frames.ids == 0).all()
        assert np.isclose(frames.depth[100, 200], 3)
        assert np.isclose(frames.depth[199, 200], 100 / 99.5)

    def test_room_has_floor_walls_and_ceiling_and_no_id(self) -> None:
        room = {"room_min": (-2, -1, -1), "room_max": (2, 1, 3)}
        frames = render_boxes(camera(), [[-0.5, -0.5, 2]], [[0.5, 0.5, 2.5]], [RED], **room)
        assert set(np.unique(frames.ids)) == {NO_BOX, 0}
        assert np.isfinite(frames.depth).all()
        floor, ceiling, ahead = frames.rgb[190, 200], frames.rgb[10, 200], frames.rgb[70, 200]
        assert len({tuple(floor), tuple(ceiling), tuple(ahead)}) == 3

    def test_room_is_widened_to_hold_the_camera(self) -> None:
        outside = camera(position=(0, 0, -5))
        frames = render_boxes(
            outside,
            [[-0.5, -0.5, 2]],
            [[0.5, 0.5, 3]],
            [RED],
            room_min=(-2, -2, 0),
            room_max=(2, 2, 4),
        )
        assert np.isfinite(frames.depth).all()
        assert frames.ids[100, 200] == 0


class TestScene:
    def test_same_bytes_again(self) -> None:
        at = camera(position=(-1.25, 1.576, -1.75), yaw=45)
        once, twice = draw_floorplan1(at), draw_floorplan1(at)
        for name in ("rgb", "depth", "ids"):
            assert getattr(once, name).tobytes() == getattr(twice, name).tobytes()

    def test_types_and_ids_of_a_kitchen(self) -> None:
        frames = draw_floorplan1(camera(position=(-1.25, 1.576, -1.75), yaw=45))
        assert frames.rgb.dtype == np.uint8
        assert frames.depth.dtype == np.float32
        assert frames.ids.dtype == np.int32
        seen = {load_scene("FloorPlan1").types[i] for i in np.unique(frames.ids[frames.ids >= 0])}
        assert {"Fridge", "CounterTop", "Stool"} <= seen


def test_type_colors_are_fixed_and_differ() -> None:
    assert type_color("Apple") == type_color("Apple")
    types = set(load_scene("FloorPlan1").types)
    assert len({type_color(name) for name in types}) == len(types)
    assert all(0 <= channel <= 255 for name in types for channel in type_color(name))
