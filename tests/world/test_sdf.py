"""SDF worlds are read as in Gazebo: poses, frames, includes, shapes, and errors at their line."""

from math import pi

import numpy as np
import pytest

from kbot.text import DescriptionError
from kbot.world import Box, Capsule, Cylinder, Ellipsoid, Plane, Sphere, TriangleMesh, load_world
from kbot.world.sdf.model_paths import LIBRARY

BOX = "<geometry><box><size>1 2 0.1</size></box></geometry>"
COLLISION = f"<collision name='c'>{BOX}</collision>"
FRICTION = "<surface><friction><ode>{}</ode></friction></surface>"
NEGATIVE = "\n<mu>-1</mu>"
TURN = "<pose relative_to='{}'>0 0 0 0 0 0</pose>"
HEAVY = "<model name='m'><link name='l'><inertial>{}</inertial></link></model>"
HEIGHTMAP = "<collision name='c'><geometry><heightmap>{}<size>1 1 1</size></heightmap></geometry></collision>"
NO_MESH = "<collision name='c'><geometry><mesh><uri>no.stl</uri></mesh></geometry></collision>"


@pytest.fixture
def world(tmp_path):
    def read(inner: str, name: str = "test.world"):
        file = tmp_path / name
        file.write_text(f"<sdf version='1.7'>\n<world name='w'>\n{inner}\n</world>\n</sdf>\n")
        return load_world(file)

    return read


def static(inner: str, name: str = "m", pose: str = "0 0 0 0 0 0") -> str:
    return f"<model name='{name}'><static>true</static><pose>{pose}</pose>{inner}</model>"


def link(inner: str = "", name: str = "l", pose: str = "") -> str:
    collision = inner or f"<collision name='c'>{BOX}</collision>"
    return f"<link name='{name}'>{pose}{collision}</link>"


def place(body, part=0):
    pose = body.pose @ body.parts[part].pose
    return [*pose.translation, *pose.rpy]


def test_poses_compose_from_world_to_collision(world):
    """A model that is rotated by 90 degrees turns its link's x to the world's y."""
    inner = "<collision name='c'><pose>0.5 0 0 0 0 0</pose>" + BOX + "</collision>"
    (body,) = world(
        static(link(inner, pose="<pose>1 0 0.2 0 0 0</pose>"), pose="1 2 0 0 0 1.5707963267948966")
    ).bodies
    assert place(body) == pytest.approx([1, 3.5, 0.2, 0, 0, pi / 2])
    assert body.is_static


def test_degrees_and_quaternions(world):
    bodies = world(
        "<model name='a'><static>1</static><pose degrees='true'>0 0 0 0 0 90</pose>" + link() + "</model>"
        "<model name='b'><static>1</static><pose rotation_format='quat_xyzw'>1 0 0 0 0 1 1</pose>"
        + link()
        + "</model>"
    ).bodies
    assert place(bodies[0]) == pytest.approx([0, 0, 0, 0, 0, pi / 2])
    assert place(bodies[1]) == pytest.approx([1, 0, 0, 0, 0, pi / 2])


def test_poses_are_relative_to_frames(world):
    """The frame is attached to the first model. The second model is relative to the frame."""
    bodies = world(
        static(link(), "first", "1 0 0 0 0 1.5707963267948966")
        + "<frame name='f' attached_to='first'><pose>2 0 0 0 0 0</pose></frame>"
        "<model name='second'><static>1</static><pose relative_to='f'>0.5 0 0 0 0 0</pose>"
        + link()
        + "</model>"
    ).bodies
    assert place(bodies[1])[:3] == pytest.approx([1, 2.5, 0])


def test_links_can_be_relative_to_links_and_joints(world):
    inner = (
        link(name="a", pose="<pose>1 0 0 0 0 0</pose>")
        + link(name="b", pose="<pose relative_to='a'>1 0 0 0 0 0</pose>")
        + "<joint name='j' type='fixed'><pose>0 1 0 0 0 0</pose><parent>a</parent><child>b</child></joint>"
        + link(name="c", pose="<pose relative_to='j'>0 1 0 0 0 0</pose>")
    )
    bodies = world(static(inner)).bodies
    found = sorted(tuple(np.round(place(b, i)[:3], 9)) for b in bodies for i in range(len(b.parts)))
    assert found == [(1, 0, 0), (2, 0, 0), (2, 2, 0)]


def test_pose_places_the_placement_frame(world):
    model = (
        "<model name='m' placement_frame='l'><static>1</static><pose>5 0 0 0 0 0</pose>"
        + link(pose="<pose>1 1 0 0 0 0</pose>")
        + "</model>"
    )
    assert place(world(model).bodies[0])[:3] == pytest.approx([5, 0, 0])


