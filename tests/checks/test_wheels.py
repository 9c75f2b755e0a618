"""Wheels that the rules find on robots whose shapes are in unusual places."""

from kbot.checks import Config, check_text


def wheel(side: str, y: float) -> str:
    """A wheel 0.02 m wide whose cylinder is on a tyre link, `y` from the middle."""
    return (
        f'<link name="{side}_wheel"/><link name="{side}_tyre"><collision><origin rpy="1.5708 0 0"/>'
        '<geometry><cylinder radius="0.05" length="0.02"/></geometry></collision></link>'
        f'<joint name="{side}_wheel_joint" type="continuous"><origin xyz="0 {y} 0"/><axis xyz="0 1 0"/>'
        f'<parent link="base_link"/><child link="{side}_wheel"/></joint>'
        f'<joint name="{side}_tyre_joint" type="fixed"><origin xyz="0 {0.1 if y > 0 else -0.1} 0"/>'
        f'<parent link="{side}_wheel"/><child link="{side}_tyre"/></joint>'
    )


def test_a_tyre_on_a_separate_link_is_at_that_link():
    """The wheels' joints are inside the chassis, which is 0.1 m wide. The tyres are 0.13 m from the
    middle."""
    base = (
        '<link name="base_link"><collision><geometry><box size="0.2 0.1 0.1"/></geometry></collision></link>'
    )
    text = f'<robot name="r">{base}{wheel("left", 0.03)}{wheel("right", -0.03)}</robot>'
    found = check_text(text, "r.urdf", config=Config(select=("D114", "D125")))
    assert [finding.code for finding in found] == ["D125", "D125"]


def mecanum(joint: str) -> str:
    """A base on four mecanum wheels whose axes point outwards. `joint` turns the front left wheel."""
    places = {"front_left": (0.2, 0.15), "front_right": (0.2, -0.15)}
    places |= {name.replace("front", "back"): (-0.15, y) for name, (_, y) in places.items()}
    wheels = "".join(
        f'<link name="{name}_wheel"><inertial><mass value="1"/>'
        '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial><collision>'
        '<origin rpy="1.5707963 0 0"/><geometry><cylinder radius="0.05" length="0.02"/></geometry>'
        f'</collision></link><joint name="{name}_joint" type="continuous"><origin xyz="{x} {y} 0"/>'
        f'<axis xyz="0 {1 if y > 0 else -1} 0"/><parent link="base_link"/>'
        f'<child link="{name}_wheel"/></joint>'
        for name, (x, y) in places.items()
    )
    named = "".join(
        f"<{name}_joint>{joint if name == 'front_left' else f'{name}_joint'}</{name}_joint>"
        for name in places
    )
    return (
        f'<robot name="r"><link name="base_link"/>{wheels}<gazebo><plugin name="drive" '
        f'filename="gz-sim-mecanum-drive-system">{named}<wheel_separation>0.5</wheel_separation>'
        "<wheel_radius>0.04</wheel_radius></plugin></gazebo></robot>"
    )


SIDED = ("D105", "D107", "D108", "D109", "D118", "D124", "D125", "D126", "W134")
"""Rules about two sides of wheels."""


def test_rules_about_two_sides_do_not_apply_to_a_holonomic_base():
    config = Config(select=SIDED)
    assert not check_text(mecanum("front_left_joint"), "r.urdf", config=config)
    planar = mecanum("front_left_joint").replace(
        "gz-sim-mecanum-drive-system", "libgazebo_ros_planar_move.so"
    )
    assert not check_text(planar, "r.urdf", config=config)
    without = mecanum("front_left_joint").replace("gz-sim-mecanum-drive-system", "libother.so")
    codes = {finding.code for finding in check_text(without, "r.urdf", config=config)}
    assert {"D108"} <= codes


def test_the_radius_and_the_joints_of_a_holonomic_drive_are_checked():
    config = Config(select=("D101", "D106"))
    [radius] = check_text(mecanum("front_left_joint"), "r.urdf", config=config)
    assert radius.message.startswith("drive: its wheel radius is 0.04 m, but the wheels have 0.05")
    [joint] = check_text(mecanum("front_left_jont"), "r.urdf", config=config)
    assert "'front_left_jont' is not a joint of this robot" in joint.message


def test_the_angle_of_wheels_that_roll_aside_is_named():
    """The wheels are turned by 40 degrees to the left, with the chassis below base_link."""
    joint = (
        '<joint name="chassis_joint" type="fixed"><origin rpy="0 0 0.6981"/><parent link="base_link"/>'
        '<child link="chassis"/></joint>'
    )
    wheels = (wheel("left", 0.1) + wheel("right", -0.1)).replace('"base_link"', '"chassis"')
    text = f'<robot name="r"><link name="base_link"/><link name="chassis"/>{joint}{wheels}</robot>'
    (found,) = check_text(text, "r.urdf", config=Config(select=("D132",)))
    assert found.hint == "turn the wheels by -40 degrees about z, or the whole robot below a new base link"


