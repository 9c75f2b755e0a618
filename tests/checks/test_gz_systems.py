"""What a world for gz leaves the sensors of its robots without."""

from pathlib import Path

import pytest

from kbot.checks import check_file

ROBOT = """<robot name="r"><link name="base"/>
  <gazebo reference="base"><sensor name="lidar" type="gpu_lidar"><topic>scan</topic></sensor></gazebo>
  <gazebo reference="base"><sensor name="tilt" type="imu"/></gazebo>
  {more}
</robot>
"""
LAUNCH = """<launch>
  <include file="$(find-pkg-share ros_gz_sim)/launch/gz_sim.launch.py">
    <arg name="gz_args" value="-r $(dirname)/yard.sdf"/>
  </include>
  <node pkg="robot_state_publisher" exec="robot_state_publisher">
    <param name="robot_description" value="$(command 'xacro $(dirname)/r.xacro')"/>
  </node>
  <node pkg="ros_gz_sim" exec="create" args="-topic robot_description"/>
</launch>
"""


def plugin(name: str) -> str:
    return f'<plugin filename="{name}" name="x"/>'


PHYSICS, SENSORS, IMU = (plugin(f"gz-sim-{name}-system") for name in ("physics", "sensors", "imu"))


@pytest.mark.parametrize(
    ("listed", "of_the_robot", "missing"),
    [
        (PHYSICS, "", ["sensors", "imu"]),
        (PHYSICS + SENSORS, "", ["imu"]),
        (PHYSICS + plugin("libignition-gazebo-sensors-system.so") + IMU, "", []),
        (PHYSICS, SENSORS + IMU, []),
        ("", "", []),  # gz loads what its own configuration says
    ],
)
def test_a_sensor_without_its_system_is_told_at_the_world(
    tmp_path: Path, listed: str, of_the_robot: str, missing: list[str]
) -> None:
    (tmp_path / "yard.sdf").write_text(f'<sdf version="1.9">\n<world name="yard">{listed}</world></sdf>')
    (tmp_path / "r.xacro").write_text(ROBOT.format(more=f"<gazebo>{of_the_robot}</gazebo>"))
    (tmp_path / "gz.launch.xml").write_text(LAUNCH)
    found = [d for d in check_file(str(tmp_path / "gz.launch.xml")) if d.code == "L065"]
    assert [d.message.split()[5] for d in found] == [f"gz-sim-{name}-system:" for name in missing]
    for one in found:
        assert one.origin is not None
        assert (Path(one.origin.span.file).name, one.origin.span.line) == ("yard.sdf", 2)