def test_nested_model_is_read(world):
    inner = "<model name='inner'><pose>0 1 0 0 0 0</pose>" + link() + "</model>" + link(name="own")
    bodies = {b.name: b for b in world(static(inner, pose="1 0 0 0 0 0")).bodies}
    assert set(bodies) == {"m", "m::inner"}
    assert place(bodies["m::inner"])[:3] == pytest.approx([1, 1, 0])
    assert bodies["m::inner"].is_static


SHAPES = {
    "<box><size>1 2 3</size></box>": Box((1, 2, 3)),
    "<sphere><radius>0.5</radius></sphere>": Sphere(0.5),
    "<cylinder><radius>0.5</radius><length>2</length></cylinder>": Cylinder(0.5, 2),
    "<plane><normal>0 0 1</normal><size>3 4</size></plane>": Plane((3, 4)),
    "<plane><normal>0 0 1e-200</normal><size>5 6</size></plane>": Plane((5, 6)),
}


@pytest.mark.parametrize("text", list(SHAPES))
def test_shapes_are_read(world, text):
    collision = f"<collision name='c'><geometry>{text}</geometry></collision>"
    assert world(static(link(collision))).bodies[0].parts[0].shape == SHAPES[text]


def test_cone_is_a_mesh_of_its_volume(world):
    """The volume is r^2 pi h / 3."""
    from kbot.sim.engine.world_builder import volume as volume_of

    cone = "<geometry><cone><radius>0.5</radius><length>2</length></cone></geometry>"
    (part,) = world(static(link(f"<collision name='c'>{cone}</collision>"))).bodies[0].parts
    assert isinstance(part.shape, TriangleMesh)
    assert volume_of(part.shape) == pytest.approx(pi * 0.25 * 2 / 3, rel=0.01)


def test_equal_visual_and_collision_are_one_part(world):
    red = "<material><diffuse>1 0 0 1</diffuse></material>"
    ball = "<geometry><sphere><radius>1</radius></sphere></geometry>"
    parts = (
        world(
            static(
                link(
                    f"<collision name='c'>{BOX}</collision><visual name='v'>{BOX}{red}</visual>"
                    f"<visual name='w'>{ball}<transparency>0.5</transparency></visual>"
                    f"<collision name='d'><pose>0 0 1 0 0 0</pose>{ball}</collision>"
                )
            )
        )
        .bodies[0]
        .parts
    )
    assert [(p.solid, p.visible) for p in parts] == [(True, True), (True, False), (False, True)]
    assert parts[0].rgba == (1, 0, 0, 1)
    assert parts[2].rgba[3] == 0.5


def test_flat_boxes_are_ground_and_upright_boxes_are_obstacles(world):
    wall = "<geometry><box><size>2 0.1 0.5</size></box></geometry>"
    parts = (
        world(static(link(f"<collision name='c'>{BOX}</collision><collision name='d'>{wall}</collision>")))
        .bodies[0]
        .parts
    )
    assert [part.ground for part in parts] == [True, False]


def test_friction_and_gravity_are_read(world):
    surface = "<surface><friction><ode><mu>0.3</mu></ode></friction></surface>"
    found = world(
        "<gravity>0 0 -1.62</gravity>" + static(link(f"<collision name='c'>{BOX}{surface}</collision>"))
    )
    assert found.gravity == (0, 0, -1.62)
    assert found.bodies[0].parts[0].friction == 0.3


def test_movable_model_has_its_mass(world):
    inertia = "<inertia><ixx>0.1</ixx><iyy>0.2</iyy><izz>0.25</izz></inertia>"
    inertial = f"<inertial><pose>0 0 0.5 0 0 1.5707963267948966</pose><mass>3</mass>{inertia}</inertial>"
    (body,) = world(f"<model name='m'>{link(inertial + COLLISION)}</model>").bodies
    assert body.mass == 3
    assert body.centre_of_mass == pytest.approx((0, 0, 0.5))
    assert body.inertia[:3] == pytest.approx((0.2, 0.1, 0.25))


def test_masses_of_rigidly_connected_links_are_combined(world):
    """Two balls of 1 kg and 1 kg m^2, 2 m apart, have 2 kg and 1 + 1 + 1 + 1 kg m^2 across (Steiner)."""
    inner = (
        link(name="a") + link(name="b", pose="<pose>2 0 0 0 0 0</pose>")
        + "<joint name='j' type='fixed'><parent>a</parent><child>b</child></joint>"
    )  # fmt: skip
    (body,) = world(f"<model name='m'>{inner}</model>").bodies
    assert body.mass == 2
    assert body.centre_of_mass == pytest.approx((1, 0, 0))
    assert body.inertia[:3] == pytest.approx((2, 4, 4))


