"""Robots that are too large to simulate are errors at the line of the large value."""

import pytest

from kbot.model.load import load_robot
from kbot.sim import Simulation
from kbot.sim.engine.bounds import DEEPEST
from kbot.text import DescriptionError

LINK = (
    '<link name="l{i}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    '</inertial><collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link>'
)
JOINT = '<joint name="j{i}" type="continuous"><parent link="l{p}"/><child link="l{i}"/></joint>'


def chain(count: int) -> str:
    """A chain of `count` continuous joints."""
    parts = [LINK.format(i=0)]
    parts += [LINK.format(i=i) + JOINT.format(i=i, p=i - 1) for i in range(1, count + 1)]
    return '<robot name="chain">' + "\n".join(parts) + "</robot>"


def codes(robot) -> list[str]:
    with pytest.raises(DescriptionError) as caught:
        Simulation(robot)
    assert all(d.origin is not None for d in caught.value.diagnostics)
    return [d.code for d in caught.value.diagnostics]


def test_long_chain_of_joints_is_rejected(urdf):
    assert codes(urdf(chain(DEEPEST + 1))) == ["W112"]
    assert codes(urdf(chain(3000))) == ["W112"]


@pytest.mark.parametrize("radius", ["1e7", "9e8"])  # the reader rejects meshes beyond 1e9 m
def test_absurd_sizes_are_rejected(radius):
    assert set(codes(load_robot("kbot", {"wheel_radius": radius}).require())) == {"W113"}


@pytest.mark.parametrize(
    ("old", "new"),
    [('mass value="1"', 'mass value="1e13"'), ("0.1 0.1 0.1", "0.1 2e6 0.1"), ('ixx="1"', 'ixx="1e13"')],
)
def test_each_bound_is_checked(urdf, old, new):
    assert codes(urdf(chain(0).replace(old, new))) == ["W113"]
