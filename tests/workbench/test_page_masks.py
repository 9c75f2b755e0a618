"""The picture is exact to the pixel: every link's mask against an independent projection of the model."""

import math
from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kbot.checks.facts.bodies import body_of
from kbot.kinematics import FrameTree, Transform
from kbot.model import Link, Mesh, RobotModel
from kbot.model.load import load_robot
from kbot.workbench.serve import open_session

from .conftest import until
from .pictures import id_image
from .projection import CONTESTED, link_image, overlap
from .served import served

RIGHT = 0.985
FROM = ((1.0, 0.35, 0.6), (-0.6, -0.8, -0.5))

OpenPage = Callable[..., Any]

SHAPES = """<robot name="shapes">
  <material name="m"><color rgba="0.4 0.6 0.2 1"/></material>
  <link name="box"><visual><origin xyz="0.1 0 0.05" rpy="0.3 0.2 0.1"/>
    <geometry><box size="0.3 0.1 0.05"/></geometry></visual></link>
  <link name="cylinder"><visual><origin rpy="1 0.5 0"/>
    <geometry><cylinder radius="0.08" length="0.2"/></geometry></visual></link>
  <link name="sphere"><visual><geometry><sphere radius="0.07"/></geometry></visual></link>
  <link name="mesh"><visual><origin xyz="0 0 0.02" rpy="0 0 0.7"/>
    <geometry><mesh filename="file://{mesh}" scale="0.2 0.1 0.3"/></geometry></visual></link>
  <joint name="a" type="revolute"><origin xyz="0.35 0.1 0" rpy="0 0.4 0"/><axis xyz="0 1 1"/>
    <parent link="box"/><child link="cylinder"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
  <joint name="b" type="prismatic"><origin xyz="0 0 0.2" rpy="0.5 0 0"/><axis xyz="0 0 1"/>
    <parent link="cylinder"/><child link="sphere"/><limit upper="1" effort="1" velocity="1"/></joint>
  <joint name="c" type="continuous"><origin xyz="-0.25 0 0.1"/><axis xyz="1 0 0"/>
    <parent link="box"/><child link="mesh"/></joint>
</robot>"""

PYRAMID = """v 0 0 1
v -1 -1 0
v 1 -1 0
v 1 1 0
v -1 1 0
f 1 2 3
f 1 3 4
f 1 4 5
f 1 5 2
f 2 5 4 3
"""


