"""The services of ROS 1's controller manager, as gazebo_ros_control runs one in each robot's namespace."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from kbot.messages import controller_services as srv
from kbot.ros.bridges.service import Answer, Service
from kbot.ros.service_types import service_type
from kbot.sim.joint_control.kinds import DIFF_DRIVE, JOINT_STATE, KINDS
from kbot.text import KbotError

if TYPE_CHECKING:
    from kbot.sim import Simulation
    from kbot.sim.robot import SimulatedRobot

Parameters = Callable[[], Mapping[str, object]]
Tell = Callable[[str], None]
BASE = "controller_interface::ControllerBase"


def controller_services(simulation: Simulation, parameters: Parameters, tell: Tell) -> dict[str, Service]:
    """Those of every manager there is now. `parameters` are what a controller is loaded of, by full name;
    `tell` is given in words why something was not done, for which the answers have no room."""
    found: dict[str, Service] = {}
    for name, robot in simulation.robots.items():
        for namespace in _managers(robot):
            found |= _services(_Manager(name, namespace, parameters, tell))
    return found


def _managers(robot: SimulatedRobot) -> set[str]:
    """Their namespaces, without a slash at the end: the plugin's, and where controllers were spawned."""
    control = robot.control
    if control.manager is None:
        return set()
    return {control.manager, *(one.name.rpartition("/")[0] for one in control.managed)}


def _services(manager: _Manager) -> Iterator[tuple[str, Service]]:
    answers: dict[str, Answer] = {
        "ListControllers": manager.list_controllers,
        "ListControllerTypes": manager.list_types,
        "LoadController": manager.answer(manager.load),
        "UnloadController": manager.answer(manager.unload),
        "SwitchController": manager.answer(manager.switch),
        "ReloadControllerLibraries": manager.answer(manager.reload),
    }
    for kind, answer in answers.items():
        words = "".join(f"_{letter.lower()}" if letter.isupper() else letter for letter in kind)
        name = f"{manager.namespace}/controller_manager/{words.lstrip('_')}"
        yield name, Service(name, service_type(f"controller_manager_msgs/{kind}"), answer)


class _Manager:
    """Of one robot; it speaks of controllers by their names in its `namespace`."""

    def __init__(self, robot: str, namespace: str, parameters: Parameters, tell: Tell) -> None:
        self._robot, self.namespace = robot, namespace
        self._parameters, self._tell = parameters, tell

    def answer(self, work: Callable[[Simulation, Any], None]) -> Answer:
        """What does the work, and says whether it was done."""

        def answer(simulation: Simulation, request: Any) -> srv.OkResponse:  # noqa: ANN401 - each asks its own
            try:
                work(simulation, request)
            except KbotError as error:
                self._tell(f"{self.namespace}/controller_manager: {error}")
                return srv.OkResponse(False)
            return srv.OkResponse(True)

        return answer

    def list_controllers(
        self, simulation: Simulation, request: srv.NothingRequest
    ) -> srv.ListControllersResponse:
        robot = simulation.named(self._robot)
        return srv.ListControllersResponse(
            tuple(
                srv.ControllerState(
                    one.name.rpartition("/")[2],
                    "stopped" if one.name in robot.stopped else "running",
                    one.kind,
                    (srv.HardwareInterfaceResources(one.hardware, one.joints),),
                )
                for one in robot.control.managed
                if one.name not in robot.unloaded and one.name.rpartition("/")[0] == self.namespace
            )
        )

    def list_types(
        self, simulation: Simulation, request: srv.NothingRequest
    ) -> srv.ListControllerTypesResponse:
        types = (*KINDS[1], DIFF_DRIVE, JOINT_STATE)
        return srv.ListControllerTypesResponse(types, (BASE,) * len(types))

    def load(self, simulation: Simulation, request: srv.ControllerRequest) -> None:
        name = self._full(request.name)
        stem = f"{name}/"
        found = {
            key.removeprefix(stem).replace("/", "."): value
            for key, value in self._parameters().items()
            if key.startswith(stem)
        }
        if "type" not in found:
            raise KbotError(f"{name} is not loaded: there is no parameter {stem}type")
        simulation.load_controller(name, found, self._robot)

    def unload(self, simulation: Simulation, request: srv.ControllerRequest) -> None:
        simulation.unload_controller(self._full(request.name), self._robot)

    def switch(self, simulation: Simulation, request: srv.SwitchControllerRequest) -> None:
        start = [self._full(name) for name in request.start_controllers]
        stop = [self._full(name) for name in request.stop_controllers]
        is_strict = request.strictness == request.STRICT
        simulation.switch_controllers(start, stop, is_strict, self._robot)

    def reload(self, simulation: Simulation, request: srv.ReloadControllerLibrariesRequest) -> None:
        """There are no libraries: what is asked for beside that is that no controller stays loaded."""
        listed = self.list_controllers(simulation, srv.NothingRequest()).controller
        if listed and not request.force_kill:
            raise KbotError("controllers are loaded: unload them first, or ask with force_kill")
        running = [self._full(one.name) for one in listed if one.state == "running"]
        simulation.switch_controllers([], running, True, self._robot)
        for one in listed:
            simulation.unload_controller(self._full(one.name), self._robot)

    def _full(self, name: str) -> str:
        return f"{self.namespace}/{name.strip('/')}"