def test_links_without_joints_move_independently(world):
    bodies = world(f"<model name='m'>{link(name='a')}{link(name='b')}</model>").bodies
    assert [body.name for body in bodies] == ["m", "m::b"]


def test_includes_have_their_name_and_pose(world, tmp_path, monkeypatch):
    folder = tmp_path / "elsewhere" / "post"
    folder.mkdir(parents=True)
    (folder / "model.config").write_text(
        "<model><sdf version='1.4'>old.sdf</sdf><sdf version='1.7'>new.sdf</sdf></model>"
    )
    (folder / "new.sdf").write_text(
        f"<sdf version='1.7'><model name='post'><pose>9 9 9 0 0 0</pose>{link()}</model></sdf>"
    )
    monkeypatch.setenv("GAZEBO_MODEL_PATH", str(tmp_path / "elsewhere"))
    include = "<include><uri>model://post</uri><name>p1</name><static>true</static>"
    include += "<pose>1 2 0 0 0 0</pose></include>"
    (body,) = world(include).bodies
    assert (body.name, body.is_static) == ("p1", True)
    assert place(body)[:3] == pytest.approx([1, 2, 0])


def test_ground_plane_and_sun_of_gazebo_are_known(world):
    bodies = world(
        "<include><uri>model://ground_plane</uri></include><include><uri>model://sun</uri></include>"
    ).bodies
    assert [type(part.shape) for body in bodies for part in body.parts] == [Plane]


def test_file_of_one_model_gets_a_floor():
    bodies = load_world(LIBRARY / "crate" / "model.sdf").bodies
    assert [body.name for body in bodies] == ["ground_plane", "crate"]


@pytest.mark.parametrize("model", sorted(path.name for path in LIBRARY.iterdir() if path.is_dir()))
def test_every_library_model_is_read_without_findings(world, model):
    found = world(f"<include><uri>model://{model}</uri></include>")
    assert found.diagnostics == ()
    assert found.bodies[0].parts


def test_unsupported_elements_are_reported_once_at_their_line(world):
    plugin = "<plugin name='p' filename='libwind.so'/>"
    found = world(
        f"{plugin}\n{plugin}\n<light name='sun' type='directional'/><state world_name='w'/>" + static(link())
    )
    assert [d.code for d in found.diagnostics] == ["W210"]
    assert "does not run the plugin libwind.so" in found.diagnostics[0].message
    assert found.diagnostics[0].origin.span.line == 3


@pytest.mark.parametrize(
    ("inner", "code", "message", "instead"),
    [
        ("<include></include>", "W205", "no <uri>", "leaves the model out"),
        (static(link(HEIGHTMAP.format(""))), "W205", "<heightmap> has no <uri>", "leaves the shape out"),
        (
            static(link(HEIGHTMAP.format("<uri>test.world</uri>"))),
            "W206", "has an unknown format", "leaves the shape out",
        ),
        (static(link(COLLISION.replace("1 2 0.1", "1 -2 1"))), "W204", "above 0", "leaves the shape out"),
        (static(link(COLLISION.replace("1 2 0.1", "1 two 1"))), "W204", "3 finite", "leaves the shape out"),
        (static(link(COLLISION.replace("1 2 0.1", "1 nan 1"))), "W204", "3 finite", "leaves the shape out"),
        (
            static(link(COLLISION.replace("1 2 0.1", "1 1e308 1"))),
            "W204", "3 finite numbers up to 1e+06", "leaves the shape out",
        ),
        (static(link(), pose="1 2"), "W204", "6 finite numbers", "uses 0 0 0 0 0 0"),
        (static(link(), pose="1e7 0 0 0 0 0"), "W204", "6 finite numbers up to 1e+06", "uses 0 0 0 0 0 0"),
        ("<gravity>0 0 -1e308</gravity>", "W204", "3 finite numbers up to 10000", "uses 0 0 -9.81"),
        (
            HEAVY.format("<mass>1e300</mass>"),
            "W204", "<mass> must be a finite number up to 1e+12", "uses 1",
        ),
        (HEAVY.format("<mass>-1</mass>"), "W204", "<mass> must be above 1e-14 kg, not -1 kg", "uses 1 kg"),
        (static(link()) + static(link()), "W208", "duplicate name 'm'", "calls it 'm_2'"),
        (static(link() + link()), "W208", "duplicate name 'l'", "calls it 'l_2'"),
        (static(link(), name=""), "W205", "<model> has no name", "calls it 'unnamed_1'"),
        ("<model name='m'><static>yes</static></model>", "W204", "must be true or false", "uses false"),
        (static(link(pose=TURN.format("k"))), "W207", "unknown frame 'k'", "uses the origin of the model"),
        (
            f"<model name='m'><static>1</static>{TURN.format('n')}{link()}</model>"
            f"<model name='n'><static>1</static>{TURN.format('m')}{link()}</model>",
            "W207", "in a cycle", "puts them at the origin of the world",
        ),
    ],
)  # fmt: skip
def test_faults_are_reported_at_their_line_and_the_rest_is_used(world, inner, code, message, instead):
    found = world(inner + static(link(), "rest"))
    assert "rest" in [body.name for body in found.bodies]
    fault = next(d for d in found.diagnostics if d.code == code)
    assert message in fault.message
    assert (fault.is_error, fault.origin.span.line) == (False, 3)
    assert fault.hint.endswith(f"KBot {instead}")


