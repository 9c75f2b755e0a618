# ruff: noqa: E501 - XML and patterns are easier to read on one line
"""Ways to damage a clean robot, each with the code and the place of the expected finding.

An edit is a regular expression and what takes the place of its first match; `§` in one of the edits
marks the line at which the finding must stand.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

MARK = "§"
Edit = tuple[str, str | Callable[[re.Match[str]], str]]


@dataclass(frozen=True)
class Mutator:
    name: str
    code: str
    edits: tuple[Edit, ...]

    def spoil(self, text: str) -> tuple[str, int] | None:
        """The spoiled text and the line of the finding; None where this robot has no such place."""
        for pattern, replacement in self.edits:
            text, count = re.subn(pattern, replacement, text, count=1, flags=re.DOTALL)
            if not count:
                return None
        assert text.count(MARK) == 1, f"{self.name}: one mark, not {text.count(MARK)}"
        return text.replace(MARK, ""), text[: text.index(MARK)].count("\n") + 1


def _m(name: str, code: str, *edits: Edit) -> Mutator:
    return Mutator(name, code, edits)


def _unused(name: str, right: float) -> str:
    """A property that nothing reads: 1.5 times the right size, which no tolerance or convention explains."""
    return f'{MARK}<xacro:property name="{name}" value="{1.5 * right:g}"/>\n  '


LEFT = r'(<link name="left_wheel">.*?)'
LEFT_JOINT = r'(<joint name="left_wheel_joint" type="continuous">.*?)'
RIGHT_JOINT = r'(<joint name="right_wheel_joint" type="continuous">.*?)'
ARM = r'(<link name="arm_link">.*?)'
ARM_JOINT = r'(<joint name="arm_joint" type="revolute">.*?)'
BASE = r'(<link name="base_link">.*?)'

SOURCE = (
    _m("unused property", "S101", (r"(<xacro:arg )", r'§<xacro:property name="spare" value="1"/>\n  \1')),
    _m(
        "unused macro",
        "S102",
        (r"(<xacro:arg )", r'§<xacro:macro name="spare" params=""><link name="x"/></xacro:macro>\n  \1'),
    ),
    _m("unused argument", "S103", (r"(<xacro:arg )", r'§<xacro:arg name="spare" default="1"/>\n  \1')),
    _m("unused parameter", "S104", (r'params="on size"', r'params="on size color:=red§"')),
    _m("property hides pi", "X201", (r"(<xacro:arg )", r'§<xacro:property name="pi" value="3"/>\n  \1')),
    _m(
        "property redefined after use",
        "S106",
        (
            r"(<xacro:marker )",
            r'<gazebo><size>${radius}</size></gazebo>\n§<xacro:property name="radius" value="0.07"/>\n\1',
        ),
    ),
    _m(
        "properties define each other",
        "X105",
        (
            r"(<xacro:arg )",
            r'<xacro:property name="a" value="${b}"/>\n<xacro:property name="b" value="${a§}"/>\n\1',
        ),
        (r'size="0.01"', r'size="${a}"'),
    ),
    _m(
        "unknown xacro attribute",
        "X122",
        (r'(<xacro:marker on="base_link" size="0.01")', r'§\1 colour="red"'),
    ),
    _m("unknown xacro tag", "X121", (r"<xacro:marker ", r"§<xacro:markr ")),
    _m("macro without prefix", "S110", (r"<xacro:marker ", r"§<marker ")),
    _m("include never found", "X117", (r"(<xacro:arg )", r'§<xacro:include filename="gone.xacro"/>\n  \1')),
    _m(
        "glob that matches nothing",
        "X204",
        (r"(<xacro:arg )", r'§<xacro:include filename="gone_*.xacro"/>\n  \1'),
    ),
    _m(
        "argument read before its default",
        "S112",
        (r"(<xacro:arg name=)", r"§<gazebo> <speed>$(arg arm_speed)</speed> </gazebo>\n  \1"),
    ),
    _m(
        "boolean with a blank",
        "S113",
        (r'name="has_arm" value="true"', r'name="has_arm" value="§True "'),
        ('value="\\${has_arm}"', 'value="${has_arm != 1}"'),
    ),
    _m(
        "leftover expression",
        "S114",
        (r'<color rgba="0.5', r'<texture filename="§$${dir}/x.png"/>\n<color rgba="0.5'),
    ),
    _m("undefined name", "X103", (r'radius="\$\{radius\}"', r'§radius="${raduis}"')),
    _m("declaration not first", "P001", (r"^<\?xml", "\n§<?xml")),
    _m("truncated", "P001", (r"</robot>\n$", "§")),
)

STRUCTURE = (
    _m("link twice", "U004", (r'(<link name="camera_link"/>)', r'\1\n  §<link name="camera_link"/>')),
    _m("joint twice", "U005", (r'name="camera_optical_joint"', r'§name="camera_joint"')),
    _m("undefined parent", "U006", (r'<parent link="camera_link"/>', r'§<parent link="camra_link"/>')),
    _m(
        "undefined child",
        "U007",
        (r'<child link="camera_optical_link"/>', r'§<child link="camera_optcal_link"/>'),
    ),
    _m("second root", "U008", (r"(<xacro:marker )", r'§<link name="lonely"/>\n  \1')),
    _m("ring", "U009", (r'<parent link="base_footprint"/>(\s*)', r'<parent link="camera_link"/>\1§')),
    _m(
        "two parents",
        "U010",
        (
            r"(<xacro:marker )",
            r'<joint name="extra" type="fixed"> <parent link="base_link"/> <child link="left_wheel"/> </joint>\n  \1',
        ),
        (r'(<child link="left_wheel"/>\n)', r"§\1"),
    ),
    _m("unknown joint type", "U011", (r'type="revolute"', r'§type="revolut"')),
    _m("misspelt inertial", "U201", (ARM + r"<inertial>(.*?)</inertial>", r"\1§<inertal>\2</inertal>")),
    _m("misspelt collision", "U201", (LEFT + r"<collision>(.*?)</collision>", r"\1§<colision>\2</colision>")),
    _m("misspelt xyz", "U202", (r'<origin xyz="0 0 0" rpy="-1.57', r'<origin §xzy="0 0 0" rpy="-1.57')),
    _m("misspelt effort", "U202", (r'effort="10"', r'§efort="10"')),
    _m("rpy on axis", "U202", (r'<axis xyz="0 0 1"/>', r'§<axis xyz="0 0 1" rpy="0 0 0"/>')),
    _m(
        "name with a blank",
        "U203",
        (r'<link name="camera_optical_link"/>', r'§<link name="camera optical"/>'),
        (r'<child link="camera_optical_link"/>', r'<child link="camera optical"/>'),
        (r"<gz_frame_id>camera_optical_link", r"<gz_frame_id>camera optical"),
    ),
    _m(
        "leading slash",
        "U204",
        (r'<link name="lidar_link"/>', r'§<link name="/lidar_link"/>'),
        (r'<child link="lidar_link"/>', r'<child link="/lidar_link"/>'),
    ),
    _m("empty name", "U015", (r'<joint name="camera_joint"', r'§<joint name=""')),
    _m("robot without a name", "U002", (r'(xmlns:xacro="[^"]*") name="\w+">', r"\1>§")),
)

JOINTS = (
    _m("no limit", "J101", (ARM_JOINT + r"<limit[^>]*/>", r"\1"), (r'(<joint name="arm_joint")', r"§\1")),
    _m("limits reversed", "J102", (r'lower="-0.2" upper="1.57"', r'§lower="1.57" upper="-0.2"')),
    _m("limits closed", "J103", (r'lower="-0.2" upper="1.57"', r'§lower="0" upper="0"')),
    _m("no effort", "J104", (r'effort="10"', r'§effort="0"')),
    _m("no velocity", "J104", (LEFT_JOINT + r'velocity="20"', r'\1§velocity="0"')),
    _m(
        "no axis", "J105", (ARM_JOINT + r'<axis xyz="0 1 0"/>', r"\1"), (r'(<joint name="arm_joint")', r"§\1")
    ),
    _m("zero axis", "J106", (ARM_JOINT + r'<axis xyz="0 1 0"/>', r'\1§<axis xyz="0 0 0"/>')),
    _m("long axis", "J107", (ARM_JOINT + r'<axis xyz="0 1 0"/>', r'\1§<axis xyz="0 2 0"/>')),
    _m("degrees in rpy", "J108", (r'rpy="-1.570796327 0 -1.570796327"', r'§rpy="-90 0 -90"')),
    _m("degrees in limits", "J109", (r'lower="-0.2" upper="1.57"', r'§lower="-20" upper="90"')),
    _m("mimic of nothing", "J110", (r'<mimic joint="arm_joint"', r'§<mimic joint="amr_joint"')),
    _m("mimic of itself", "J111", (r'<mimic joint="arm_joint"', r'§<mimic joint="slider_joint"')),
    _m("limits on a continuous joint", "J112", (LEFT_JOINT + r"<limit ", r'\1§<limit lower="-1" upper="1" ')),
    _m("axis on a fixed joint", "J113", (r'(<child link="camera_link"/>)', r'\1\n    §<axis xyz="0 0 1"/>')),
    _m("negative damping", "J114", (r'damping="0.1"', r'§damping="-0.1"')),
    _m("zero out of limits", "J115", (r'lower="-0.2"', r'§lower="0.2"')),
)

INERTIA = (
    _m("mass that is no number", "U012", (ARM + r'<mass value="[^"]*"', r'\1§<mass value="nan"')),
    _m("no mass", "I102", (ARM + r'<mass value="[^"]*"', r'\1§<mass value="0"')),
    _m("negative mass", "I102", (BASE + r'<mass value="([^"]*)"', r'\1§<mass value="-\2"')),
    _m(
        "zero tensor",
        "I103",
        (ARM + r"<inertia [^>]*/>", r'\1§<inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/>'),
    ),
    _m("negative moment", "I104", (ARM + r'izz="', r'\1§izz="-')),
    _m("large product", "I104", (LEFT + r'ixy="0"', r'\1§ixy="1"')),
    _m("triangle inequality", "I105", (ARM + r'izz="([^"]*)"', r'\1§izz="0.9"')),
    _m(
        "no inertial",
        "I106",
        (LEFT + r"<inertial>.*?</inertial>", r"\1"),
        (r'(<link name="left_wheel">)', r"§\1"),
    ),
    _m(
        "tensor in other units",
        "I108",
        (ARM + r"<inertia [^>]*/>", r'\1§<inertia ixx="50" ixy="0" ixz="0" iyy="50" iyz="0" izz="50"/>'),
    ),
    _m(
        "tensor too small",
        "I109",
        (
            BASE + r"<inertia [^>]*/>",
            r'\1§<inertia ixx="1e-7" ixy="0" ixz="0" iyy="1e-7" iyz="0" izz="1e-7"/>',
        ),
    ),
    _m(
        "mass outside the shape",
        "I110",
        (BASE + r"<inertial>", r'\1<inertial>\n      §<origin xyz="0 0 3" rpy="0 0 0"/>'),
    ),
    _m(
        "inertial not turned",
        "I111",
        (
            LEFT + r'(<inertial>\s*<origin xyz="0 0 0" rpy=")1.570796327 0 0"/>(.*?)<inertia ',
            r'\1\g<2>0 0 0"/>\3§<inertia ',
        ),
    ),
    _m(
        "moments exchanged",
        "I112",
        (BASE + r'iyy="([^"]*)" iyz="0" izz="([^"]*)"', r'\1§iyy="\3" iyz="0" izz="\2"'),
    ),
    _m(
        "mass in the parent's frame",
        "I113",
        (
            LEFT
            + r'(<inertial>\s*)<origin xyz="0 0 0"(.*?<joint name="left_wheel_joint".*?<origin xyz=")([^"]*)"',
            r'\1\2§<origin xyz="\4"\3\4"',
        ),
    ),
    _m(
        "root with inertia",
        "I115",
        (
            r'<link name="base_footprint"/>',
            r'<link name="base_footprint">\n§<inertial> <mass value="1"/> <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/> </inertial>\n</link>',
        ),
    ),
    _m(
        "mass ratio",
        "I116",
        (ARM + r'<mass value="[^"]*"', r'\1<mass value="200000"'),
        (r'(<joint name="arm_joint")', r"§\1"),
    ),
    _m("density", "I117", (r'(<link name="front_ball">.*?)<mass value="[^"]*"', r'\1§<mass value="200"')),
)

GEOMETRY = (
    _m("mesh missing", "G101", (ARM + r"<box [^>]*/>", r'\1§<mesh filename="meshes/arm.stl"/>')),
    _m("absolute mesh", "G103", (ARM + r"<box [^>]*/>", r'\1§<mesh filename="file:///home/me/arm.stl"/>')),
    _m(
        "no collision",
        "G106",
        (ARM + r"<collision>.*?</collision>", r"\1"),
        (r'(<link name="arm_link">)', r"§\1"),
    ),
    _m(
        "zero size",
        "G107",
        (BASE + r'(<collision>\s*<geometry> )<box size="[^"]*"', r'\1\2§<box size="0.1 0 0.1"'),
    ),
    _m("negative radius", "G107", (r'(<link name="rear_ball">.*?)<sphere radius="', r'\1§<sphere radius="-')),
    _m("undefined material", "G108", (BASE + r'<material name="grey"/>', r'\1§<material name="gray"/>')),
    _m(
        "collision larger",
        "G109",
        (
            r'(<link name="slider_link">.*?<collision>\s*<geometry> )<box size="[^"]*"',
            r'\1§<box size="0.06 0.02 0.02"',
        ),
    ),
)

DRIVE = (
    _m(
        "both wheels on one side",
        "D111",
        (RIGHT_JOINT + r'<origin xyz="0 -', r'\1§<origin xyz="0 '),
    ),
    _m(
        "wheel slides",
        "D117",
        (
            r'(<joint name="left_wheel_joint" type=")continuous"(.*?)<limit ',
            r'§\1prismatic"\2<limit lower="0" upper="1" ',
        ),
    ),
    _m("negative effort", "J104", (LEFT_JOINT + r'effort="', r'\1§effort="-')),
    _m("colour in bytes", "G112", (r'<color rgba="0.5 0.5 0.5 1"/>', r'§<color rgba="128 128 128 1"/>')),
    _m("scan in degrees", "C105", (r"<min_angle>-3.14<", r"§<min_angle>-180<")),
    _m(
        "plugin's sides exchanged",
        "D107",
        (r"<(left_j|leftJ)oint>left_wheel_joint", r"§<\1oint>right_wheel_joint"),
        (r"<(right_j|rightJ)oint>right_wheel_joint", r"<\1oint>left_wheel_joint"),
    ),
    _m(
        "casters without collision",
        "D116",
        (r'(<link name="front_ball">.*?)<collision>.*?</collision>', r"\1"),
        (r'(<link name="rear_ball">.*?)<collision>.*?</collision>', r"\1"),
        (r'(<joint name="left_wheel_joint")', r"§\1"),
    ),
    _m(
        "placeholder tensor",
        "I114",
        (
            LEFT + r"<inertia [^>]*/>",
            r'\1§<inertia ixx="0.0011" ixy="0" ixz="0" iyy="0.0011" iyz="0" izz="0.0011"/>',
        ),
        (
            r'(<link name="right_wheel">.*?)<inertia [^>]*/>',
            r'\1<inertia ixx="0.0011" ixy="0" ixz="0" iyy="0.0011" iyz="0" izz="0.0011"/>',
        ),
        (
            r'(<link name="front_ball">.*?)<inertia [^>]*/>',
            r'\1<inertia ixx="0.0011" ixy="0" ixz="0" iyy="0.0011" iyz="0" izz="0.0011"/>',
        ),
    ),
    _m(
        "caster in the wheel",
        "G111",
        (r'(<link name="left_wheel">.*?<collision>.*?)(<cylinder )', r"\1§\2"),
        (
            r'(<joint name="left_wheel_joint".*?<origin xyz="0 )([^ ]*)( .*?<joint name="rear_ball_joint" type="fixed">\s*<origin xyz=")[^ ]* 0 ',
            r"\1\2\g<3>0 \2 ",
        ),
    ),
    _m("plugin joint", "D101", (r"<(left_j|leftJ)oint>left_wheel_joint", r"§<\1oint>left_whel_joint")),
    _m(
        "control joint",
        "D102",
        (r'(<ros2_control .*?)<joint name="left_wheel_joint"', r'\1§<joint name="left_whel_joint"'),
    ),
    _m("gazebo reference", "D103", (r'<gazebo reference="front_ball"', r'§<gazebo reference="frnt_ball"')),
    _m(
        "transmission joint",
        "D104",
        (r'(<transmission .*?)<joint name="arm_joint"', r'\1§<joint name="amr_joint"'),
    ),
    _m("plugin separation", "D105", (r"<(wheelSeparation|wheel_separation)>[^<]*", r"§<\1>0.2")),
    _m(
        "separation property",
        "D105",
        (
            r"(<xacro:arg )(.*?<(?:wheelSeparation|wheel_separation)>)([\d.]+)",
            lambda found: _unused("wheel_separation", float(found[3])) + found[0],
        ),
    ),
    _m(
        "radius property",
        "D106",
        (
            r"(<xacro:arg )(.*?<cylinder radius=\")([\d.]+)",
            lambda found: _unused("wheel_radius", float(found[3])) + found[0],
        ),
    ),
    _m("plugin diameter", "D106", (r"<wheelDiameter>[^<]*", r"§<wheelDiameter>0.1")),
    _m("plugin radius", "D106", (r"<wheel_radius>[^<]*", r"§<wheel_radius>0.05")),
    _m(
        "wheels exchanged",
        "D107",
        (LEFT_JOINT + r'<origin xyz="0 ', r'\1§<origin xyz="0 -'),
        (RIGHT_JOINT + r'<origin xyz="0 -', r'\1<origin xyz="0 '),
    ),
    _m("axes opposed", "D108", (LEFT_JOINT + r'<axis xyz="0 1 0"/>', r'\1§<axis xyz="0 -1 0"/>')),
    _m(
        "drives backwards",
        "D109",
        (LEFT_JOINT + r'<axis xyz="0 1 0"/>', r'\1§<axis xyz="0 -1 0"/>'),
        (RIGHT_JOINT + r'<axis xyz="0 1 0"/>', r'\1<axis xyz="0 -1 0"/>'),
    ),
    _m("axis askew", "D110", (LEFT_JOINT + r'<axis xyz="0 1 0"/>', r'\1§<axis xyz="1 0 0"/>')),
    _m(
        "wheel ahead",
        "D111",
        (LEFT_JOINT + r'<origin xyz="0 ', r'\1<origin xyz="0.02 '),
        (RIGHT_JOINT + r"<origin ", r"\1§<origin "),
    ),
    _m(
        "caster hangs",
        "D112",
        (r'(<link name="front_ball">.*?<origin xyz="[^ ]* 0 )(-[^"]*)"', r'\1§${0.95*\2}"'),
    ),
    _m(
        "footprint off the ground",
        "D113",
        (r'(<joint name="base_joint" type="fixed">\s*)<origin xyz="0 0 [^"]*"', r'\1§<origin xyz="0 0 0"'),
    ),
    _m(
        "wheel in the chassis",
        "D114",
        (LEFT_JOINT + r'<origin xyz="0 [^ ]* ', r'\1§<origin xyz="0 0.01 '),
        (RIGHT_JOINT + r'<origin xyz="0 [^ ]* ', r'\1<origin xyz="0 -0.01 '),
    ),
    _m(
        "falls over",
        "D115",
        (BASE + r"<inertial>", r'\1§<inertial>\n      <origin xyz="-5 0 0" rpy="0 0 0"/>'),
    ),
    _m(
        "no casters",
        "D116",
        (r'<link name="front_ball">.*?</gazebo>', ""),
        (r'<link name="rear_ball">.*?</gazebo>', ""),
        (r'(<joint name="left_wheel_joint")', r"§\1"),
    ),
    _m("wheel fixed", "D117", (r'(<joint name="left_wheel_joint" type=")continuous"', r'§\1fixed"')),
    _m(
        "wheel limited",
        "D117",
        (
            r'(<joint name="left_wheel_joint" type=")continuous"(.*?)<limit ',
            r'§\1revolute"\2<limit lower="-3" upper="3" ',
        ),
    ),
    _m(
        "caster with friction",
        "D118",
        (r"(<joint name=\"front_ball_joint\")", r"§\1"),
        (r'(<gazebo reference="front_ball">\s*)<mu1>0.0</mu1>\s*<mu2>0.0</mu2>', r"\1<mu1>1.0</mu1>"),
    ),
    _m(
        "caster rolls about y",
        "D118",
        (
            r'(<joint name="front_ball_joint" type=")fixed"(.*?)(<child link="front_ball"/>)',
            r'\1continuous"\2\3\n    §<axis xyz="0 1 0"/> <limit effort="1" velocity="9"/>',
        ),
        (r'(<gazebo reference="front_ball">\s*)<mu1>0.0</mu1>\s*<mu2>0.0</mu2>', r"\1"),
    ),
    _m(
        "weak motors",
        "D119",
        (LEFT_JOINT + r'<limit effort="[^"]*"', r'\1§<limit effort="0.001"'),
        (RIGHT_JOINT + r'<limit effort="[^"]*"', r'\1<limit effort="0.001"'),
    ),
    _m(
        "wheel touches with a mesh",
        "D120",
        (LEFT + r"(<collision>.*?)<cylinder [^>]*/>", r'\1\2§<mesh filename="wheel.stl"/>'),
    ),
    _m("base frame", "D121", (r"<(robotBaseFrame|child_frame_id)>base_footprint", r"§<\1>base_footprnt")),
    _m(
        "wheel transforms twice",
        "D122",
        (
            r"<publishWheelTF>false",
            r"<publishWheelJointState>true</publishWheelJointState> §<publishWheelTF>true",
        ),
    ),
    _m(
        "position interface",
        "D123",
        (
            r'(<ros2_control .*?)(<joint name="left_wheel_joint">\s*<command_interface name=")velocity',
            r"\1§\2position",
        ),
    ),
    _m(
        "base off the axle",
        "D124",
        (LEFT_JOINT + r'<origin xyz="0 ', r'\1§<origin xyz="0.01 '),
        (RIGHT_JOINT + r'<origin xyz="0 ', r'\1<origin xyz="0.01 '),
    ),
    _m(
        "below the ground",
        "D128",
        (
            r'<link name="base_footprint"/>',
            r'<link name="base_footprint"> <visual> <geometry>\n§<box size="0.01 0.01 0.01"/> </geometry> </visual> </link>',
        ),
    ),
)

SENSORS = (
    _m(
        "camera without optical frame",
        "C101",
        (r'rpy="-1.570796327 0 -1.570796327"', r'rpy="0 0 0"'),
        (r"<gz_frame_id>camera_optical_link</gz_frame_id>", ""),
        (r"<sensor name=\"camera\"", r'§<sensor name="camera"'),
    ),
    _m(
        "lidar sees the arm",
        "C102",
        (r'(<joint name="lidar_joint" type="fixed">\s*<origin xyz="[^ ]* 0 )([^"]*)"', r'\1${\2-0.25}"'),
        (r'<sensor name="lidar"', r'§<sensor name="lidar"'),
    ),
    _m("sensor frame", "C103", (r"<gz_frame_id>lidar_link", r"§<gz_frame_id>lidr_link")),
    _m(
        "sensor lumped",
        "C104",
        (r"<gz_frame_id>lidar_link</gz_frame_id>", ""),
        (r'<sensor name="lidar"', r'§<sensor name="lidar"'),
    ),
)

MUTATORS = (*SOURCE, *STRUCTURE, *JOINTS, *INERTIA, *GEOMETRY, *DRIVE, *SENSORS)
