"""The model of a robot for MuJoCo: a program that knows only MuJoCo drives it as KBot does."""

import mujoco
import numpy as np
import pytest

import kbot


def controls_of(simulation, drive):
    """The controls of each step of a simulation, while `drive` runs."""
    found = []
    simulation.stepping.watchers.append(lambda _, data: found.append(data.ctrl.copy()))
    drive(simulation)
    simulation.stepping.watchers.clear()
    return found


def weave(simulation):
    for linear, angular in ((0.2, 0.5), (0.1, -1.0), (-0.2, 0.0), (0.0, 2.0)):
        simulation.cmd_vel(linear, angular)
        simulation.run(1.0)


@pytest.mark.parametrize(("world", "is_exact"), [("empty", True), ("boxes:seed=3", True), ("empty", False)])
def test_text_drives_as_the_simulation_does(world, is_exact):
    simulation = kbot.Simulation("kbot", world=world)
    start = simulation.engine.data.qpos.copy()
    commands = controls_of(simulation, weave)
    exported = kbot.load("kbot").to_mujoco(world)
    model = mujoco.MjModel.from_xml_string(exported.xml)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("start").id)
    assert data.qpos == pytest.approx(start, abs=1e-15)
    if is_exact:
        data.qpos[:] = start
    for values in commands:
        data.ctrl[:] = values
        mujoco.mj_step(model, data)
    assert model.opt.timestep == simulation.timestep
    # the wheels of the start just touch the ground, and MuJoCo writes a height of 1e-18 m as 0: without this
    # height, the first contact is a step later
    assert data.qpos == pytest.approx(simulation.engine.data.qpos, abs=1e-9 if is_exact else 1e-4)
    assert data.time == pytest.approx(4.0)


def test_controls_are_those_of_a_command_that_was_reached():
    simulation = kbot.Simulation("kbot")
    simulation.cmd_vel(0.2, 0.5)
    simulation.run(2.0)
    exported = kbot.load("kbot").to_mujoco()
    # the wheels of radius 0.035 m are 0.174 m apart
    left, right = (0.2 - 0.5 * 0.087) / 0.035, (0.2 + 0.5 * 0.087) / 0.035
    values = exported.controls(0.2, 0.5)
    assert values[exported.actuators["left_wheel_joint"]] == pytest.approx(left)
    assert values[exported.actuators["right_wheel_joint"]] == pytest.approx(right)
    assert values.tolist() == simulation.engine.data.ctrl.tolist()


def test_model_drives_with_the_documented_controls():
    exported = kbot.load("kbot").to_mujoco()
    data = exported.start()
    data.ctrl[:] = exported.controls(0.2, 0.0)
    mujoco.mj_step(exported.model, data, 1000)
    assert data.qpos[0] == pytest.approx(0.4, abs=0.01), "0.2 m/s for 2 s"
    assert data.qpos[1] == pytest.approx(0.0, abs=0.001)


def test_a_robot_with_meshes_needs_no_files(shared, tmp_path, monkeypatch):
    folder = shared / "barn" / "jackal_description"
    exported = kbot.load(folder / "urdf" / "jackal.urdf", packages=[folder]).to_mujoco()
    monkeypatch.chdir(tmp_path)
    assert mujoco.MjModel.from_xml_string(exported.xml).nu == 4
    assert len(exported.actuators) == 4


def test_robot_that_cannot_drive_has_no_controls(tmp_path):
    file = tmp_path / "box.urdf"
    file.write_text(
        '<robot name="box"><link name="base_link"><inertial><mass value="1"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
        '<collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link></robot>'
    )
    exported = kbot.load(file).to_mujoco()
    with pytest.raises(kbot.KbotError, match="cannot drive"):
        exported.controls(0.2, 0.0)
    data = exported.start()
    mujoco.mj_step(exported.model, data, 100)
    assert data.qpos[2] == pytest.approx(0.1, abs=0.001), "it rests on the ground"


def test_a_library_that_writes_fewer_digits_is_an_error(tmp_path, monkeypatch):
    monkeypatch.setattr(mujoco, "__file__", str(tmp_path / "__init__.py"))
    with pytest.raises(kbot.KbotError, match=r"MuJoCo \d+\.\d+\.\d+ cannot write numbers with all digits"):
        kbot.load("kbot").to_mujoco()


def test_several_robots_are_refused():
    from kbot.sim.mujoco_export import export

    simulation = kbot.Simulation("kbot")
    simulation.models.spawn_model(kbot.load("kbot"), "other", x=1.0)
    with pytest.raises(kbot.KbotError, match="one robot"):
        export(simulation)


def test_unknown_world_is_refused():
    with pytest.raises(kbot.KbotError, match="did you mean 'rooms'"):
        kbot.load("kbot").to_mujoco("roms")


def test_positions_agree_to_the_last_digit_in_the_text():
    exported = kbot.load("kbot", wheel_radius=1.0 / 30.0).to_mujoco()
    own = kbot.Simulation(kbot.load("kbot", wheel_radius=1.0 / 30.0)).engine.model
    assert np.array_equal(exported.model.geom_size, own.geom_size)