def test_models_and_links_of_one_name_are_all_there(world):
    """Poses and joints that name them mean the first one."""
    links = link() + link(pose="<pose>0 1 0 0 0 0</pose>")
    inner = f"<pose relative_to='m'>0 3 0 0 0 0</pose>{links}{static(link(), 'm', '4 0 0 0 0 0')}"
    twice = static(link(), "m", "1 0 0 0 0 0") + static(link(), "m", "2 0 0 0 0 0")
    found = world(f"{twice}<model name='n'>{inner}</model>")
    assert {body.name: place(body)[:2] for body in found.bodies} == {
        "m": [1, 0],
        "m_2": [2, 0],
        "n": [1, 3],
        "n::l_2": [1, 4],
        "n::m": [5, 3],
    }
    assert [(d.code, d.message) for d in found.diagnostics] == [
        ("W208", "duplicate name 'm'"),
        ("W208", "duplicate name 'l'"),
    ]


def test_the_number_of_a_repeated_name_depends_only_on_the_names_beside_it(world):
    models = (f"<model name='n{n}'>{static(link()) * 2}</model>" for n in range(20))
    names = {body.name for body in world("".join(models)).bodies}
    assert names == {f"n{n}::{name}" for n in range(20) for name in ("m", "m_2")}


INERTIA = "<inertia><ixx>{}</ixx><iyy>{}</iyy><izz>{}</izz><ixy>{}</ixy></inertia>"


@pytest.mark.parametrize(
    ("moments", "code", "message", "repaired"),
    [
        # the negative second moment about z, (0.1 + 0.1 - 1) / 2 = -0.4 kg m^2, becomes 0
        ((0.1, 0.1, 1, 0), "W104", "KBot adds 0.4 kg m^2 to each of the smaller ones", (0.5, 0.5, 1, 0)),
        # of a cuboid of 2 kg with edges of 1, 2 and 0.1 m: m (b^2 + c^2) / 12
        ((0, 0, 0, 0), "W103", "uses that of a box around its shapes", (4.01 / 6, 1.01 / 6, 5 / 6, 0)),
        ((1, 1, 1, 0.5), None, "", (1, 1, 1, 0.5)),
    ],
)
def test_impossible_inertia_is_repaired_as_that_of_a_robot(world, moments, code, message, repaired):
    inertial = f"<inertial><mass>2</mass>{INERTIA.format(*moments)}</inertial>"
    found = world(f"<model name='m'>{link(inertial + COLLISION)}</model>")
    assert [(d.code, d.is_error) for d in found.diagnostics] == ([(code, False)] if code else [])
    assert all(message in d.hint and d.origin.span.line == 3 for d in found.diagnostics)
    xx, yy, zz, xy, xz, yz = found.bodies[0].inertia
    assert (xx, yy, zz, xy) == pytest.approx(repaired, rel=1e-6)
    assert (xz, yz) == (0, 0)


def test_links_without_inertia_that_are_joined_have_that_of_their_masses(world):
    """Two masses of 1 kg, 2 m apart, have 2 kg m^2 about their middle, and nothing along their line."""
    point = f"<inertial><mass>1</mass>{INERTIA.format(0, 0, 0, 0)}</inertial>"
    fixed = "<joint name='j' type='fixed'><parent>a</parent><child>b</child></joint>"
    far = "<pose>2 0 0 0 0 0</pose>"
    found = world(f"<model name='m'>{link(point, 'a')}{link(point, 'b', far)}{fixed}</model>")
    assert [d.code for d in found.diagnostics] == ["W104"]
    (body,) = found.bodies
    assert body.centre_of_mass == (1, 0, 0)
    assert body.inertia[1:3] == pytest.approx((2, 2), rel=1e-3)
    assert 0 < body.inertia[0] < 0.01


