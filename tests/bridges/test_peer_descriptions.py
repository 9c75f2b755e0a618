"""Models that peers spawn: nothing in them is evaluated, and only allowed files are read."""

import os
from pathlib import Path

import pytest

from kbot.messages import services as srv
from kbot.messages import types as msg
from kbot.record.replay import repeat_action
from kbot.sim import Simulation

from .conftest import Running

XACRO = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">{}<link name="a"/></robot>'
MESHED = """<robot name="r"><link name="a"><inertial><mass value="1"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><sphere radius="0.1"/></geometry></collision>
<visual><geometry><mesh filename="{}"/></geometry></visual></link></robot>"""
SDF_MESHED = """<sdf version="1.7"><model name="m"><link name="l"><collision name="c"><geometry>
<mesh><uri>{}</uri></mesh></geometry></collision></link></model></sdf>"""
INCLUDING = '<sdf version="1.7"><world name="w"><include><uri>{}</uri></include></world></sdf>'
CRATE = '<sdf version="1.7"><model name="{}"><link name="l"/></model></sdf>'
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def spawn(
    running: Running, xml: str, service: str = "/gazebo/spawn_urdf_model", name: str = "x1"
) -> srv.StatusResponse:
    far = msg.Pose(msg.Point(3.0, 3.0, 1.0))
    answer = running.link.call(service, srv.SpawnModelRequest(name, xml, "", far)).result(20)
    assert isinstance(answer, srv.StatusResponse)
    return answer


@pytest.fixture
def secret(tmp_path: Path) -> Path:
    (tmp_path / "secret.yaml").write_text("password: hunter2\n")
    (tmp_path / "secret.obj").write_text(TETRAHEDRON)
    (tmp_path / "secret.sdf").write_text(CRATE.format("hunter2"))
    os.mkfifo(tmp_path / "pipe.obj")
    return tmp_path