def test_two_casters_in_one_link_carry_the_robot():
    """Two balls of the base, 0.1 mm above the ground, before and behind the axle."""
    balls = "".join(
        f'<collision><origin xyz="{x} 0 -0.03"/><geometry><sphere radius="0.0199"/></geometry></collision>'
        for x in (0.1, -0.1)
    )
    base = (
        f'<link name="base_link"><inertial><mass value="0.1"/><origin xyz="0 0 0.05"/>'
        f'<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>{balls}</link>'
    )
    text = f'<robot name="r">{base}{wheel("left", 0.1)}{wheel("right", -0.1)}</robot>'
    assert not check_text(text, "r.urdf", config=Config(select=("D115",)))
    front = text.replace('xyz="-0.1 0 -0.03"', 'xyz="0.05 0 -0.03"')
    assert [d.code for d in check_text(front, "r.urdf", config=Config(select=("D115",)))] == ["D115"]


def test_a_negative_effort_is_no_limit():
    """Gazebo Classic takes -1 for no limit, so J104 does not deny it."""
    inertial = (
        '<inertial><mass value="500"/><inertia ixx="9" iyy="9" izz="9" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    wheels = wheel("left", 0.1) + wheel("right", -0.1)
    for effort, codes in (("1", ["D119"]), ("-1", [])):
        limited = wheels.replace("<axis", f'<limit effort="{effort}" velocity="9"/><axis')
        text = f'<robot name="r"><link name="base_link">{inertial}</link>{limited}</robot>'
        assert [d.code for d in check_text(text, "r.urdf", config=Config(select=("D119",)))] == codes
    found = check_text(text, "r.urdf", config=Config(select=("J104",)))
    assert all("means 'unlimited' only in Gazebo Classic" in d.message for d in found)
    assert len(found) == 2


def test_rules_about_turns_on_the_spot_and_motors_do_not_apply_to_a_steered_base():
    """A tricycle whose base is 50 mm behind its axle, and whose plugin drives the front wheel."""
    front = wheel("front", 0.0).replace('"base_link"', '"fork"').replace('xyz="0 -0.1 0"', 'xyz="0 0 0"')
    fork = (
        '<link name="fork"/><joint name="fork_joint" type="revolute"><parent link="base_link"/>'
        '<child link="fork"/><origin xyz="0.5 0 0"/><axis xyz="0 0 1"/>'
        '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
    )
    rear = (wheel("left", 0.1) + wheel("right", -0.1)).replace(
        'xyz="0 0.1 0"/><axis', 'xyz="0.05 0.1 0"/><axis'
    )
    rear = rear.replace('xyz="0 -0.1 0"/><axis', 'xyz="0.05 -0.1 0"/><axis')
    config = Config(select=("D124", "D125"))
    two = f'<robot name="r"><link name="base_link"/>{rear}</robot>'
    assert {d.code for d in check_text(two, "r.urdf", config=config)} == {"D124", "D125"}
    assert not check_text(two.replace("</robot>", f"{fork}{front}</robot>"), "r.urdf", config=config)


def test_the_friction_of_a_fixed_caster_is_named():
    ball = (
        '<link name="ball"><collision><geometry><sphere radius="0.02"/></geometry></collision></link>'
        '<joint name="ball_joint" type="fixed"><parent link="base_link"/><child link="ball"/>'
        '<origin xyz="-0.1 0 -0.03"/></joint>'
        '<gazebo reference="ball"><mu1>0.5</mu1><mu2>0.2</mu2></gazebo>'
    )
    text = f'<robot name="r"><link name="base_link"/>{ball}{wheel("left", 0.1)}{wheel("right", -0.1)}</robot>'
    [found] = check_text(text, "r.urdf", config=Config(select=("D118",)))
    assert found.message.startswith("ball: a fixed caster with a friction of 0.5 scrubs over the ground")


def test_a_caster_that_hangs_matters_only_where_the_robot_tips_onto_it():
    """The ball is 10 mm above the ground: behind one axle, beside it, and behind two axles."""
    ball = (
        '<link name="ball"><collision><geometry><sphere radius="0.02"/></geometry></collision></link>'
        '<joint name="ball_caster" type="fixed"><parent link="base_link"/><child link="ball"/>'
        '<origin xyz="-0.2 0 -0.02"/></joint>'
    )
    axle = wheel("left", 0.1) + wheel("right", -0.1)
    front = axle.replace("left", "front_left").replace("right", "front_right")
    front = front.replace('xyz="0 0.1 0"/><axis', 'xyz="0.3 0.1 0"/><axis')
    front = front.replace('xyz="0 -0.1 0"/><axis', 'xyz="0.3 -0.1 0"/><axis')
    beside = ball.replace('xyz="-0.2 0', 'xyz="0 0')
    for parts, codes in ((axle + ball, ["D112"]), (axle + beside, []), (axle + front + ball, [])):
        text = f'<robot name="r"><link name="base_link"/>{parts}</robot>'
        assert [d.code for d in check_text(text, "r.urdf", config=Config(select=("D112",)))] == codes