def test_a_fault_of_many_models_is_one_finding_with_the_count(world):
    """Of 6 plants, 4 are of a missing model and 2 of another; 3 boxes have the same mass."""
    plants = "".join(f"\n<include><uri>model://maize_{n % 3 // 2}</uri></include>" for n in range(6))
    boxes = "".join(
        f"\n<model name='b{n}'><link name='l'><inertial><mass>0</mass></inertial></link></model>"
        for n in range(3)
    )
    found = world(plants + boxes).diagnostics
    assert [(d.message, d.origin.span.line) for d in found] == [
        ("model://maize_0 not found (4 places)", 4),
        ("model://maize_1 not found (2 places)", 6),
        ("<mass> must be above 1e-14 kg, not 0 kg (3 places)", 10),
    ]
    assert [r.origin.span.line for r in found[0].related] == [5, 7, 8]


def test_a_fault_in_a_model_that_is_included_often_is_one_finding(world, tmp_path):
    write_model(tmp_path / "oak")
    file = tmp_path / "oak" / "model.sdf"
    file.write_text(file.read_text().replace("1 2 0.1", "0 2 0.1"))
    include = "<include><uri>model://oak</uri><name>oak_{}</name></include>"
    (fault,) = world("".join(include.format(n) for n in range(20))).diagnostics
    assert fault.message == "<size> of a <box> must be above 0, not '0 2 0.1'"
    assert fault.origin.span.file == str(file)


def test_cycle_of_frames_is_reported_once(world):
    ring = "".join(
        f"<model name='m{i}'><static>1</static>{TURN.format(f'm{(i + 1) % 4}')}{link()}</model>"
        for i in range(4)
    )
    (fault,) = world(ring).diagnostics
    assert "in a cycle: m0 -> m1 -> m2 -> m3 -> m0" in fault.message


def test_poses_of_a_long_chain_of_frames_add_up(world):
    """The chain has 3000 frames, 1 cm apart."""
    pose = "<pose relative_to='{}'>0.01 0 0 0 0 0</pose>"
    frames = "".join(f"<frame name='f{i + 1}'>{pose.format(f'f{i}')}</frame>" for i in range(3000))
    found = world(
        f"<frame name='f0'/>{frames}<model name='m'><static>1</static>{TURN.format('f3000')}{link()}</model>"
    )
    assert place(found.bodies[0]) == pytest.approx([30.0, 0, 0, 0, 0, 0])


def test_mesh_of_two_models_is_loaded_once(world, tmp_path):
    import trimesh

    trimesh.creation.icosphere(1).export(tmp_path / "ball.stl")
    geometry = "<geometry><mesh><uri>ball.stl</uri></mesh></geometry>"
    ball = link(f"<collision name='c'>{geometry}</collision><visual name='v'>{geometry}</visual>")
    found = world(static(ball, "first") + static(ball, "second", "3 0 0 0 0 0"))
    ((first,), (second,)) = (body.parts for body in found.bodies)
    assert first.solid
    assert first.visible
    assert first.shape is second.shape


@pytest.mark.parametrize("tag", ["numbers", "values", "bix", "polyline"])
def test_unknown_shape_is_not_simulated(world, tag):
    """The names equal methods and fields of the reader, which must not be called."""
    found = world(
        static(f"<link name='l'><collision name='c'><geometry><{tag}/></geometry></collision></link>")
    )
    assert [d.code for d in found.diagnostics] == ["W210"]
    assert found.diagnostics[0].message == f"the shape <{tag}> is not simulated"


def test_all_faults_are_reported_in_one_run(world):
    bad = static(link(f"<collision name='c'>{BOX.replace('1 2 0.1', '0 0 0')}</collision>"))
    found = world(bad + "<include><uri>model://nowhere</uri></include>")
    assert {d.code for d in found.diagnostics} == {"W202", "W204"}


def test_cycle_of_includes_is_reported(world, tmp_path):
    for name, other in (("a", "b"), ("b", "a")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "model.config").write_text("<model><sdf>model.sdf</sdf></model>")
        (tmp_path / name / "model.sdf").write_text(
            f"<sdf version='1.7'><model name='{name}'><include><uri>model://{other}</uri></include></model></sdf>"
        )
    (fault,) = world("<include><uri>model://a</uri></include>").diagnostics
    assert (fault.code, fault.is_error) == ("W203", False)
    assert "a/model.sdf -> b/model.sdf -> a/model.sdf" in fault.message


