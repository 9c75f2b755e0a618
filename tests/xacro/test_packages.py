"""Tests that packages are found in the documented order, by the name in their manifest."""

import os
import re
from pathlib import Path

import pytest

from kbot.xacro import AmbiguousPackage, PackageNotFound, Packages, expand
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


CHAPTERS = ("chapter-02/bot", "chapter-03/bot")
"""Packages of one name, relative to the working directory."""


@pytest.mark.parametrize("packages", [CHAPTERS, ("bot", "old/bot"), ("a/x", "b/deep/y"), ("src/a", "src/b")])
@pytest.mark.parametrize("around", [None, "elsewhere/robot.xacro", "robot.xacro", "robot/urdf/robot.xacro"])
def test_an_ambiguous_package_is_an_error_that_lists_the_places(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, packages: tuple[str, str], around: str | None
) -> None:
    here = tmp_path / "here"
    first, second = (package(here / folder, "bot") for folder in packages)
    monkeypatch.chdir(here)
    place = None if around is None else str(tmp_path / around if "else" in around else here / around)
    if around == "robot.xacro" and packages[0] == "bot":
        assert Packages(around=place).find("bot") == str(first)  # it is beside the file
        return
    for _ in range(2):
        searched = Packages(around=place)
        with pytest.raises(AmbiguousPackage) as caught:
            searched.find("bot")
        assert str(caught.value) == (
            f"several packages are named 'bot': {first}, {second}: "
            "add the right one to --package-path or ROS_PACKAGE_PATH"
        )
        assert searched.folder("bot") is None


@pytest.mark.parametrize(
    "file", ["chapter-03/bot/launch/x.launch", "chapter-03/x.launch", "chapter-03/launch/deep/x.launch"]
)
def test_the_folder_of_the_file_decides(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, file: str) -> None:
    _, third = (package(tmp_path / folder, "bot") for folder in CHAPTERS)
    monkeypatch.chdir(tmp_path)
    assert Packages(around=str(tmp_path / file)).find("bot") == str(third)


def test_the_nearest_workspace_decides(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = package(tmp_path / "second/src/robot", "robot")
    package(tmp_path / "first/src/bot", "bot")
    near = package(tmp_path / "second/src/group/bot", "bot")
    monkeypatch.chdir(tmp_path)
    assert Packages(around=str(robot / "robot.xacro")).find("bot") == str(near)
    monkeypatch.chdir(near)
    assert Packages().find("bot") == str(near)


def test_the_order_of_paths_and_variables_decides(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """rospack and ament use the first package that they find."""
    second, third = (package(tmp_path / folder, "bot") for folder in CHAPTERS)
    prefixes = [tmp_path / "one", tmp_path / "two"]
    installed = [package(prefix / "share/bot", "bot") for prefix in prefixes]
    monkeypatch.chdir(tmp_path)
    for order in (slice(None), slice(None, None, -1)):
        parents = [str(folder.parent) for folder in (second, third)][order]
        assert Packages(parents).find("bot") == str(Path(parents[0]) / "bot")
        with monkeypatch.context() as environment:
            environment.setenv("ROS_PACKAGE_PATH", os.pathsep.join(parents))
            assert Packages().find("bot") == str(Path(parents[0]) / "bot")
        with monkeypatch.context() as environment:
            environment.setenv("AMENT_PREFIX_PATH", os.pathsep.join(map(str, prefixes[order])))
            assert Packages().find("bot") == str(installed[order][0])
    with monkeypatch.context() as environment:  # several below one folder of the variable: the first one, too
        environment.setenv("ROS_PACKAGE_PATH", str(tmp_path))
        assert Packages().find("bot") == str(second)
    with pytest.raises(AmbiguousPackage):
        Packages([str(tmp_path)]).find("bot")


def test_a_package_that_is_seen_twice_is_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own = package(tmp_path / "src/bot", "bot")
    for built in ("build/bot", "install/bot/share/bot", "install_isolated/share/bot", ".cache/bot"):
        package(tmp_path / built, "bot")
    package(tmp_path / "archive/bot", "bot")
    (tmp_path / "archive/COLCON_IGNORE").touch()
    (tmp_path / "links").mkdir()
    (tmp_path / "links/bot").symlink_to(own)
    monkeypatch.chdir(tmp_path)
    assert Path(Packages().find("bot")).resolve() == own
    assert Path(Packages([str(tmp_path)]).find("bot")).resolve() == own


def test_folders_with_the_name_of_a_shipped_package_are_ambiguous_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Learners create the folders of the chapters by hand, some without a package.xml."""
    package(tmp_path / "chapter-03/kbot_description", "kbot_description")
    (tmp_path / "chapter-02/kbot_description/urdf").mkdir(parents=True)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(AmbiguousPackage):
        Packages().find("kbot_description")
    file = tmp_path / "chapter-02/kbot_description/urdf/kbot.xacro"
    assert Packages(around=str(file)).find("kbot_description") == str(file.parents[1])


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
