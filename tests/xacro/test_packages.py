"""Tests that packages are found in the documented order, by the name in their manifest."""

import os
import re
from pathlib import Path

import pytest

from kbot.xacro import PackageNotFound, Packages, expand
from kbot.xacro.packages import SHIPPED, is_shipped, may_change, public_repositories

pytestmark = pytest.mark.usefixtures("no_packages")


def package(folder: Path, name: str) -> Path:
    folder.mkdir(parents=True)
    (folder / "package.xml").write_text(f"<package><name> {name} </name></package>")
    return folder


def test_packages_are_searched_in_order(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = package(tmp_path / "ws/robot", "robot")
    near = package(tmp_path / "ws/p", "p")
    ros = package(tmp_path / "ros/p", "p")
    ament = package(tmp_path / "prefix/share/p", "p")
    given = package(tmp_path / "given/deep/p", "p")
    around = str(robot / "robot.xacro")
    assert Packages(around=around).find("p") == str(near)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "ros"))
    assert Packages(around=around).find("p") == str(ros)
    monkeypatch.setenv("AMENT_PREFIX_PATH", os.pathsep.join(["/none", str(tmp_path / "prefix")]))
    assert Packages(around=around).find("p") == str(ament)
    assert Packages([str(tmp_path / "given")], around).find("p") == str(given)


def test_a_package_has_the_name_in_its_manifest_not_that_of_its_folder(tmp_path: Path) -> None:
    folder = package(tmp_path / "ws/some_folder", "real_name")
    packages = Packages([str(tmp_path / "ws")])
    assert packages.find("real_name") == str(folder)
    with pytest.raises(PackageNotFound):
        packages.find("some_folder")


def test_the_nearest_name_is_suggested(tmp_path: Path) -> None:
    package(tmp_path / "ws/kbot_description_2", "my_description")
    with pytest.raises(PackageNotFound, match="did you mean 'my_description'"):
        Packages([str(tmp_path / "ws")]).find("my_descripton")


def test_the_public_repository_of_a_well_known_package_is_named(tmp_path: Path) -> None:
    package(tmp_path / "ws/velodine_description", "velodine_description")  # a similar name
    with pytest.raises(PackageNotFound) as caught:
        Packages([str(tmp_path / "ws")]).find("velodyne_description")
    repository = "https://github.com/ToyotaResearchInstitute/velodyne_simulator"
    assert caught.value.hint.startswith(f"get it from {repository} and put its folder below")
    (tmp_path / "velodyne_description").mkdir()
    with pytest.raises(PackageNotFound, match=r"has no package\.xml"):
        Packages(around=str(tmp_path)).find("velodyne_description")


def test_every_public_repository_has_an_owner_and_a_name() -> None:
    known = public_repositories()
    assert len(known) >= 50
    assert list(known) == sorted(known)
    for name, repository in known.items():
        assert re.fullmatch(r"[a-z][a-z0-9_]+", name)
        assert re.fullmatch(r"[\w-]+/[\w.-]+", repository)


def test_symbolic_links_are_not_resolved(tmp_path: Path) -> None:
    package(tmp_path / "real/p", "p")
    (tmp_path / "ws").mkdir()
    (tmp_path / "ws/link").symlink_to(tmp_path / "real/p")
    assert Packages([str(tmp_path / "ws")]).find("p") == str(tmp_path / "ws/link")


def test_uris(tmp_path: Path) -> None:
    mesh = package(tmp_path / "ws/p", "p") / "a b.stl"
    mesh.write_text("")
    packages = Packages([str(tmp_path / "ws")])
    assert packages.resolve("package://p/a%20b.stl") == str(mesh)
    assert packages.resolve(f"file://{mesh}") == str(mesh)
    assert packages.resolve("a b.stl", str(mesh.parent / "robot.urdf")) == str(mesh)
    assert packages.resolve("package://p/none.stl") is None
    assert packages.resolve("package://none/none.stl") is None
    assert packages.resolve("https://example.org/a.stl") is None


def test_others_of_a_name_in_the_working_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    first, second = package(tmp_path / "a", "bot"), package(tmp_path / "b", "bot")
    elsewhere = package(tmp_path / "build" / "c", "bot")  # a folder that is not searched
    assert Packages().find("bot") == str(first)
    assert Packages().others("bot") == (str(second),)
    assert Packages([str(elsewhere)]).others("bot") == ()
    with pytest.raises(PackageNotFound):
        Packages().others("none")


def test_the_shipped_package_is_found_last() -> None:
    with pytest.warns(UserWarning, match="using the kbot_description that ships with KBot"):
        found = Packages().find("kbot_description")
    assert Path(found, "package.xml").is_file()


def test_only_files_in_the_working_directory_may_change(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own, shipped = tmp_path / "own", Path(SHIPPED) / "kbot_description" / "package.xml"
    own.mkdir()
    (own / "to_shipped.xml").symlink_to(shipped)
    (tmp_path / "other.xacro").touch()
    (own / "to_other.xacro").symlink_to(tmp_path / "other.xacro")
    monkeypatch.chdir(own)
    allowed = [
        name
        for name in ("new.xacro", "to_other.xacro", "to_shipped.xml", "../other.xacro", shipped)
        if may_change(name)
    ]
    assert allowed == ["new.xacro"]
    monkeypatch.chdir(shipped.parent)
    assert not may_change("package.xml"), "KBot's own files never change"
    assert is_shipped(own / "to_shipped.xml")
    assert not is_shipped(tmp_path / "other.xacro")


def test_find_in_a_description(tmp_path: Path) -> None:
    folder = package(tmp_path / "ws/p", "p")
    (folder / "r.xacro").write_text('<r xmlns:xacro="http://www.ros.org/wiki/xacro" f="$(find p)/x"/>')
    document = expand(folder / "r.xacro").require().document
    assert document is not None
    assert document.attributes == {"f": f"{folder}/x"}