def test_included_model_that_cannot_be_read_is_left_out(world, tmp_path):
    write_model(tmp_path / "oak")
    (tmp_path / "oak" / "model.sdf").write_text("<sdf version='1.7'><model name='oak'>")
    found = world("<include><uri>model://oak</uri></include>" + static(link()))
    assert [body.name for body in found.bodies] == ["m"]
    assert [d.is_error for d in found.diagnostics] == [False]
    assert "oak/model.sdf" in str(found.diagnostics[0])


def test_pose_of_three_to_five_numbers_has_no_rotation(world):
    """Gazebo Classic reads these. libsdformat 12 does not."""
    found = world(static(link(), pose="1 2 3") + static(link(), "n", pose="4 5 6 7 8"))
    assert [place(body) for body in found.bodies] == [
        pytest.approx([1, 2, 3, 0, 0, 0]), pytest.approx([4, 5, 6, 0, 0, 0])
    ]  # fmt: skip
    assert [(d.code, d.is_error, d.origin.span.line) for d in found.diagnostics] == [("W204", False, 3)] * 2
    assert "<pose> has 3 of 6 numbers" in found.diagnostics[0].message


def test_size_that_is_missing_is_the_default_of_sdf(world):
    shapes = "box", "sphere", "cylinder", "capsule", "ellipsoid"
    collisions = (f"<collision name='{s}'><geometry><{s}/></geometry></collision>" for s in shapes)
    found = world(static(f"<link name='l'>{''.join(collisions)}</link>"))
    (body,) = found.bodies
    assert [part.shape for part in body.parts] == [
        Box((1.0, 1.0, 1.0)), Sphere(1.0), Cylinder(1.0, 1.0), Capsule(0.5, 1.0), Ellipsoid((1.0, 1.0, 1.0))
    ]  # fmt: skip
    assert {(d.code, d.is_error) for d in found.diagnostics} == {("W205", False)}
    assert "<box> has no <size>: KBot uses 1 m" in found.diagnostics[0].message


@pytest.mark.parametrize(
    ("before", "comment"), [("", "a -- b"), ("\n", ""), ("?xml version='1.0'?>\n", ""), ("<!-- a -- -->", "")]
)
def test_xml_that_libsdformat_reads_has_a_warning(tmp_path, before, comment):
    """The first characters are those of gz-sim's own worlds."""
    declaration = "" if before.startswith("?") else "<?xml version='1.0'?>"
    file = tmp_path / "test.sdf"
    inner = f"<world name='w'><!-- {comment} -->{static(link())}</world>"
    file.write_text(f"{before}{declaration}<sdf version='1.7'>{inner}</sdf>")
    found = load_world(file)
    assert len(found.bodies) == 1
    assert {(d.code, d.is_error) for d in found.diagnostics} == {("P007", False)}


@pytest.mark.parametrize(
    ("text", "code"),
    [("", "P002"), ("<robot name='r'/>", "W201"), ("<sdf version='1.7'/>", "W201"), ("<sdf>", "P001")],
)
def test_file_that_is_not_a_world_is_rejected(tmp_path, text, code):
    file = tmp_path / "bad.world"
    file.write_text(text)
    with pytest.raises(DescriptionError) as caught:
        load_world(file)
    assert caught.value.diagnostics[0].code == code


def test_missing_world_file_is_reported():
    with pytest.raises(DescriptionError, match="does not exist"):
        load_world("nowhere.world")