def picture(
    page: Any, robot: RobotModel, link: str, way: tuple[float, float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Return the page's ids with a link in the middle of the picture, and the camera's matrix."""
    pose = FrameTree(robot).pose(link, joints=JOINTS)
    visual = robot.links[link].visuals[0]
    middle = (pose @ Transform.from_xyz_rpy(visual.pose.xyz, visual.pose.rpy)).translation
    radius = reach(robot, link) or 0.1
    eye = middle + np.array(way) / np.linalg.norm(way) * (radius * 4.0 + 0.2)
    page.evaluate("([eye, at]) => kbot.look(eye, at)", [eye.tolist(), middle.tolist()])
    page.evaluate("kbot.drawn()")
    ids, links = id_image(page)
    assert links == list(robot.links)
    camera = page.evaluate("kbot.camera()")
    return ids, np.array(camera["clipFromWorld"]).reshape(4, 4)


JOINTS: Mapping[str, float] = {}


Pictures = Mapping[str, list[tuple[np.ndarray, np.ndarray]]]
"""By link: what is seen of it from several sides, as ids and the camera's matrix."""


def pictures(page: Any, robot: RobotModel, only: Collection[str] | None = None) -> Pictures:
    """Of all links that have a shape, or of some of them."""
    return {
        name: [picture(page, robot, name, way) for way in FROM]
        for name, link in robot.links.items()
        if link.visuals and (only is None or name in only)
    }


def overlaps(
    taken: Pictures, robot: RobotModel, moved: Mapping[str, Transform] | None = None
) -> dict[str, float]:
    """Return the smallest overlap of each visible link over several views."""
    least: dict[str, float] = {}
    for name, views in taken.items():
        index = list(robot.links).index(name)
        for ids, clip in views:
            image = link_image(robot, clip, ids.shape[1], ids.shape[0], moved)
            expected = image == index
            if expected.sum() > 0.005 * expected.size:
                seen = (ids == index) & (image != CONTESTED)
                least[name] = min(least.get(name, 1.0), overlap(seen, expected))
    return least


def opened(open_page: OpenPage, address: str) -> Any:
    return open_page(address, viewport={"width": 820, "height": 420})


def test_every_link_of_kbot_is_where_the_model_places_it(
    xacro: Path, viewing: str, open_page: OpenPage
) -> None:
    page, robot = opened(open_page, viewing), load_robot(str(xacro)).require()
    taken = pictures(page, robot)
    found = overlaps(taken, robot)
    assert set(found) == set(robot.links) - {"base_footprint"} or set(found) == set(robot.links)
    assert min(found.values()) > RIGHT, found
    off = {name: Transform.from_xyz_rpy((0.002, 0.0, 0.002), (0.0, 0.0, 0.0)) for name in found}
    assert max(overlaps(taken, robot, off).values()) < RIGHT
    lost = {name: Transform.from_xyz_rpy((0.0, 0.0, 0.0), (1.5708, 0.0, 0.0)) for name in ("left_wheel",)}
    assert overlaps({"left_wheel": taken["left_wheel"]}, robot, lost)["left_wheel"] < RIGHT


def test_a_hidden_link_fails_the_same_measure(xacro: Path, viewing: str, open_page: OpenPage) -> None:
    page, robot = opened(open_page, viewing), load_robot(str(xacro)).require()
    page.locator("[data-option=visual]").click()
    assert max(overlaps(pictures(page, robot), robot).values()) == 0.0


def test_every_shape_is_where_the_model_places_it(tmp_path: Path, open_page: OpenPage) -> None:
    (tmp_path / "pyramid.obj").write_text(PYRAMID)
    file = tmp_path / "shapes.urdf"
    file.write_text(SHAPES.format(mesh=tmp_path / "pyramid.obj"))
    robot = load_robot(str(file)).require()
    with served(open_session(str(file), simulate=False)) as address:
        page = opened(open_page, address)
        index = list(robot.links).index("mesh")
        until(lambda: (id_image(page)[0] == index).any())
        found = overlaps(pictures(page, robot), robot)
        assert set(found) == set(robot.links)
        assert min(found.values()) > RIGHT, found


CORPUS = (
    "ros+urdf_tutorial/urdf/08-macroed.urdf.xacro",
    "ros-controls+ros2_control_demos/example_13/description/urdf/three_robots.urdf.xacro",
    "ros-controls+ros2_control_demos/example_2/description/urdf/diffbot.urdf.xacro",
    "ros-navigation+navigation2_tutorials/sam_bot_description/src/description/sam_bot_description.urdf",
    "linorobot+linorobot2/linorobot2_description/urdf/robots/4wd.urdf.xacro",
)


@pytest.mark.parametrize("entry", CORPUS)
def test_every_link_of_foreign_robots_is_where_the_model_places_it(
    entry: str, shared: Path, open_page: OpenPage
) -> None:
    file = shared / "corpus" / "expected" / f"{entry}.urdf"
    robot = load_robot(str(file)).require()
    primitive = {n for n, link in robot.links.items() if link.visuals and not of_meshes(link)}
    with served(open_session(str(file), simulate=False)) as address:
        page = opened(open_page, address)
        taken = pictures(page, robot, primitive)
        found = overlaps(taken, robot)
        assert len(found) >= 5
        assert min(found.values()) > RIGHT, found
        name = min(found, key=lambda item: reach(robot, item) or math.inf)
        off = {name: Transform.from_xyz_rpy((0.002 + reach(robot, name) / 25,) * 3, (0.0, 0.0, 0.0))}
        assert overlaps({name: taken[name]}, robot, off)[name] < RIGHT


def of_meshes(link: Link) -> bool:
    """Return whether some of it is a mesh. The corpus has no mesh files."""
    return any(isinstance(visual.geometry, Mesh) for visual in link.visuals)


def reach(robot: RobotModel, link: str) -> float | None:
    """Return how far the first visual of a link extends from its centre in m, or None for a missing mesh."""
    parts = body_of(robot.links[link]).visuals
    return parts[0].reach(robot.links[link].visuals[0].pose.xyz) if parts else None
