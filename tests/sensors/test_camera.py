"""Camera images against projection and the lidar."""

import math
import re
import threading

import numpy as np
import pytest

from kbot.kinematics import PlanarPose, Transform
from kbot.messages.sensing import CameraInfo, Image
from kbot.render import offscreen
from kbot.sensors import Camera, Lidar, Noise
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.text.extras import install_command
from kbot.world.builders import box, floor
from kbot.world.world import World

UP = Transform.from_xyz_rpy((0.0, 0.0, 0.5), (0.0, 0.0, 0.0))
RED, BLUE = (1.0, 0.0, 0.0, 1.0), (0.0, 0.0, 1.0, 1.0)
WORLD = World(
    "posts",
    (
        floor(),
        box("wall", (0.1, 20.0, 4.0), 4.05, 0.0, rgba=(0.9, 0.9, 0.9, 1.0)),
        box("left", (0.2, 0.2, 0.4), 2.1, 0.5, z=0.5, rgba=RED),
        box("right", (0.2, 0.2, 0.4), 2.1, -0.5, z=0.7, rgba=BLUE),
    ),
)


@pytest.fixture(scope="module")
def simulation(robot):
    return Simulation(robot, WORLD)


@pytest.fixture(scope="module")
def camera(simulation):
    try:
        return simulation.add_sensor(
            Camera(link="base_footprint", pose=UP, width=320, height=240, depth=True)
        )
    except KbotError as error:
        pytest.skip(str(error))


def test_boxes_are_drawn_where_projection_predicts(camera):
    colours, _ = camera.draw()
    f = 160 / math.tan(math.radians(30))
    for channel, y, z in ((0, 0.5, 0.5), (2, -0.5, 0.7)):
        other = 2 - channel
        mask = (colours[..., channel] > 90) & (colours[..., other] < 60)
        rows, columns = np.nonzero(mask)
        # the near face is at x = 2.0. Compare its outer edge, because the inner side is visible too. Right is
        # -y, down is -z
        outer = columns.min() if y > 0 else columns.max() + 1
        assert outer == pytest.approx(160 - f * (y + math.copysign(0.1, y)) / 2.0, abs=1.5)
        assert rows.min() == pytest.approx(120 - f * (z + 0.2 - 0.5) / 2.0, abs=1.5)
        assert rows.max() + 1 == pytest.approx(120 - f * (z - 0.2 - 0.5) / 2.0, abs=1.5)


def test_depth_equals_lidar_distance_within_a_millimetre(simulation, camera):
    _, depths = camera.draw()
    f = camera.spec.focal_length
    columns = np.arange(2, 320, 7)
    angles = np.arctan2(160 - (columns + 0.5), f)
    assert np.all(np.diff(angles) < 0)
    for column, angle in zip(columns, angles, strict=True):
        beam = Lidar(link="base_footprint", pose=UP, samples=1, angle_min=angle, angle_max=angle)
        directions = beam.directions
        # the centre of the row below the horizon is half a pixel down
        tilt = math.atan2(0.5, math.hypot(f, 160 - column - 0.5))
        lidar = simulation.add_sensor(
            Lidar(
                link="base_footprint", name="beam", pose=UP, samples=1, angle_min=angle, angle_max=angle,
                elevation_min=-tilt, elevation_max=-tilt,
            )
        )  # fmt: skip
        distance = lidar.distances()[0]
        lidar.close()
        ahead = distance * math.cos(tilt) * math.cos(angle)
        edge = min(abs(depths[120, column] - depths[120, column + d]) for d in (-1, 1))
        if edge < 0.01:
            assert depths[120, column] == pytest.approx(ahead, abs=1e-3), column
        assert directions.shape == (1, 3)


def test_camera_turns_with_its_robot(robot):
    simulation = Simulation(robot, WORLD)
    try:
        camera = simulation.add_sensor(Camera(link="base_footprint", pose=UP, width=64, height=48))
    except KbotError as error:
        pytest.skip(str(error))
    # towards the red box, which is 14 degrees to the left
    simulation.models.place(PlanarPose(0.0, 0.0, math.atan2(0.5, 2.1)))
    colours, _ = camera.draw()
    r, g, b = colours[24, 32].tolist()
    assert r > 90
    assert max(g, b) < 60