def test_frames_equal_those_of_libsdformat(world):
    """The world has every kind of frame. The expected poses are those of libsdformat 12.3."""
    body = "<collision name='c'><geometry><box><size>1 1 1</size></box></geometry></collision>"
    found = world(
        f"""<frame name="f" attached_to="m"><pose>2 0 0 0 0 0.3</pose></frame>
        <model name="m"><static>true</static><pose>1 2 0.5 0.1 0.2 0.3</pose>
         <link name="a"><pose>1 0 0 0 0 0.5</pose>{body}</link>
         <link name="b"><pose relative_to="a">0 1 0 0.4 0 0</pose>{body}</link>
         <joint name="j" type="fixed"><pose>0 0 1 0 0 0.7</pose><parent>a</parent><child>b</child></joint>
         <frame name="g" attached_to="j"><pose>0.5 0 0 0 0 0</pose></frame>
         <link name="d"><pose relative_to="g">0 0.5 0 0 0 0</pose>{body}</link>
         <model name="n"><pose relative_to="b">0 0 2 0 0 0</pose>
          <link name="x"><pose>0.1 0 0 0 0 0</pose>{body}</link></model>
        </model>
        <model name="p" placement_frame="l"><static>true</static><pose relative_to="f">0.5 0 0 0 0 0</pose>
         <link name="l"><pose>1 1 0 0 0 0.2</pose>{body}</link></model>
        <include><uri>model://crate</uri><name>c1</name><pose relative_to="p">0 0 1 0 0 0</pose></include>"""
    )
    poses = [place(b, i) for b in found.bodies[:-1] for i in range(len(b.parts))]
    assert sorted(poses) == [
        pytest.approx(pose, abs=1e-5)
        for pose in (
            [1.24599, 2.99012, 0.482443, 0.583632, 0.127788, 0.80174],
            [1.36948, 3.1707, 1.68749, 0.543556, -0.257471, 1.39119],
            [1.93629, 2.28963, 0.301331, 0.183632, 0.127788, 0.80174],
            [2.25483, 2.44774, 2.12502, 0.583632, 0.127788, 0.80174],
            [3.27918, 2.85893, 0.022221, 0.15481, 0.161584, 0.602518],
        )
    ]
    crate = found.bodies[-1].pose
    assert [*crate.translation, *crate.rpy] == pytest.approx(
        [2.96057, 1.51557, 1.06811, 0.119599, 0.189033, 0.401309], abs=1e-5
    )


def test_missing_mesh_does_not_affect_the_rest_of_the_world(world):
    found = world(static(link(NO_MESH + COLLISION)))
    assert "W202" in [d.code for d in found.diagnostics]
    assert len(found.bodies[0].parts) == 1


FUEL = "https://fuel.gazebosim.org/1.0/OpenRobotics/models"


@pytest.mark.parametrize(
    ("uri", "message", "hint"),
    [
        ("model://crat", "model://crat not found", "did you mean 'crate'?"),
        ("model://far_away", "model://far_away not found", "GZ_SIM_RESOURCE_PATH"),
        (f"{FUEL}/Far Away", "KBot does not download models", f"gz fuel download -u '{FUEL}/Far Away'"),
        ("https://example.org/far", "KBot does not download models", ""),
    ],
)
def test_missing_model_does_not_affect_the_rest_of_the_world(world, uri, message, hint):
    include = f"<include><uri>{uri}</uri></include>\n"
    found = world(include + include + static(link()))
    assert [body.name for body in found.bodies] == ["m"]
    (fault,) = found.diagnostics
    assert (fault.code, fault.is_error, fault.origin.span.line) == ("W202", False, 3)
    assert message in fault.message
    assert fault.message.endswith("(2 places)")
    assert hint in fault.hint


@pytest.mark.parametrize(
    ("include", "name"),
    [
        ("<include><uri>model://far</uri></include>", "far::l"),
        ("<include merge='true'><uri>model://far</uri></include>", "l"),
        ("<model name='n'><include><uri>model://far</uri></include></model>", "n::far::l"),
    ],
)
def test_names_that_a_missing_model_may_define_are_warnings(world, include, name):
    joint = f"<joint name='j' type='fixed'><parent>{name}</parent><child>b</child></joint>"
    found = world(
        f"<model name='m'>{include}{link(name='a', pose=TURN.format(name))}{link(name='b')}{joint}</model>"
    )
    assert {(d.code, d.is_error) for d in found.diagnostics} == {("W202", False), ("W207", False)}
    assert [body.name for body in found.bodies] == ["m", "m::b"]  # the joint is left out


def test_poses_relative_to_a_model_that_is_not_found_use_its_include(world):
    include = "<include><uri>model://far_away</uri><name>far</name><pose>1 2 0 0 0 0</pose></include>"
    found = world(f"{include}<model name='m'><pose relative_to='far'>0 0 3 0 0 0</pose>{link()}</model>")
    assert tuple(found.bodies[0].pose.translation) == (1.0, 2.0, 3.0)
    assert [d.code for d in found.diagnostics] == ["W202"]


@pytest.mark.parametrize(
    ("inner", "code"),
    [
        ("<collision name='c'></collision>", "W205"),
        ("<collision name='c'><geometry><mesh><uri>flat.stl</uri></mesh></geometry></collision>", "W206"),
    ],
)
def test_invalid_shape_does_not_affect_the_rest_of_the_world(world, tmp_path, inner, code):
    (tmp_path / "flat.stl").write_text("solid none\nendsolid none\n")
    found = world(static(link(inner)) + static(link(), "other"))
    assert [(d.code, d.origin.span.line, d.is_error) for d in found.diagnostics] == [(code, 3, False)]
    assert [len(body.parts) for body in found.bodies] == [0, 1]


