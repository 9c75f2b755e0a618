from math import cos, hypot, radians, sin

import numpy as np
import pytest

from kbot.text import KbotError
from kbot.world import BUILDERS, Box, Cylinder, load_world


@pytest.mark.parametrize("name", list(BUILDERS))
def test_every_world_has_a_free_start(name):
    """No solid part above the ground is within 0.15 m of the origin."""
    for body in load_world(name).bodies:
        for part in body.parts:
            pose = body.pose @ part.pose
            if not part.solid or not isinstance(part.shape, Box | Cylinder):
                continue
            if isinstance(part.shape, Cylinder):
                gap = hypot(*pose.translation[:2]) - part.shape.radius
            else:
                half = np.array(part.shape.size) / 2
                start = pose.inverse().apply((0.0, 0.0, pose.translation[2]))
                gap = float(np.linalg.norm(np.maximum(np.abs(start) - half, 0.0)[:2]))
            assert gap > 0.15, body.name


@pytest.mark.parametrize("name", list(BUILDERS))
def test_every_world_has_a_floor_and_bodies_with_unique_names(name):
    names = [body.name for body in load_world(name).bodies]
    assert "ground_plane" in names
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("scale", [0.5, 1.0, 3.0])
def test_the_way_ahead_in_the_playground_is_free(scale):
    """A robot of radius 0.35 m, times the scale, drives 2 m straight ahead without a collision."""
    for body in load_world(f"playground:scale={scale}").bodies[1:]:
        shape = body.parts[0].shape
        reach = shape.radius if isinstance(shape, Cylinder) else hypot(*shape.size[:2]) / 2
        if body.name.startswith("wall_along"):
            reach = 0.01 * scale  # it is parallel to the way
        x, y = body.pose.translation[:2]
        nearest = min(max(x, 0.0), 2.0 * scale)
        assert hypot(x - nearest, y) - reach > 0.35 * scale, body.name


@pytest.mark.parametrize(("size", "seed"), [(1, 1), (5, 2), (12, 7)])
def test_maze_is_perfect(size, seed):
    """A spanning tree of n cells opens n - 1 of the inner walls."""
    cell, total = 0.6, 0.0
    for body in load_world(f"maze:size={size},seed={seed},cell={cell}").bodies[1:]:
        total += body.parts[0].shape.size[0] - 0.02
    inner, opened = 2 * size * (size - 1), size * size - 1
    assert total / cell == pytest.approx(4 * size + inner - opened)


def test_maze_depends_only_on_its_seed():
    def outline(text):
        return [tuple(body.pose.translation) for body in load_world(text).bodies]

    assert outline("maze:seed=3") == outline("maze:seed=3")
    assert outline("maze:seed=3") != outline("maze:seed=4")


def test_ramp_meets_the_ground_and_its_platform():
    world = load_world("ramp:angle=10,length=2")
    up, platform = world.bodies[1], world.bodies[2]
    lx, _, lz = up.parts[0].shape.size
    foot = up.pose.apply((-lx / 2, 0.0, lz / 2))
    head = up.pose.apply((lx / 2, 0.0, lz / 2))
    assert foot == pytest.approx((0.5, 0.0, 0.0), abs=1e-12)
    assert head == pytest.approx((0.5 + 2 * cos(radians(10)), 0.0, 2 * sin(radians(10))))
    assert platform.pose.translation[2] + 0.02 == pytest.approx(head[2])


def test_stairs_rise_by_their_height():
    tops = [
        body.pose.translation[2] + body.parts[0].shape.size[2] / 2
        for body in load_world("stairs:steps=3,height=0.02").bodies[1:]
    ]
    assert tops == pytest.approx([0.02, 0.04, 0.06])


def test_track_is_closed():
    """The chords of both half circles add up to the circumference within 1 %."""
    parts = load_world("track:straight=2,radius=0.75").bodies[1].parts
    assert all(not part.solid for part in parts)
    assert sum(part.shape.size[0] for part in parts) == pytest.approx(4 + 2 * np.pi * 0.75, rel=0.03)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("maz", "did you mean 'maze'"),
        ("qqqq", "choose from empty, playground, boxes"),
        ("maze:sise=3", "no parameter 'sise': did you mean 'size'"),
        ("maze:size", "parameter=value"),
        ("maze:size=big", "size must be a whole number"),
        ("maze:size=-1", "size must be from 1 to 100"),
        ("maze:cell=nan", "cell must be a number"),
        ("maze:seed=-3", "seed"),
        ("boxes:count=1000000", "count must be from 0 to 10000"),
        ("maze:size=3,size=4", "size is given twice"),
        ("ramp:angle=1e308", "angle must be a number from -1e6 to 1e6"),
        ("ramp:angle=-5", "angle must be above 0"),
        ("corridor:width=0", "width"),
        ("boxes:count=-1", "count"),
        ("stairs:steps=0", "steps"),
        ("rooms:door=5", "door"),
        ("track:radius=0", "radius"),
        ("playground:scale=0", "scale must be from 0.1 to 100"),
    ],
)
def test_invalid_parameters_are_one_error(text, message):
    with pytest.raises(KbotError, match=message):
        load_world(text)


def test_world_object_is_returned_unchanged():
    world = load_world("empty")
    assert load_world(world) is world
