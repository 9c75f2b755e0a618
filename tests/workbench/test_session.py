"""What all tabs share, without a server."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kbot.text import DescriptionError, KbotError
from kbot.workbench.protocol import (
    Advance,
    Completions,
    Drive,
    Findings,
    FromServer,
    OpenSource,
    Pause,
    Push,
    RecordRun,
    Reset,
    RunProgram,
    SaveSource,
    Scene,
    SetJoint,
    SetJoints,
    SetSpeed,
    SetWorld,
    SourceConflict,
    SourceSaved,
    SourceText,
    State,
    Stop,
)
from kbot.workbench.serve import open_session
from kbot.workbench.session.session import Session

pytestmark = pytest.mark.usefixtures("keeps_up")

ARM = """<robot name="arm">
  <link name="base"/>
  <link name="upper"/>
  <link name="lower"/>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="upper"/><limit lower="-1" upper="2" effort="1" velocity="1"/>
  </joint>
  <joint name="elbow" type="revolute">
    <parent link="upper"/><child link="lower"/><limit lower="0.5" upper="1.5" effort="1" velocity="1"/>
  </joint>
</robot>
"""

SOLID = """<robot name="x"><link name="a"><inertial><mass value="1"/>
<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>
<collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link></robot>
"""


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    file = tmp_path / "arm.urdf"
    file.write_text(ARM)
    return file


def positions(session: Session) -> list[float]:
    return list(session.state().positions)


def of(kind: type, messages: list[FromServer]) -> list[FromServer]:
    return [message for message in messages if isinstance(message, kind)]


def test_joints_start_at_zero_or_the_nearest_limit(arm: Path) -> None:
    assert positions(open_session(str(arm), simulate=False)) == [0.0, 0.5]


def test_presets_respect_limits(arm: Path) -> None:
    session = open_session(str(arm), simulate=False)
    session.handle(SetJoints("centre"), 1)
    assert positions(session) == [0.5, 1.0]
    session.handle(SetJoint("shoulder", 7.0), 1)
    assert positions(session) == [2.0, 1.0]
    session.handle(SetJoints("random"), 1)
    first = positions(session)
    assert -1 <= first[0] <= 2
    assert 0.5 <= first[1] <= 1.5
    session.handle(SetJoints("random"), 1)
    assert positions(session) != first
    session.handle(Reset(), 1)
    assert positions(session) == [0.0, 0.5]
    with pytest.raises(KbotError, match="no joint 'wrist'"):
        session.handle(SetJoint("wrist", 0.0), 1)


def test_a_changed_description_keeps_joint_positions(arm: Path) -> None:
    session = open_session(str(arm), simulate=False)
    session.handle(SetJoint("shoulder", 1.75), 1)
    arm.write_text(ARM.replace('upper="2"', 'upper="1.25"').replace("elbow", "knee"))
    messages = session.adopt(session.read())
    (scene,) = of(Scene, messages)
    assert isinstance(scene, Scene)
    assert [joint.name for joint in scene.joints] == ["shoulder", "knee"]
    assert scene.revision == 2
    assert positions(session) == [1.25, 0.5]  # clamped to the new limit


def test_a_broken_description_keeps_the_last_valid_robot(arm: Path) -> None:
    session = open_session(str(arm), simulate=False)
    arm.write_text(ARM.replace('<link name="lower"/>', ""))
    messages = session.adopt(session.read())
    assert of(Scene, messages) == []
    (findings,) = of(Findings, messages)
    assert isinstance(findings, Findings)
    assert findings.stale
    assert findings.findings[0].severity == "error"
    assert findings.findings[0].place is not None
    assert findings.findings[0].place.line == 9
    assert session.scene.revision == 1
    arm.unlink()
    assert of(Scene, session.adopt(session.read())) == []
    arm.write_text(ARM)
    messages = session.adopt(session.read())
    assert len(of(Scene, messages)) == 1
    (findings,) = of(Findings, messages)
    assert isinstance(findings, Findings)
    assert not findings.stale


def test_a_page_cannot_run_a_program_that_the_user_did_not_start() -> None:
    session = open_session("kbot", simulate=True)
    with pytest.raises(KbotError, match="there is no program to run"):
        session.handle(RunProgram(), 1)


def test_a_missing_description_is_refused_at_the_start(tmp_path: Path) -> None:
    with pytest.raises(DescriptionError, match="does not exist"):
        open_session(str(tmp_path / "no.urdf"), simulate=False)


@pytest.mark.parametrize("simulate", [False, True])
@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "the file is empty"),
        ("<robot name='x'></robot>", "the robot has no link"),
        ("<robot name='x'><link name='a'></robot>", "not well-formed"),
    ],
)
def test_the_first_usable_version_starts_the_robot(
    tmp_path: Path, simulate: bool, text: str, message: str
) -> None:
    file, started = tmp_path / "r.urdf", []
    file.write_text(text)
    session = open_session(
        str(file), simulate=simulate, world="boxes:count=3", on_start=started.append, on_show=started.append
    )
    assert (session.scene.links, session.scene.root) == ((), "")
    assert len(session.scene.bodies) == (3 if simulate else 0), "the world is shown without a robot"
    findings = session.findings()
    assert findings.stale
    assert message in findings.findings[0].message
    assert "no robot yet" in session.about().cannot_drive
    session.advance(0.1)
    assert (session.state().time, session.state().poses) == (0.0, ())
    for message in (Push("a", 1.0, 0.0, 0.0, 0.1), Drive(0.1, 0.0), SetWorld("boxes", 0), RecordRun(True)):
        with pytest.raises(KbotError, match="no robot yet"):
            session.handle(message, 1)
    with pytest.raises(KbotError, match="no robot yet"):
        session.standing()
    assert started == []
    file.write_text(text)
    session.adopt(session.read())
    assert started == [], "it is still broken"
    file.write_text(SOLID)
    (scene,) = of(Scene, session.adopt(session.read()))
    assert isinstance(scene, Scene)
    assert [link.name for link in scene.links] == ["a"]
    assert not session.findings().stale
    assert len(started) == 1
    assert len(session.state().poses) == 7
    session.advance(0.1)
    assert (session.state().time > 0.0) is simulate


def test_the_findings_of_a_broken_description_have_fixes(tmp_path: Path) -> None:
    file = tmp_path / "r.urdf"
    file.write_text(SOLID.replace("<mass value=", "<mass valeu="))
    (error, *_) = open_session(str(file), simulate=False).findings().findings
    assert (error.severity, error.fix) == ("error", "rename valeu to value")


def test_an_error_that_is_not_in_the_description_ends_the_start(arm: Path) -> None:
    def fail(sliders: object) -> None:
        raise KbotError("the port is in use")

    with pytest.raises(KbotError, match="the port is in use"):
        open_session(str(arm), simulate=False, on_show=fail)


def test_only_files_of_the_description_are_sent(arm: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.txt"
    other.write_text("secret")
    session = open_session(str(arm), simulate=False)
    source, completions = session.handle(OpenSource(str(arm)), 1)
    assert isinstance(source, SourceText)
    assert isinstance(completions, Completions)
    assert ("parent", "link", ("base", "upper", "lower")) in [
        (known.element, known.attribute, known.values) for known in completions.values
    ]
    assert source.owners[1] == ("base",)
    assert source.owners[4] == ("upper",)  # a joint belongs to its child link
    with pytest.raises(KbotError, match="not part of this description"):
        session.handle(OpenSource(str(other)), 1)


def test_an_included_file_outside_the_robot_s_folders_is_not_sent_or_written(tmp_path: Path) -> None:
    secret = tmp_path / "secret" / "x.xacro"
    secret.parent.mkdir()
    secret.write_text("<robot/>")
    robot = tmp_path / "mine" / "urdf" / "r.xacro"
    robot.parent.mkdir(parents=True)
    include = f'<xacro:include filename="{secret}"/>'
    robot.write_text(
        SOLID.replace('name="x">', f'name="x" xmlns:xacro="http://www.ros.org/wiki/xacro">{include}')
    )
    session = open_session(str(robot), simulate=False)
    assert str(secret) in session.shown.files
    for message in (OpenSource(str(secret)), SaveSource(str(secret), "<robot/>", "<robot a='1'/>")):
        with pytest.raises(KbotError, match="outside the description's own folders"):
            session.handle(message, 1)
    assert secret.read_text() == "<robot/>"


def test_a_deleted_file_is_created_again_only_on_request(tmp_path: Path) -> None:
    robot = tmp_path / "urdf" / "r.urdf"
    robot.parent.mkdir()
    robot.write_text(SOLID)
    session = open_session(str(robot), simulate=False)
    robot.unlink()
    assert session.handle(SaveSource(str(robot), SOLID, "new"), 1) == [SourceConflict(str(robot), None)]
    assert not robot.exists()
    assert session.handle(SaveSource(str(robot), None, "new"), 1) == [SourceSaved(str(robot), "new", "new")]
    assert robot.read_text() == "new"
    again = session.handle(SaveSource(str(robot), None, "newer"), 1)
    assert again == [SourceConflict(str(robot), "new")]
    robot.unlink()
    robot.parent.rmdir()
    with pytest.raises(KbotError, match=r"the folder .*urdf was deleted. Create it"):
        session.handle(SaveSource(str(robot), None, "new"), 1)


def test_an_include_that_is_no_longer_used_is_saved_if_a_page_has_read_it(tmp_path: Path) -> None:
    folder = tmp_path / "mine" / "urdf"
    folder.mkdir(parents=True)
    robot, read, other = (folder / name for name in ("r.xacro", "read.xacro", "other.xacro"))
    includes = "".join(f'<xacro:include filename="{file.name}"/>' for file in (read, other))
    robot.write_text(
        SOLID.replace('name="x">', f'name="x" xmlns:xacro="http://www.ros.org/wiki/xacro">{includes}')
    )
    for file in (read, other):
        file.write_text("<robot/>")
    session = open_session(str(robot), simulate=False)
    session.handle(OpenSource(str(read)), 1)
    robot.write_text(SOLID)
    session.adopt(session.read())
    assert session.shown.files == (str(robot),)
    session.handle(SaveSource(str(read), "<robot/>", "<robot a='1'/>"), 1)
    assert read.read_text() == "<robot a='1'/>"
    with pytest.raises(KbotError, match="is not part of this description"):
        session.handle(SaveSource(str(other), "<robot/>", "<robot a='1'/>"), 1)
    read.unlink()
    read.symlink_to(tmp_path / "elsewhere.xacro")
    with pytest.raises(KbotError, match="outside the description's own folders"):
        session.handle(SaveSource(str(read), None, "<robot/>"), 1)


def test_time_advances_by_the_given_seconds(xacro: Path) -> None:
    session = open_session(str(xacro), simulate=True)
    session.handle(SetSpeed(0.5), 1)
    session.advance(0.1)
    assert session.state().time == pytest.approx(0.05, abs=0.0021)
    session.handle(Pause(True), 1)
    assert not session.advance(1.0)
    session.handle(Advance(0.1), 1)
    assert session.state().time == pytest.approx(0.15, abs=0.0021)
    session.handle(Reset(), 1)
    state = session.state()
    assert (state.time, state.resets) == (0.0, 1)


def test_a_slow_machine_steps_the_whole_requested_time(xacro: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    session = open_session(str(xacro), simulate=True)
    monkeypatch.setattr("kbot.workbench.driving.driving.BUSY_SECONDS", 0.0)
    session.handle(Advance(0.5), 1)
    assert session.state().time == pytest.approx(0.5, abs=1e-9)


def test_only_the_driving_page_can_release_the_robot(xacro: Path) -> None:
    session = open_session(str(xacro), simulate=True)
    session.handle(Drive(0.2, 0.0), 1)
    session.handle(Drive(0.0, 0.0), 2)
    assert session.state().driver == 1
    assert session.state().command == (0.2, 0.0)
    session.leave(2)
    assert session.state().driver == 1
    session.handle(Stop(), 2)
    assert session.state().command == (0.0, 0.0)
    session.handle(Drive(0.1, 0.0), 2)
    session.leave(2)
    assert session.state().command == (0.0, 0.0)


def test_silence_stops_the_robot(xacro: Path) -> None:
    session = open_session(str(xacro), simulate=True)
    session.handle(Drive(0.2, 0.0), 1)
    for _ in range(4):
        session.advance(0.1)
    assert session.state().command == (0.2, 0.0)
    for _ in range(3):
        session.advance(0.1)
    assert session.state().command == (0.0, 0.0)


def drive_on(session: Session, linear: float, seconds: float) -> State:
    for _ in range(round(seconds / 0.1)):
        session.handle(Drive(linear, 0.0), 1)
        session.advance(0.1)
    return session.state()


def test_a_changed_robot_continues_at_its_pose(xacro: Path) -> None:
    session = open_session(str(xacro), simulate=True)
    session.handle(Drive(0.1, 1.0), 1)
    session.advance(0.5)
    before = drive_on(session, 0.3, 1.0)
    xacro.write_text(
        xacro.read_text().replace('"wheel_radius" default="0.035"', '"wheel_radius" default="0.05"')
    )
    session.adopt(session.read())
    after = session.state()
    assert after.revision == 2
    assert after.time == before.time
    assert after.poses[:2] == pytest.approx(before.poses[:2], abs=1e-6)
    assert after.poses[3:7] == pytest.approx(before.poses[3:7], abs=1e-6)
    assert after.odometry == pytest.approx(before.odometry, abs=1e-5)
    assert after.positions == pytest.approx(before.positions, abs=1e-5)
    settled = drive_on(session, 0.0, 1.0)  # at rest, on wheels of another size
    assert settled.poses[:2] == pytest.approx(before.poses[:2], abs=1e-3)
    assert settled.poses[2] == pytest.approx(0.0, abs=1e-4)


def test_a_robot_without_wheels_reports_why_it_cannot_drive(arm: Path) -> None:
    solid = (
        """<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>"""
    )
    text = ARM
    for name in ("base", "upper", "lower"):
        text = text.replace(f'<link name="{name}"/>', f'<link name="{name}">{solid}</link>', 1)
    arm.write_text(text)
    session = open_session(str(arm), simulate=True)
    assert "continuous" in session.about().cannot_drive
    with pytest.raises(KbotError, match="cannot drive"):
        session.handle(Drive(0.1, 0.0), 1)


def test_another_world_starts_a_new_run(xacro: Path) -> None:
    session, reported = open_session(str(xacro), simulate=True), []
    session.announce = reported.append
    drive_on(session, 0.2, 0.5)
    assert "boxes" in [world.name for world in session.about().worlds]
    session.handle(SetWorld("boxes:count=3", 0), 1)
    state = session.state()
    assert (state.time, state.resets, state.command) == (0.0, 1, (0.0, 0.0))
    assert session.about().world == "boxes"
    (scene,) = of(Scene, reported)
    assert isinstance(scene, Scene)
    assert len(scene.bodies) == 3
    with pytest.raises(KbotError, match="did you mean 'maze'"):
        session.handle(SetWorld("mase", 0), 1)
    assert session.about().world == "boxes"
    drive_on(session, 0.2, 0.5)


def test_a_push_moves_the_robot(xacro: Path) -> None:
    session = open_session(str(xacro), simulate=True)
    session.handle(Push("base_link", 0.0, 0.0, 40.0, 0.1), 1)  # 40 N lift 1.15 kg
    session.advance(0.1)
    assert session.state().poses[2] > 0.05
    unknown = "no body of the world is called 'base_lnk': did you mean 'base_link'"
    with pytest.raises(KbotError, match=unknown):
        session.handle(Push("base_lnk", 1.0, 0.0, 0.0, 0.1), 1)
    arm_less = open_session(str(xacro), simulate=False)
    for message in (Push("base_link", 1.0, 0.0, 0.0, 0.1), SetWorld("boxes", 0)):
        with pytest.raises(KbotError, match="kbot sim"):
            arm_less.handle(message, 1)


@pytest.mark.parametrize("fix", ["reset", "save"])
def test_a_diverged_run_keeps_its_last_state(xacro: Path, fix: str) -> None:
    session = open_session(str(xacro), simulate=True)
    session.handle(Push("left_wheel", 500.0, 0.0, 0.0, 1.0), 1)  # a hundred times the robot's weight
    with pytest.raises(DescriptionError, match="diverged"):
        session.handle(Advance(1.0), 1)
    assert np.isfinite(session.state().poses).all()
    if fix == "reset":
        session.handle(Reset(), 1)
    else:
        session.adopt(session.read())
    session.handle(Pause(False), 1)
    start = session.state()
    assert max(map(abs, start.odometry)) < 1e-3
    assert drive_on(session, 0.2, 0.5).odometry[0] > 0.05


def test_equal_states_are_equal_in_every_run(xacro: Path) -> None:
    first, second = (open_session(str(xacro), simulate=True, seed=3) for _ in range(2))
    assert replace(drive_on(first, 0.2, 0.5), rate=0.0) == replace(drive_on(second, 0.2, 0.5), rate=0.0)
