"""Tests which kbot_description a command uses: the shipped robot never replaces the user's own."""

import shutil
import warnings
from pathlib import Path

import pytest

import kbot
from kbot.cli.main import run
from kbot.xacro.packages import SHIPPED, Packages

pytestmark = pytest.mark.usefixtures("no_packages")

LAUNCH = "kbot_base_rviz.launch"
NOTE = "note: using the kbot_description that ships with KBot: no folder or package kbot_description is near "
SHARE = "get_package_share_directory('kbot_description')"
ROS_2 = """from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.substitutions import Command, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

def generate_launch_description():
    return LaunchDescription([Node(package='robot_state_publisher', executable='robot_state_publisher',
        parameters=[{'robot_description': Command(['xacro ', PLACE])}])])
"""


@pytest.fixture
def typed(shared: Path, tmp_path: Path) -> Path:
    """The chapter's package as a reader creates it: the folders of the first command, without package.xml."""
    folder = tmp_path / "chapter-02/src/kbot_description"
    shutil.copytree(shared / "chapter/corrected/kbot_description", folder)
    (folder / "package.xml").unlink()
    return folder


def robot_of(capsys: pytest.CaptureFixture[str]) -> str:
    """The robot file that a dry run prints. Checks that there is no note before it."""
    captured = capsys.readouterr()
    assert "ships with KBot" not in captured.err
    return captured.out.rpartition("robot: ")[2].strip()


