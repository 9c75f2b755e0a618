"""Worlds of thousands of shapes: what makes them load fast gives the same model and motion."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from kbot import Simulation
from kbot.model import RobotModel
from kbot.sim.engine.assembly import Assembly, compile_model
from kbot.sim.simulation import ORIGIN
from kbot.world import Body, Box, HeightField, Part, TriangleMesh, World
from kbot.world.builders import at, floor

TETRAHEDRON = TriangleMesh(
    np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.0, 0.3, 0.0], [0.0, 0.0, 0.3]]),
    np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]], dtype=np.int32),
)
INERTIAL = (
    '<inertial><mass value="{0}"/><inertia ixx="{1}" iyy="{1}" izz="{1}" ixy="0" ixz="0" iyz="0"/></inertial>'
)
WHEELS = "".join(
    f'<link name="{end}_{side}">{INERTIAL.format(1, 0.002)}'
    '<collision><geometry><sphere radius="0.1"/></geometry></collision></link>'
    f'<joint name="{end}_{side}_joint" type="continuous"><parent link="base"/><child link="{end}_{side}"/>'
    f'<origin xyz="{x} {y} 0"/><axis xyz="0 1 0"/></joint>'
    for end, x in (("front", 0.2), ("rear", -0.2))
    for side, y in (("left", 0.2), ("right", -0.2))
)
ROVER = f'<robot name="rover"><link name="base">{INERTIAL.format(5, 0.1)}</link>{WHEELS}</robot>'
GEOMS = ("type", "pos", "quat", "size", "friction", "solref", "contype", "conaffinity", "bodyid", "group")


def world() -> World:
    hills = HeightField(np.array([[0.0, 0.0], [0.0, 0.2]]), (2.0, 2.0))
    statics = [
        Body(f"box{i}", (Part(Box((0.2, 0.2, 0.2)), friction=0.1 * i),), at(1.0 + i, 1.0, 0.1))
        for i in range(5)
    ]
    barrier = Body("barrier", (Part(TETRAHEDRON, at(0.1, 0.0, 0.0)), Part(TETRAHEDRON)), at(1.0, -0.1, 0.0))
    ball = Body("crate", (Part(Box((0.1, 0.1, 0.1))),), at(0.0, 2.0, 0.05), mass=0.1)
    field = Body("hills", (Part(hills, ground=True),), at(5.0, 5.0, 0.0))
    return World("mixed", (*statics[:3], floor(), barrier, ball, *statics[3:], field))


@pytest.mark.parametrize("most", [1, 3])
def test_small_models_give_the_same_model_and_motion(most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The robot drives against the barrier, which is in another small model than the floor."""
    runs = []
    for limit in (10_000, most):
        monkeypatch.setattr("kbot.sim.engine.static_shapes._MOST", limit)
        simulation = Simulation("kbot", world=world())
        simulation.cmd_vel(0.5, 0.0)
        simulation.run(4.0)
        runs.append(simulation)
    whole, small = (run.engine.model for run in runs)
    assert [small.geom(i).name for i in range(small.ngeom)] == [
        whole.geom(i).name for i in range(whole.ngeom)
    ]
    for name in GEOMS:
        assert (getattr(small, f"geom_{name}") == getattr(whole, f"geom_{name}")).all(), name
    meshes = [[model.mesh(i).name for i in range(model.nmesh)] for model in (whole, small)]
    assert meshes[0] == meshes[1]
    assert (small.geom_dataid == whole.geom_dataid).all()
    assert runs[1].state_sha256() == runs[0].state_sha256()
    assert runs[0].collided


def test_a_skidding_robot_slides_on_ground_of_a_small_model(
    urdf: Callable[[str], RobotModel], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The pairs of tyres and ground refer to the ground by its name."""
    names = []
    for limit in (10_000, 1):
        monkeypatch.setattr("kbot.sim.engine.static_shapes._MOST", limit)
        model = Simulation(urdf(ROVER), world=world()).engine.model
        pairs = zip(model.pair_geom1.tolist(), model.pair_geom2.tolist(), strict=True)
        names.append([(model.geom(a).name, model.geom(b).name) for a, b in pairs])
    assert len(names[0]) == 8  # four tyres on the floor and on the hills
    assert names[0] == names[1]


def test_a_robot_that_is_moved_to_a_free_place_is_as_if_compiled_there() -> None:
    """The engine compiles a world of 30 meshes of tracks in seconds, so it does so once."""
    before = Simulation("kbot", world=world()).engine.assembly
    plan = replace(before.plans["kbot"], pose=at(0.3, -0.7, 0.0))
    moved = before.with_start(plan)
    compiled = Assembly.of(before.world, before.contacts, before.timestep, {"kbot": plan})
    for name in dir(compiled.model):
        value = getattr(compiled.model, name)
        if isinstance(value, np.ndarray):
            assert np.array_equal(getattr(moved.model, name), value), name
    assert np.array_equal(moved.data.qpos, compiled.data.qpos)
    assert not np.array_equal(before.model.qpos0, moved.model.qpos0), "the first one is not changed"


def test_a_world_is_compiled_once_although_the_robot_starts_elsewhere(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    compiled: list[World] = []

    def counted(place: World, *others: Any) -> Any:
        compiled.append(place)
        return compile_model(place, *others)

    monkeypatch.setattr("kbot.sim.engine.assembly.compile_model", counted)
    block = Body("block", (Part(Box((0.2, 0.2, 0.2))),), at(0.0, 0.0, 0.1))
    simulation = Simulation("kbot", world=World("blocked", (floor(), block)))
    assert simulation.start != ORIGIN
    assert not simulation.engine.assembly.overlapped_by(simulation.engine.assembly.plans["kbot"])
    assert len(compiled) == 1


def test_equal_meshes_of_several_robots_are_added_once(tmp_path: Path) -> None:
    trimesh.creation.box((0.1, 0.1, 0.1)).export(tmp_path / "box.stl")
    mesh = '<collision><geometry><mesh filename="box.stl"/></geometry></collision>'
    link = f'<link name="l">{INERTIAL.format(1, 0.01)}{mesh}{mesh}</link>'
    (tmp_path / "box.urdf").write_text(f'<robot name="r">{link}</robot>')
    simulation = Simulation(str(tmp_path / "box.urdf"), world=World("flat", (floor(),)))
    simulation.models.spawn_model(simulation.robot, "other", 1.0, 0.0, 0.0)
    model = simulation.engine.model
    assert (model.nmesh, (model.geom_dataid == 0).sum()) == (1, 4)
