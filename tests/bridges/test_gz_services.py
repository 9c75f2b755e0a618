"""gz's services of a world, with the types of ros_gz_interfaces."""

import pytest

from kbot.messages import gz_services as gz
from kbot.messages import services as srv
from kbot.messages import types as msg
from kbot.record.encodings.bytes import decode_cdr, decode_ros1, encode_cdr, encode_ros1
from kbot.record.encodings.definitions import definition
from kbot.ros.service_types import service_type
from kbot.text import KbotError

from .conftest import Running

CRATE = """<sdf version="1.7"><model name="crate"><link name="l"><inertial><mass>2</mass></inertial>
<collision name="c"><geometry><box><size>0.2 0.2 0.2</size></box></geometry></collision></link></model>
</sdf>"""


def ask(running: Running, service: str, request: object) -> object:
    return running.link.call(service, request).result(20)


def pose(x: float, y: float, z: float = 0.0) -> msg.Pose:
    return msg.Pose(msg.Point(x, y, z), msg.Quaternion(0.0, 0.0, 0.0, 1.0))


def create(running: Running, **fields: object) -> object:
    factory = gz.EntityFactory(**fields)
    return ask(running, "/world/empty/create", gz.GzSpawnEntityRequest(factory))


def test_a_model_is_created_moved_and_removed(running: Running) -> None:
    assert create(running, name="a", sdf=CRATE, pose=pose(1.0, 2.0, 0.1)) == srv.SuccessResponse(True)
    assert create(running, name="a", sdf=CRATE, pose=pose(2.0, 2.0), allow_renaming=True) is not None
    assert {"a", "a_1"} <= running.simulation.body_poses().keys()
    moved = gz.SetEntityPoseRequest(gz.Entity(name="a"), pose(3.0, 0.0, 0.1))
    ask(running, "/world/empty/set_pose", moved)
    assert running.simulation.body_poses()["a"].translation[0] == pytest.approx(3.0, abs=1e-3)
    ask(running, "/world/empty/remove", gz.GzDeleteEntityRequest(gz.Entity(name="a")))
    assert "a" not in running.simulation.body_poses()


def test_a_robot_is_created_from_its_text_and_as_a_clone(running: Running) -> None:
    urdf = '<robot name="x"><link name="a"><collision><geometry><sphere radius="0.1"/></geometry></collision>'
    urdf += (
        '<inertial><mass value="1"/><inertia ixx="0.004" iyy="0.004" izz="0.004" ixy="0" ixz="0" iyz="0"/>'
    )
    urdf += "</inertial></link></robot>"
    create(running, name="ball", sdf=urdf, pose=pose(1.0, 1.0))
    create(running, name="twin", clone_name="ball", pose=pose(2.0, 1.0))
    assert {"ball", "twin"} <= running.simulation.robots.keys()


def test_the_world_is_paused_stepped_and_reset(running: Running) -> None:
    def control(**fields: object) -> None:
        asked = gz.WorldControl(**fields)
        ask(running, "/world/empty/control", gz.ControlWorldRequest(asked))

    control(pause=True)
    steps = running.simulation.steps
    control(pause=True, multi_step=25)
    assert running.simulation.steps == steps + 25
    control(step=True)
    assert (running.simulation.steps, running.simulation.paused) == (steps + 26, True)
    control(pause=True, reset=gz.WorldReset(all=True))
    assert running.simulation.steps == 0
    control()
    assert not running.simulation.paused


@pytest.mark.parametrize(
    ("service", "request_", "said"),
    [
        ("create", gz.GzSpawnEntityRequest(), "nothing is named to be created"),
        ("create", gz.GzSpawnEntityRequest(gz.EntityFactory(name="a", sdf="<sdf/>")), "holds no SDF"),
        ("remove", gz.GzDeleteEntityRequest(gz.Entity(id=3)), "by its name"),
        ("control", gz.ControlWorldRequest(gz.WorldControl(multi_step=1 << 31)), "steps at most"),
    ],
)
def test_what_cannot_be_is_said(running: Running, service: str, request_: object, said: str) -> None:
    with pytest.raises(KbotError, match=said):
        ask(running, f"/world/empty/{service}", request_)


def test_spawn_sdf_model_of_ros_1_and_a_robot_s_namespace(running: Running) -> None:
    request = srv.SpawnModelRequest("box", CRATE, "", pose(1.0, 0.0), "")
    answer = ask(running, "/gazebo/spawn_sdf_model", request)
    assert isinstance(answer, srv.StatusResponse)
    assert (answer.success, answer.status_message) == (True, "box is put at 1.000, 0.000, 0.000")
    broken = srv.SpawnModelRequest("other", CRATE.replace("0.2 0.2 0.2", "0.2"), "", pose(2.0, 0.0), "")
    answer = ask(running, "/gazebo/spawn_sdf_model", broken)
    assert isinstance(answer, srv.StatusResponse)
    assert not answer.success
    assert "other.sdf:2" in answer.status_message


def test_numbers_are_of_the_size_that_the_interfaces_have() -> None:
    """https://github.com/gazebosim/ros_gz/tree/ros2/ros_gz_interfaces"""
    assert definition(gz.Entity) == "uint64 id\nstring name\nuint8 type"
    assert definition(gz.WorldControl).splitlines() == [
        "bool pause",
        "bool step",
        "uint32 multi_step",
        "ros_gz_interfaces/WorldReset reset",
        "uint32 seed",
        "builtin_interfaces/Time run_to_sim_time",
    ]
    kind = service_type("ros_gz_interfaces/srv/ControlWorld")
    request = gz.ControlWorldRequest(gz.WorldControl(True, False, 4_000_000_000, seed=7))
    name = kind.request_name
    assert decode_cdr(encode_cdr(request, name), kind.request, name) == request
    assert decode_ros1(encode_ros1(request, name), kind.request, name) == request
    # pause, step, two of padding, 32 bits of steps
    assert encode_cdr(request, name)[4:12] == b"\1\0\0\0" + (4_000_000_000).to_bytes(4, "little")