def test_16_bit_heightmap_keeps_its_precision(world, tmp_path):
    """With white at 6.5535 m a grey level is 0.1 mm. The image's first row is the far side, +y."""
    from PIL import Image

    Image.fromarray(np.array([[0, 1, 2], [255, 256, 65535]], dtype=np.uint16)).save(tmp_path / "hills.png")
    size = "<uri>hills.png</uri><size>8 4 6.5535</size><pos>0 0 1</pos>"
    found = world(
        static(link(f"<collision name='c'><geometry><heightmap>{size}</heightmap></geometry></collision>"))
    )
    (part,) = found.bodies[0].parts
    assert part.shape.size == (8.0, 4.0)
    assert part.shape.heights * 1e4 == pytest.approx(np.array([[255, 256, 65535], [0, 1, 2]]))
    assert place(found.bodies[0]) == pytest.approx([0, 0, 1, 0, 0, 0])


def test_fuel_models_and_gazebos_own_plugins_are_known(world):
    found = world(
        f"<include><uri>{FUEL}/Ground Plane</uri></include><include><uri>{FUEL}/Sun</uri></include>"
        "<plugin filename='gz-sim-physics-system' name='gz::sim::systems::Physics'/>"
        "<plugin filename='libignition-gazebo-user-commands-system.so' name='u'/>"
    )
    assert [type(part.shape) for body in found.bodies for part in body.parts] == [Plane]
    assert found.diagnostics == ()


OAK = f"<sdf version='1.7'><model name='oak'><static>1</static>{link()}</model></sdf>"


def write_model(folder):
    folder.mkdir(parents=True)
    (folder / "model.config").write_text("<model><sdf version='1.7'>model.sdf</sdf></model>")
    (folder / "model.sdf").write_text(OAK.replace("oak", f"oak_{folder.name}"))


@pytest.mark.parametrize(
    ("folder", "uri"),
    [
        (".gz/fuel/fuel.gazebosim.org/openrobotics/models/oak tree/3", f"{FUEL}/Oak%20Tree"),
        (".ignition/fuel/fuel.ignitionrobotics.org/openrobotics/models/oak tree/1", f"{FUEL}/Oak Tree/3"),
        (".gazebo/models/oak_tree", f"{FUEL}/Oak Tree"),
        (".gazebo/models/oak_tree", "model://oak_tree"),
        ("models/Oak Tree", f"{FUEL}/Oak Tree"),
    ],
)
def test_model_downloaded_by_gazebo_is_found(world, tmp_path, monkeypatch, folder, uri):
    home = tmp_path / "home"
    write_model(home / folder)
    monkeypatch.setenv("HOME", str(home))
    monkeypatch.setenv("GZ_SIM_RESOURCE_PATH", str(home / "models"))
    found = world(f"<include><uri>{uri}</uri></include>")
    assert [body.name for body in found.bodies] == [f"oak_{folder.rpartition('/')[2]}"]
    assert found.diagnostics == ()


def test_wanted_version_and_files_of_a_downloaded_model_are_found(world, tmp_path, monkeypatch):
    import trimesh

    oak = tmp_path / ".gz/fuel/fuel.gazebosim.org/openrobotics/models/oak"
    for version in ("2", "10"):
        write_model(oak / version)
    (oak / "2/meshes").mkdir()
    trimesh.creation.icosphere(1).export(oak / "2/meshes/leaf.stl")
    monkeypatch.setenv("HOME", str(tmp_path))
    found = world(f"<include><uri>{FUEL}/Oak/2</uri></include><include><uri>{FUEL}/Oak/tip</uri></include>")
    assert [body.name for body in found.bodies] == ["oak_2", "oak_10"]
    mesh = f"<geometry><mesh><uri>{FUEL}/Oak/2/files/meshes/leaf.stl</uri></mesh></geometry>"
    found = world(static(link(f"<visual name='v'>{mesh}</visual>")))
    assert (len(found.bodies[0].parts), found.diagnostics) == (1, ())


@pytest.mark.parametrize(
    ("inner", "line"),
    [
        ("<physics type='ode'>\n<max_step_size>-0.001</max_step_size></physics>", 4),
        (static(link(f"<collision name='c'>{BOX}{FRICTION.format(NEGATIVE)}</collision>")), 4),
    ],
)
def test_invalid_negative_numbers_are_reported(world, inner, line):
    (finding,) = world(inner).diagnostics
    assert (finding.code, finding.origin.span.line) == ("W204", line)
    assert not finding.is_error
