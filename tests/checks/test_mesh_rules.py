"""The mesh rules, on files of each format that the tests write."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from kbot.checks import Config, check_text
from kbot.text import Diagnostic

SIZE = (0.2, 0.1, 0.05)  # m
ONLY = Config(select=("G10", "G110", "I107", "I108", "I109", "I110", "I117"), ignore=("G106",))
FORMATS = ("stl", "obj", "dae")
COLLADA_UNIT = '<unit name="millimeter" meter="0.001"/>'


def write(mesh: trimesh.Trimesh, path: Path) -> None:
    """A mesh file; COLLADA in metres."""
    data = mesh.export(file_type=path.suffix[1:])
    path.write_bytes(data if isinstance(data, bytes) else data.encode())


def brick(factor: float = 1.0) -> trimesh.Trimesh:
    return trimesh.creation.box([s * factor for s in SIZE])


def robot(mesh: str, scale: str = "", mass: float = 1.0, origin: str = "0 0 0") -> str:
    """A robot whose second link has the mesh and the inertia tensor of a solid brick."""
    x, y, z = SIZE
    shape = f'<geometry><mesh filename="{mesh}"{scale}/></geometry>'
    moments = [mass / 12 * v for v in (y * y + z * z, x * x + z * z, x * x + y * y)]
    return (
        '<robot name="r">\n<link name="base"/>\n<link name="part">\n'
        f"<visual>{shape}</visual>\n<collision>{shape}</collision>\n"
        f'<inertial><origin xyz="{origin}"/><mass value="{mass}"/>\n'
        f'<inertia ixx="{moments[0]}" ixy="0" ixz="0" iyy="{moments[1]}" iyz="0" izz="{moments[2]}"/>'
        '</inertial>\n</link>\n<joint name="j" type="continuous"><parent link="base"/>'
        '<child link="part"/><axis xyz="0 0 1"/></joint>\n</robot>\n'
    )


def check(text: str, folder: Path) -> list[Diagnostic]:
    return list(check_text(text, str(folder / "robot.urdf"), config=ONLY))


def codes(text: str, folder: Path) -> set[str]:
    return {d.code for d in check(text, folder)}


@pytest.fixture(params=FORMATS)
def form(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def test_good_mesh_has_no_findings(tmp_path: Path, form: str) -> None:
    write(brick(), tmp_path / f"brick.{form}")
    assert check(robot(f"brick.{form}"), tmp_path) == []


def test_millimetres_are_reported_without_a_scale_only(tmp_path: Path, form: str) -> None:
    write(brick(1000.0), tmp_path / f"brick.{form}")
    (first, *_) = [d for d in check(robot(f"brick.{form}"), tmp_path) if d.code == "G104"]
    assert "measures 200 m" in first.message
    assert first.origin is not None
    assert first.origin.span.line == 4
    assert codes(robot(f"brick.{form}", ' scale="0.001 0.001 0.001"'), tmp_path) == set()


def test_collada_file_with_a_unit_must_not_be_scaled_again(tmp_path: Path) -> None:
    path = tmp_path / "brick.dae"
    write(brick(1000.0), path)
    plain, mark = path.read_text(), "<up_axis>"
    assert plain.count(mark) == 1
    path.write_text(plain.replace(mark, COLLADA_UNIT + mark))
    assert codes(robot("brick.dae"), tmp_path) == set()
    assert "G105" in codes(robot("brick.dae", ' scale="0.001 0.001 0.001"'), tmp_path)


def test_missing_file_is_reported_with_the_nearest_name(tmp_path: Path, form: str) -> None:
    write(brick(), tmp_path / f"brick.{form}")
    (found,) = check(robot(f"brikc.{form}"), tmp_path)
    assert found.code == "G101"
    assert found.hint == f"did you mean 'brick.{form}'?"


@pytest.mark.skipif(Path(__file__.upper()).exists(), reason="this file system ignores case")
def test_case_of_a_file_name_matters(tmp_path: Path, form: str) -> None:
    write(brick(), tmp_path / f"Brick.{form}")
    (found,) = check(robot(f"brick.{form}"), tmp_path)
    assert found.code == "G102"


def test_file_that_is_not_a_mesh_is_reported_with_the_reason(tmp_path: Path, form: str) -> None:
    (tmp_path / f"brick.{form}").write_text("not a mesh at all\n")
    found = check(robot(f"brick.{form}"), tmp_path)
    assert {d.code for d in found} == {"G101"}
    assert f"brick.{form}" in found[0].message


def test_collision_mesh_with_too_many_triangles_is_reported(tmp_path: Path, form: str) -> None:
    mesh = brick()
    while len(mesh.faces) <= 10_000:
        mesh = mesh.subdivide()
    write(mesh, tmp_path / f"brick.{form}")
    found = check(robot(f"brick.{form}"), tmp_path)
    assert {d.code for d in found} == {"G110"}
    assert f"{len(mesh.faces):,} triangles" in found[0].message


@pytest.mark.parametrize(("mass", "code"), [(1.0, None), (0.02, "I117"), (25.0, "I117")])
def test_density_uses_the_volume_of_a_closed_mesh(
    tmp_path: Path, form: str, mass: float, code: str | None
) -> None:
    """The brick has 1000 cm^3: 0.02 kg is 20 kg/m^3, and 25 kg is 25,000 kg/m^3."""
    write(brick(), tmp_path / f"brick.{form}")
    assert codes(robot(f"brick.{form}", mass=mass), tmp_path) == ({code} if code else set())


def test_density_of_an_open_mesh_is_not_checked(tmp_path: Path, form: str) -> None:
    mesh = brick()
    mesh.update_faces(np.arange(len(mesh.faces)) < len(mesh.faces) - 2)
    write(mesh, tmp_path / f"brick.{form}")
    assert codes(robot(f"brick.{form}", mass=25.0), tmp_path) == set()


def test_centre_of_mass_is_compared_with_the_extents_of_the_mesh(tmp_path: Path, form: str) -> None:
    write(brick(), tmp_path / f"brick.{form}")
    (found,) = check(robot(f"brick.{form}", origin="0 0 0.1"), tmp_path)
    assert found.code == "I110"
    # the brick ends at 25 mm, and the tolerance is 5 % of its longest side: 100 - 25 - 10
    assert "65 mm outside" in found.message


def test_path_that_is_not_a_regular_file_is_reported(tmp_path: Path) -> None:
    (tmp_path / "folder.stl").mkdir()
    (tmp_path / "turn.stl").symlink_to(tmp_path / "turn.stl")
    for name in ("folder.stl", "turn.stl"):
        (found,) = check(robot(name), tmp_path)
        assert (found.code, found.message) == (
            "G101",
            f"part: {tmp_path / name} is not a file that can be read (2 places)",  # visual and collision
        )


def test_double_slash_after_the_package_is_accepted(tmp_path: Path) -> None:
    (tmp_path / "package.xml").write_text("<package><name>robot</name></package>")
    write(brick(), tmp_path / "brick.stl")
    assert check(robot("package://robot//brick.stl"), tmp_path) == []
    (found,) = check(robot("package://robot//etc/passwd.stl"), tmp_path)
    assert found.message.endswith("does not exist (2 places)")


def test_a_missing_package_is_one_finding_for_all_its_meshes(tmp_path: Path) -> None:
    """Each of the two meshes is a visual and a collision: four places."""
    mesh = '<geometry><mesh filename="package://absent/a.stl"/></geometry>'
    more = f"<visual>{mesh}</visual>\n<collision>{mesh}</collision>\n".replace("a.stl", "b.stl")
    text = robot("package://absent/a.stl").replace("<inertial>", more + "<inertial>")
    (found,) = (d for d in check(text, tmp_path) if d.code == "G101")
    assert found.origin is not None
    assert found.origin.span.line == 4
    assert found.message.startswith("part: the visual's mesh package://absent/a.stl: the package 'absent'")
    assert found.message.endswith("(4 places)")
    assert [related.origin.span.line for related in found.related] == [5, 6, 7]


def test_all_places_of_a_misspelt_mesh_are_fixed_at_once(tmp_path: Path) -> None:
    write(brick(), tmp_path / "brick.stl")
    (found,) = check(robot("brikc.stl"), tmp_path)
    assert found.fix is not None
    assert [edit.replacement for edit in found.fix.edits] == ["brick.stl"] * 2


def test_empty_file_name_is_reported(tmp_path: Path) -> None:
    (found,) = check(robot(" "), tmp_path)
    assert (found.code, found.message) == ("G101", "part: the visual's mesh names no file (2 places)")