@pytest.mark.parametrize(
    "here", ["", "kbot_description", "kbot_description/launch", "kbot_description/urdf", "other", ".."]
)
@pytest.mark.parametrize("manifest", [False, True])
def test_the_book_s_command_runs_the_reader_s_robot(
    typed: Path,
    here: str,
    manifest: bool,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (typed.parent / "other").mkdir()
    if manifest:
        (typed / "package.xml").write_text("<package><name>kbot_description</name></package>")
    monkeypatch.chdir(typed.parent / here)
    run(["launch", "kbot_description", LAUNCH, "--dry-run"])
    assert robot_of(capsys) == str(typed / "urdf/kbot.xacro")


@pytest.mark.parametrize("manifest", ["", "<package><name>kbot</name></package>"])
def test_a_launch_file_given_by_path_takes_the_package_that_contains_it(
    typed: Path, manifest: str, capsys: pytest.CaptureFixture[str]
) -> None:
    if manifest:
        (typed / "package.xml").write_text(manifest)
    run(["launch", str(typed / "launch" / LAUNCH), "--dry-run"])
    assert robot_of(capsys) == str(typed / "urdf/kbot.xacro")


def test_the_reader_s_broken_file_is_reported(
    typed: Path, shared: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(shared / "chapter/printed/kbot_description", typed, dirs_exist_ok=True)
    (typed / "package.xml").unlink()
    for file in (typed / "launch" / LAUNCH, typed / "launch/kbot_base_rviz_gazebo.launch"):
        assert run(["launch", str(file), "--dry-run"]) == 2
        assert f"{typed}/urdf/kbot.xacro:3:13: error: not well-formed XML" in capsys.readouterr().err


def test_the_package_that_contains_the_file_wins_over_one_in_the_working_directory(
    typed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(typed, tmp_path / "second/kbot_description")
    monkeypatch.chdir(tmp_path / "second")
    run(["launch", str(typed / "launch" / LAUNCH), "--dry-run"])
    assert robot_of(capsys) == str(typed / "urdf/kbot.xacro")


@pytest.mark.parametrize("place", [f"{SHARE} + '/urdf/kbot.xacro'", "FOUND"])
def test_launch_files_of_ros_2_find_the_reader_s_folder(
    typed: Path, place: str, capsys: pytest.CaptureFixture[str]
) -> None:
    found = "PathJoinSubstitution([FindPackageShare('kbot_description'), 'urdf', 'kbot.xacro'])"
    file = typed / "launch/kbot.ros.launch.py"
    file.write_text(ROS_2.replace("PLACE", place).replace("FOUND", found))
    run(["launch", str(file), "--trust", "--dry-run"])
    assert robot_of(capsys) == str(typed / "urdf/kbot.xacro")
    file = typed / "launch/kbot.ros.launch.xml"
    file.write_text(
        '<launch><node pkg="robot_state_publisher" exec="robot_state_publisher">'
        """<param name="robot_description" value="$(command '"""
        "xacro $(find-pkg-share kbot_description)/urdf/kbot.xacro')\"/></node></launch>"
    )
    run(["launch", str(file), "--dry-run"])
    assert robot_of(capsys) == str(typed / "urdf/kbot.xacro")


@pytest.fixture
def with_mesh(typed: Path) -> Path:
    """A reader's description that finds its parts and mesh through the package's name."""
    name = "kbot_description"
    (typed / "meshes").mkdir()
    (typed / "meshes/base.stl").write_text(
        "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex .3 0 0\nvertex 0 .5 0\n"
        "endloop\nendfacet\nendsolid\n"
    )
    mesh = f'<mesh filename="package://{name}/meshes/base.stl"/>'
    head = '<robot name="own" xmlns:xacro="http://www.ros.org/wiki/xacro">'
    (typed / "urdf/base.xacro").write_text(
        f'{head}<link name="own_base"><visual><geometry>{mesh}</geometry></visual></link></robot>'
    )
    file = typed / "urdf/own.xacro"
    file.write_text(f'{head}<xacro:include filename="$(find {name})/urdf/base.xacro"/></robot>')
    return file


@pytest.mark.parametrize(
    ("verb", "text"),
    [
        (["expand"], "own_base"),
        (["info"], "(0.3, 0.5, 0) m"),
        (["where", "own_base"], "urdf/base.xacro:1"),
        (["export", "-o", "own.glb"], ""),
        (["check", "--select", "G101"], ""),
        (["sim", "--headless", "--duration", "0"], "simulated"),
    ],
)
def test_find_and_package_addresses_mean_the_reader_s_folder(
    with_mesh: Path, verb: list[str], text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run([verb[0], str(with_mesh), *verb[1:]]) == 0
    captured = capsys.readouterr()
    assert text in captured.out
    assert "ships with KBot" not in captured.err
    assert "does not exist" not in captured.err


def test_a_real_package_in_a_folder_of_the_same_name_is_the_package(tmp_path: Path) -> None:
    """As in a clone: the repository and its package have the same name."""
    inner = tmp_path / "kbot_description/kbot_description"
    inner.mkdir(parents=True)
    (inner / "package.xml").write_text("<package><name>kbot_description</name></package>")
    for around in (inner.parent / "README.md", inner / "a.launch"):
        assert Packages(around=str(around)).find("kbot_description") == str(inner)


def test_explicit_paths_may_contain_a_folder_without_a_manifest(
    typed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert Packages([typed.parent]).find("kbot_description") == str(typed)
    assert Packages([typed]).find("kbot_description") == str(typed)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(typed.parent))
    assert Packages().find("kbot_description") == str(typed)
    monkeypatch.delenv("ROS_PACKAGE_PATH")
    shutil.copytree(typed, "prefix/share/kbot_description")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(Path("prefix").absolute()))
    assert Packages().find("kbot_description") == str(Path("prefix/share/kbot_description").absolute())


def test_a_note_comes_first_if_the_shipped_robot_is_used(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["launch", "kbot_description", LAUNCH, "--dry-run"]) == 0
    err = capsys.readouterr().err
    assert err == (
        f"{NOTE}{tmp_path / 'elsewhere'}, or in --package-path, AMENT_PREFIX_PATH or ROS_PACKAGE_PATH\n"
    )
    file = tmp_path / "mine/r.launch"
    file.parent.mkdir()
    file.write_text(
        '<launch><param name="robot_description" '
        'textfile="$(find kbot_description)/urdf/kbot.xacro"/></launch>'
    )
    run(["launch", str(file), "--dry-run"])
    assert capsys.readouterr().err.startswith(f"{NOTE}{file} or {tmp_path / 'elsewhere'}, or in ")


@pytest.mark.parametrize("verb", ["expand", "info", "check"])
def test_a_note_comes_first_if_a_description_uses_parts_of_the_shipped_robot(
    tmp_path: Path, verb: str, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "r.xacro"
    file.write_text(
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">'
        '<xacro:include filename="$(find kbot_description)/urdf/kbot.xacro"/></robot>'
    )
    run([verb, str(file)])
    assert capsys.readouterr().err.startswith(f"{NOTE}{file} or ")
    with pytest.warns(UserWarning, match="using the kbot_description that ships with KBot"):
        kbot.load(file)


def test_the_word_kbot_means_the_whole_shipped_robot_without_a_note(
    typed: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(typed.parent)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(typed.parent))
    run(["launch", "kbot", LAUNCH, "--dry-run"])
    assert robot_of(capsys) == f"{SHIPPED}/kbot_description/urdf/kbot.xacro"
    assert run(["expand", "kbot", "control:=ros2_control"]) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    assert f"<parameters>{SHIPPED}/kbot_description/config/" in captured.out
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        kbot.load("kbot")


HERE = {"by path": "the folder that contains the file", "by name": "the folder in the working directory"}


@pytest.mark.parametrize("origin", ["--package-path", "AMENT_PREFIX_PATH", "ROS_PACKAGE_PATH"])
@pytest.mark.parametrize("how", HERE)
def test_one_note_names_the_user_s_folder_that_a_variable_or_option_hides(
    typed: Path,
    tmp_path: Path,
    how: str,
    origin: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    other = shutil.copytree(typed, tmp_path / "other/share/kbot_description")
    words = {"by path": [str(typed / "launch" / LAUNCH)], "by name": ["kbot_description", LAUNCH]}[how]
    place = tmp_path / "other" / ("share" if origin == "ROS_PACKAGE_PATH" else "")
    if origin == "--package-path":
        words += [origin, str(place)]
    else:
        monkeypatch.setenv(origin, str(place))
    if how == "by name":
        monkeypatch.chdir(typed.parent.parent)
    run(["launch", *words, "--dry-run"])
    captured = capsys.readouterr()
    assert captured.out.rpartition("robot: ")[2].strip() == str(other / "urdf/kbot.xacro")
    notes = [line for line in captured.err.splitlines() if line.startswith("note: ")]
    assert notes == [
        f"note: the package kbot_description is {other} (from {origin}), not {typed}, {HERE[how]}"
    ]


def test_a_package_that_is_the_user_s_own_folder_gets_no_note(
    typed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Also with a symbolic link, from the enclosing folder, and if installed by links."""
    (typed / "package.xml").write_text("<package><name>kbot_description</name></package>")
    (tmp_path / "linked").symlink_to(typed.parent)
    share = tmp_path / "prefix/share/kbot_description"
    shutil.copytree(typed, share, copy_function=lambda file, link: Path(link).symlink_to(file))
    monkeypatch.chdir(typed.parent)
    for variable, place in (
        ("ROS_PACKAGE_PATH", typed.parent),
        ("ROS_PACKAGE_PATH", tmp_path / "linked"),
        ("AMENT_PREFIX_PATH", tmp_path / "prefix"),
    ):
        monkeypatch.setenv(variable, str(place))
        for words in ([str(typed / "launch" / LAUNCH)], ["kbot_description", LAUNCH]):
            run(["launch", *words, "--dry-run"])
            assert "note: " not in capsys.readouterr().err
        monkeypatch.delenv(variable)