def test_image_info_and_depth_are_published_together(simulation, camera):
    received = {}
    for topic, kind in (("image_raw", Image), ("camera_info", CameraInfo), ("depth/image_raw", Image)):
        simulation.bus.subscribe(f"camera/{topic}", kind, lambda m, topic=topic: received.update({topic: m}))
    simulation.run(0.1)
    image, info, depth = received["image_raw"], received["camera_info"], received["depth/image_raw"]
    assert (image.encoding, image.step, len(image.data)) == ("rgb8", 960, 320 * 240 * 3)
    assert (depth.encoding, depth.step, len(depth.data)) == ("32FC1", 1280, 320 * 240 * 4)
    assert info.k[0] == pytest.approx(160 / math.tan(math.radians(30)))
    assert (info.k[2], info.k[5]) == (160.0, 120.0)
    middle = np.frombuffer(depth.data, "<f4").reshape(240, 320)[100, 160]
    assert middle == pytest.approx(4.0, abs=1e-3)


def test_noise_adds_its_deviation_to_colours(robot):
    simulation = Simulation(robot, WORLD)
    spec = Camera(link="base_footprint", pose=UP, width=64, height=48, noise=Noise(stddev=0.05))
    try:
        camera = simulation.add_sensor(spec)
    except KbotError as error:
        pytest.skip(str(error))
    clean = np.frombuffer(camera.measure().data, np.uint8).astype(float)
    noisy = np.frombuffer(camera.measure(1).data, np.uint8).astype(float)
    inside = (clean > 60) & (clean < 195)
    off = (noisy - clean)[inside] / 255.0
    assert off.std() == pytest.approx(0.05, rel=4 / math.sqrt(2 * len(off)) + 0.01)


def test_missing_opengl_error_names_what_to_install(robot, monkeypatch):
    def fails(width, height):
        raise ImportError("no libEGL.so")

    monkeypatch.setitem(
        __import__("sys").modules, "mujoco.egl", type("egl", (), {"GLContext": staticmethod(fails)})
    )
    monkeypatch.setattr(offscreen.sys, "platform", "linux")
    hint = f"no libEGL.so). Install the extra 'camera' with: {install_command('camera')}. On Linux, also: apt"
    with pytest.raises(KbotError, match=re.escape(hint)):
        Simulation(robot).add_sensor(Camera(link="base_link", width=8, height=8))


@pytest.mark.parametrize("numbers", [{"width": 0}, {"fov": 4.0}, {"near": 0.0}, {"far": 0.001}])
def test_invalid_camera_settings_are_rejected(numbers):
    with pytest.raises(KbotError):
        Camera(link="base_link", **numbers)


def test_camera_renders_in_another_thread(camera):
    found = []
    thread = threading.Thread(target=lambda: found.append(camera.draw()[0]))
    thread.start()
    thread.join()
    assert np.array_equal(found[0], camera.draw()[0])


def test_a_see_through_object_tints_what_is_behind_it_and_has_a_depth(robot):
    """Before a wall and, above it, before nothing, which is black. One with alpha 0 is not seen."""
    wall = box("wall", (0.1, 20.0, 1.0), 4.05, 0.0, rgba=(0.9, 0.9, 0.9, 1.0))
    images = []
    for alpha in (0.0, 0.5, 1.0):
        glass = box("glass", (0.2, 1.0, 4.0), 2.1, 0.0, rgba=(1.0, 0.0, 0.0, alpha))
        simulation = Simulation(robot, World("hall", (floor(), wall, glass)))
        try:
            camera = simulation.add_sensor(
                Camera(link="base_footprint", pose=UP, width=64, height=48, depth=True)
            )
        except KbotError as error:
            pytest.skip(str(error))
        images.append(camera.draw())
    (clear, far), (tinted, near), (opaque, solid) = images
    for row in (4, 24):
        expected = (clear[row, 32].astype(float) + opaque[row, 32]) / 2.0
        assert tinted[row, 32] == pytest.approx(expected, abs=3.0)
        assert near[row, 32] == pytest.approx(2.0, abs=1e-3)
        assert solid[row, 32] == pytest.approx(2.0, abs=1e-3)
    assert clear[4, 32].tolist() == [0, 0, 0]
    assert far[4, 32] == math.inf
    assert far[24, 32] == pytest.approx(4.0, abs=1e-3)
