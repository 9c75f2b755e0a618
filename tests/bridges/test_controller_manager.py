"""The services of ROS 1's controller manager, as peers call them through a link."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from kbot.messages import controller_services as srv
from kbot.model.load import load_robot_text
from kbot.model.spawned import Setting, SpawnedController, with_controllers
from kbot.record.run_outputs import RunOutputs
from kbot.ros.gazebo.controller_manager import controller_services
from kbot.ros.peer_options import PeerOptions
from kbot.ros.peers import RosPeers
from kbot.ros.service_types import service_type
from kbot.sim import Simulation
from kbot.text import KbotError

PLUGIN = (
    """<gazebo><plugin name="gazebo_ros_control" filename="libgazebo_ros_control.so">{}</plugin></gazebo>"""
)
ARM = (Path(__file__).parents[1] / "robots" / "arm.urdf").read_text()
SUMS = {
    "ListControllers": "1341feb2e63fa791f855565d0da950d8",
    "ListControllerTypes": "c1d4cd11aefa9f97ba4aeb5b33987f4e",
    "LoadController": "647e5c54b8d6468952d8d31f1efe96c0",
    "UnloadController": "647e5c54b8d6468952d8d31f1efe96c0",
    "SwitchController": "b29a7abc673b2c54c14b54e50f8d06a5",
}
SPAWNED = {
    "follow": {"type": "position_controllers/JointTrajectoryController", "joints": ["shoulder", "elbow"]},
    "states": {"type": "joint_state_controller/JointStateController", "publish_rate": 50},
}


def arm(plugin: str) -> str:
    return ARM.replace("</robot>", f"{plugin}</robot>")


class Manager:
    """A simulated arm, what its managers offer, and what the user was told."""

    def __init__(self, namespace: str = "/arm", plugin: str = PLUGIN) -> None:
        text = arm(plugin.format(f"<robotNamespace>{namespace}</robotNamespace>"))
        robot = load_robot_text(text, "arm.urdf").require()
        spawned = [
            SpawnedController(
                f"/arm/{name}",
                {k: Setting(v, robot.origin) for k, v in values.items()},
                True,
                1,
                robot.origin,
            )
            for name, values in SPAWNED.items()
        ]
        self.simulation = Simulation(with_controllers(robot, spawned if plugin else []))
        self.parameters: dict[str, object] = {}
        self.told: list[str] = []
        self.services = controller_services(self.simulation, lambda: self.parameters, self.told.append)

    def ask(self, name: str, request: object):
        return self.services[f"/arm/controller_manager/{name}"].answer(self.simulation, request)

    @property
    def states(self) -> dict[str, str]:
        listed = self.ask("list_controllers", srv.NothingRequest()).controller
        return {one.name: one.state for one in listed}


@pytest.fixture
def manager() -> Manager:
    return Manager()


def test_types_have_the_sums_that_ros_gives_them() -> None:
    """As what was generated for Noetic has them."""
    assert {name: service_type(f"controller_manager_msgs/{name}").md5 for name in SUMS} == SUMS


def test_what_is_loaded_is_listed_with_what_it_claims(manager: Manager) -> None:
    listed = manager.ask("list_controllers", srv.NothingRequest()).controller
    assert [(one.name, one.state, one.type.partition("/")[2]) for one in listed] == [
        ("follow", "running", "JointTrajectoryController"),
        ("states", "running", "JointStateController"),
    ]
    follow, states = (one.claimed_resources for one in listed)
    assert follow == (
        srv.HardwareInterfaceResources("hardware_interface::PositionJointInterface", ("shoulder", "elbow")),
    )
    assert states == (srv.HardwareInterfaceResources("hardware_interface::JointStateInterface"),)
    types = manager.ask("list_controller_types", srv.NothingRequest())
    assert "effort_controllers/JointPositionController" in types.types
    assert len(types.types) == len(types.base_classes)


def test_controllers_are_loaded_of_parameters_switched_and_unloaded(manager: Manager) -> None:
    late = {"type": "position_controllers/JointPositionController", "joint": "elbow"}
    manager.parameters = {f"/arm/late/{key}": value for key, value in late.items()}
    load, switch = srv.ControllerRequest("late"), srv.SwitchControllerRequest
    assert manager.ask("load_controller", load).ok
    assert manager.states["late"] == "stopped"
    assert not manager.ask("switch_controller", switch(("late",), (), switch.STRICT)).ok
    assert "/arm/follow commands 'elbow' too" in manager.told[-1]
    assert manager.ask("switch_controller", switch(("late",), ("follow",), switch.STRICT)).ok
    assert manager.states == {"follow": "stopped", "states": "running", "late": "running"}
    assert not manager.ask("unload_controller", load).ok
    assert manager.ask("switch_controller", switch((), ("late", "nobody"), switch.BEST_EFFORT)).ok
    assert manager.ask("unload_controller", load).ok
    assert "late" not in manager.states


def test_what_cannot_be_done_is_answered_so_and_told_in_words(manager: Manager) -> None:
    assert not manager.ask("load_controller", srv.ControllerRequest("late")).ok
    assert manager.told == [
        "/arm/controller_manager: /arm/late is not loaded: there is no parameter /arm/late/type"
    ]
    switch = srv.SwitchControllerRequest(("folow",), (), srv.SwitchControllerRequest.STRICT)
    assert not manager.ask("switch_controller", switch).ok
    assert "did you mean '/arm/follow'" in manager.told[-1]
    assert not manager.ask("reload_controller_libraries", srv.ReloadControllerLibrariesRequest()).ok
    assert manager.states == {"follow": "running", "states": "running"}


def test_libraries_are_reloaded_where_nothing_that_runs_has_to_stay(manager: Manager) -> None:
    switch = srv.SwitchControllerRequest((), ("follow",), 2)
    assert manager.ask("switch_controller", switch).ok
    refused = manager.ask("reload_controller_libraries", srv.ReloadControllerLibrariesRequest(True))
    assert not refused.ok  # joint states are told by the simulation itself
    assert manager.states == {"follow": "stopped", "states": "running"}


def test_managers_are_where_the_plugin_and_the_spawner_have_them() -> None:
    assert {name.partition("/controller_manager")[0] for name in Manager("/far").services} == {"/far", "/arm"}
    assert {name.partition("/controller_manager")[0] for name in Manager("/").services} == {"", "/arm"}
    assert Manager(plugin="").services == {}


@pytest.fixture
def peers() -> Iterator[RosPeers]:
    peers = PeerOptions().open(lambda text: None)
    yield peers
    peers.close()


def test_a_robot_that_comes_later_brings_its_manager_and_takes_it_along(peers: RosPeers) -> None:
    simulation = Manager(plugin="").simulation
    RunOutputs(print, peers=peers).join(simulation, "", "empty")
    link, service = peers._link, "/two/controller_manager/list_controllers"
    with pytest.raises(KbotError, match="no service /two"):
        link.call(service, srv.NothingRequest())
    two = load_robot_text(arm(PLUGIN.format("")).replace("world", "foot"), "two.urdf").require()
    simulation.spawn_model(two, "two", 3.0, 0.0)
    answered = link.call(service, srv.NothingRequest())
    simulation.run_errands()
    assert answered.result(0) == srv.ListControllersResponse(())
    simulation.delete_model("two")
    assert service not in link.services