@pytest.fixture
def models(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of models, with a symbolic link to a file outside of it."""
    folder = tmp_path / "models"
    (folder / "tetra").mkdir(parents=True)
    (folder / "tetra" / "tetra.obj").write_text(TETRAHEDRON)
    (folder / "tetra" / "broken.obj").write_text("v 0 0\n")
    (folder / "tetra" / "model.sdf").write_text(SDF_MESHED.format("tetra.obj"))
    (folder / "tetra" / "link.obj").symlink_to(tmp_path / "secret.obj")
    monkeypatch.setenv("GAZEBO_MODEL_PATH", str(folder))
    return folder


@pytest.mark.parametrize(
    "inside",
    [
        "<xacro:property name='d' value=\"${xacro.load_yaml('SECRET')}\"/>",
        "<xacro:include filename='SECRET'/>",
        "<link name='$(env HOME)'/>",
        "<link name='&#36;{1 + 1}'/>",
        "<gazebo><plugin>$(find kbot_description)</plugin></gazebo>",
        "<gazebo><!-- xacro:eval-comments --><!-- ${1 + 1} --></gazebo>",
    ],
)
@pytest.mark.parametrize("declared", [True, False])
def test_xacro_of_a_peer_is_never_expanded(
    running: Running, secret: Path, inside: str, declared: bool
) -> None:
    xml = XACRO.format(inside.replace("SECRET", str(secret / "secret.yaml")))
    xml = xml if declared else xml.replace(' xmlns:xacro="http://www.ros.org/wiki/xacro"', "")
    answer = spawn(running, xml)
    assert not answer.success
    assert answer.status_message.endswith("the text is xacro. Expand it first with kbot expand")
    for kind in ("/gazebo/spawn_sdf_model", "/gazebo/spawn_urdf_model"):
        assert "hunter2" not in spawn(running, xml, kind).status_message


def test_expanded_urdf_is_accepted(running: Running) -> None:
    """xacro leaves its namespace and the comments of the source."""
    xml = MESHED.format("x").replace('<mesh filename="x"/>', '<sphere radius="0.1"/>')
    xml = xml.replace('name="r">', 'name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><!-- ${width} -->')
    assert spawn(running, xml).success


OUTSIDE = ["SECRET/secret.obj", "file://SECRET/secret.obj", "file:///dev/zero", "/dev/zero",
    "SECRET/pipe.obj", "file:///etc/passwd", "http://example.org/a.obj", "model://../secret.obj", "model://../../etc/passwd",
    "package://kbot_description/../../../../../../../../etc/passwd", "model://tetra/link.obj",
    "model://" + "a" * 5000, "package://tetra/%00"]  # fmt: skip


@pytest.mark.parametrize("uri", OUTSIDE)
@pytest.mark.parametrize("text", [MESHED, SDF_MESHED, INCLUDING])
def test_other_files_are_refused_as_if_they_did_not_exist(
    running: Running, secret: Path, models: Path, text: str, uri: str
) -> None:
    existing = uri.replace("SECRET", str(secret))
    missing = existing[:-1] + "~"
    answers = [spawn(running, text.format(name)) for name in (existing, missing)]
    assert not any(answer.success for answer in answers)
    messages = [
        answer.status_message.replace(name, "")
        for answer, name in zip(answers, (existing, missing), strict=True)
    ]
    assert messages[0] == messages[1]
    assert "hunter2" not in messages[0]
    assert "x1" not in running.simulation.robots
    assert "x1" not in running.simulation.models.body_poses()


def test_parameter_files_of_plugins_are_not_read_from_elsewhere(running: Running, secret: Path) -> None:
    plugin = f"<gazebo><plugin><parameters>{secret}/secret.yaml</parameters></plugin></gazebo></robot>"
    xml = (
        MESHED.format("x")
        .replace('<mesh filename="x"/>', '<sphere radius="0.1"/>')
        .replace("</robot>", plugin)
    )
    answer = spawn(running, xml)
    assert not answer.success
    assert "is not in the models and packages of this machine" in answer.status_message


def test_a_symbolic_link_out_of_the_folder_is_not_followed(
    running: Running, secret: Path, models: Path
) -> None:
    (models / "linked").mkdir()
    (models / "linked" / "model.sdf").symlink_to(secret / "secret.sdf")
    answer = spawn(running, INCLUDING.format("model://linked"))
    assert (answer.success, "is not in the models" in answer.status_message) == (False, True)


def test_shipped_models_and_model_paths_are_used(running: Running, models: Path) -> None:
    for uri in ("model://crate", "model://tetra", f"file://{models}/tetra/model.sdf"):
        assert spawn(running, INCLUDING.format(uri), name="a").success
        running.link.call("/gazebo/delete_model", srv.DeleteModelRequest("a")).result(20)


@pytest.mark.parametrize("text", [MESHED, SDF_MESHED])
def test_a_mesh_of_a_model_path_is_used_and_a_broken_one_is_refused(
    running: Running, models: Path, text: str
) -> None:
    assert spawn(running, text.format(f"file://{models}/tetra/tetra.obj"), name="good").success
    broken = spawn(running, text.format(f"file://{models}/tetra/broken.obj"), name="bad")
    assert (broken.success, "broken.obj" in broken.status_message) == (False, True)


def test_a_model_name_does_not_select_a_folder(running: Running, secret: Path) -> None:
    for text in (MESHED.format("secret.obj"), SDF_MESHED.format("secret.obj")):
        assert not spawn(running, text, name=str(secret / "x")).success


@pytest.mark.parametrize("xml", ["", " \n", "hello", "/etc/passwd", "<", "<sdf", "<foo/>", "<sdf/>"])
def test_errors_of_the_sdf_service_mention_sdf(running: Running, xml: str) -> None:
    answer = spawn(running, xml, "/gazebo/spawn_sdf_model")
    assert not answer.success
    assert "urdf" not in answer.status_message.lower()
    assert "SDF" in answer.status_message or "x1.sdf:1:" in answer.status_message


def test_error_for_two_models_states_the_number(running: Running) -> None:
    two = CRATE.format("a").replace("</sdf>", '<model name="b"><link name="l"/></model></sdf>')
    assert "2 models" in spawn(running, two, "/gazebo/spawn_sdf_model").status_message


def test_a_replay_uses_the_files_of_the_original_run(
    running: Running, models: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A folder of the same name in the working directory is not used."""
    noted: list[tuple[str, dict[str, object]]] = []
    running.simulation.journal.write = lambda what, numbers: noted.append((what, numbers))
    (tmp_path / "beside" / "crate").mkdir(parents=True)
    (tmp_path / "beside" / "crate" / "model.sdf").write_text(SDF_MESHED.format("../../secret.obj"))
    monkeypatch.chdir(tmp_path / "beside")
    assert spawn(running, INCLUDING.format("model://crate"), name="box").success
    again = Simulation(running.simulation.robot)
    for what, numbers in noted:
        repeat_action(again, what, numbers)
    (first,) = (body for body in running.simulation.world.bodies if body.name == "box")
    (second,) = (body for body in again.world.bodies if body.name == "box")
    assert first.mass == second.mass


def test_a_model_with_very_many_links_is_refused(running: Running) -> None:
    """The simulation stands still while the physics engine adds a model."""
    links = "".join(
        f"<link name='l{n}'/><joint name='j{n}' type='fixed'><parent link='b'/><child link='l{n}'/></joint>"
        for n in range(250)
    )
    answer = spawn(running, f"<robot name='r'><link name='b'/>{links}</robot>")
    assert answer.status_message == "the model has 251 links: a peer may spawn 250 at most"
