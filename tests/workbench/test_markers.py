"""Markers on their way to the page: none is lost, and the server loads their meshes."""

import threading
from pathlib import Path

import pytest
import trimesh

from kbot.messages import Header, Time
from kbot.messages.control import Duration
from kbot.messages.visualization import (
    DELETE,
    DELETE_ALL,
    MESH_RESOURCE,
    Marker,
    MarkerArray,
)
from kbot.ros.launch.node_settings.rviz import display_config, fixed_frame
from kbot.workbench.meshes.markers import MarkerMeshes
from kbot.workbench.meshes.store import MeshStore
from kbot.workbench.topics.marker_state import MarkerState


def current(state: MarkerState, now: int = 0) -> list[tuple[str, int]]:
    first, *rest = state.current(now).markers
    assert first.action == DELETE_ALL  # so that a page that missed some deletes them
    return [(marker.ns, marker.id) for marker in rest]


def test_markers_are_kept_until_they_are_deleted() -> None:
    state = MarkerState()
    state.take(MarkerArray((Marker(ns="a", id=1), Marker(ns="a", id=2), Marker(ns="b", id=1))))
    state.take(Marker(ns="a", id=1, text="again"))
    assert current(state) == [("a", 2), ("b", 1), ("a", 1)]
    state.take(Marker(ns="a", id=2, action=DELETE))
    assert current(state) == [("b", 1), ("a", 1)]
    state.take(Marker(ns="a", action=DELETE_ALL))
    assert current(state) == [("b", 1)]
    state.take(Marker(action=DELETE_ALL))
    assert current(state) == []


def test_a_marker_expires_after_its_lifetime() -> None:
    state = MarkerState()
    state.take(Marker(Header(Time(2)), id=1, lifetime=Duration(1, 500_000_000)))
    assert current(state, 3_400_000_000) == [("", 1)]
    assert current(state, 3_600_000_000) == []


def test_meshes_are_read_only_from_packages(tmp_path: Path) -> None:
    package = tmp_path / "things"
    package.mkdir()
    (package / "package.xml").write_text("<package><name>things</name></package>")
    for folder in (package, tmp_path):
        trimesh.creation.box((1.0, 1.0, 1.0)).export(folder / "box.stl")
    meshes, loaded = MeshStore(), threading.Event()
    for_page = MarkerMeshes(meshes, str(package / "robot.urdf"), when_loaded=loaded.set)

    def mesh_sent(address: str) -> str:
        marker = for_page(Marker(type=MESH_RESOURCE, mesh_resource=address))
        assert isinstance(marker, Marker)
        return marker.mesh_resource

    assert mesh_sent("package://things/box.stl") == ""  # it is read in the meantime
    assert loaded.wait(60)
    assert meshes.packed(mesh_sent("package://things/box.stl")) is not None
    assert mesh_sent("package://things/../box.stl") == ""
    assert mesh_sent(f"file://{tmp_path}/box.stl") == ""
    assert mesh_sent("package://nothing/box.stl") == ""
    assert mesh_sent("package://things/none.stl") == ""


def test_meshes_are_read_from_the_package_path(tmp_path: Path) -> None:
    package = tmp_path / "elsewhere" / "things"
    package.mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>things</name></package>")
    trimesh.creation.box((1.0, 1.0, 1.0)).export(package / "box.stl")
    robot = tmp_path / "robots" / "robot.urdf"
    robot.parent.mkdir()
    marker = Marker(type=MESH_RESOURCE, mesh_resource="package://things/box.stl")
    for paths, is_found in (((str(package),), True), ((), False)):
        meshes, loaded = MeshStore(), threading.Event()
        for_page = MarkerMeshes(meshes, str(robot), paths, loaded.set)
        for_page(marker)
        assert loaded.wait(60 if is_found else 0) == is_found
        mesh_sent = for_page(marker)
        assert isinstance(mesh_sent, Marker)
        assert (meshes.packed(mesh_sent.mesh_resource) is not None) == is_found


@pytest.mark.parametrize(
    ("arguments", "file"),
    [
        ("-d a.rviz", "a.rviz"),
        ("-f odom --display-config a.rviz", "a.rviz"),
        ("--display-config=a.rviz", "a.rviz"),
        ("-d", ""),
        ("", ""),
    ],
)
def test_a_launch_selects_the_displays_like_rviz(arguments: str, file: str) -> None:
    assert display_config(arguments) == file


@pytest.mark.parametrize("arguments", ["-f odom", "-d a.rviz -f odom", "--fixed-frame=odom -d a.rviz"])
def test_a_launch_selects_the_fixed_frame_like_rviz(arguments: str) -> None:
    assert fixed_frame(arguments) == "odom"
    assert fixed_frame("-d a.rviz") == ""
