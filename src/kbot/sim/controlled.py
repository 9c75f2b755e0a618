"""A running world whose controllers are started, stopped, loaded and unloaded, as ROS 1's controller manager
does it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from kbot.sim.joint_control.control import ManagedController
from kbot.sim.joint_control.controllers import load_controller
from kbot.sim.joint_control.kinds import DIFF_DRIVE, JOINT_STATE
from kbot.sim.numbers import shortened
from kbot.sim.population import Population
from kbot.sim.robot import SimulatedRobot
from kbot.text import KbotError
from kbot.text.suggest import did_you_mean


class Controlled(Population):
    """Controllers are spoken of by their full names, as `/arm/follow`."""

    def switch_controllers(
        self,
        start: Sequence[str],
        stop: Sequence[str],
        strict: bool = True,
        robot: str | None = None,
    ) -> None:
        """Let controllers run, and others not, all at once. Unless it is `strict`, what cannot be started or
        stopped is left as it is.

        Raises:
            KbotError: nothing is changed: two would command one joint, or, where it is `strict`, one is not
                loaded, runs already, or does not run.
        """
        for names in (start, stop):
            if isinstance(names, str) or not isinstance(names, Sequence):
                raise KbotError(f"controllers are a list of names, not {shortened(names)}")
        if not isinstance(strict, bool):
            raise KbotError(f"strict is True or False, not {shortened(strict)}")
        switched = self.named(robot)
        managed = _loaded(switched)
        running = managed.keys() - switched.stopped
        starts, stops = set[str](), set[str]()
        for name in stop:
            try:
                stops.add(_stoppable(name, managed, running))
            except KbotError:
                if strict:
                    raise
        for name in start:
            try:
                starts.add(_startable(name, switched, managed, running - stops))
            except KbotError:
                if strict:
                    raise
        _require_free_joints(starts, (running - stops) | starts, managed)
        switched._start_and_stop(frozenset(starts), frozenset(stops - starts))
        self._serve(switched)
        self._note("switch_controllers", start=list(start), stop=list(stop), strict=strict, robot=robot)

    def load_controller(self, name: str, parameters: Mapping[str, object], robot: str | None = None) -> None:
        """Load a controller of ROS 1, of its parameters by dotted name; it does not run yet.

        Raises:
            KbotError: there is one of its name, or it would not be loaded, or heard; the reason is said.
        """
        if not isinstance(name, str):
            raise KbotError(f"a controller has a name, not {shortened(name)}")
        if not isinstance(parameters, Mapping) or not all(isinstance(key, str) for key in parameters):
            raise KbotError(f"a controller's parameters have names, unlike {shortened(parameters)}")
        loader = self.named(robot)
        if name in _loaded(loader):
            raise KbotError(f"{name} is loaded already")
        loaded = load_controller(loader.robot, loader._driving, loader.naming, name, parameters)
        before = loader._save_controllers()
        loader._take(*loaded)
        try:
            self._topics[loader.name].hear_controller(name)
        except KbotError:
            loader._restore_controllers(before)
            self._topics[loader.name].hear_controller(name)
            raise
        loader.loaded[name] = dict(parameters)
        self._note("load_controller", name=name, parameters=dict(parameters), robot=robot)

    def unload_controller(self, name: str, robot: str | None = None) -> None:
        """Forget a controller. Raises KbotError: it is not loaded, or it runs."""
        loader = self.named(robot)
        _require_loaded(name, _loaded(loader))
        if name not in loader.stopped:
            raise KbotError(f"{name} runs: stop it first")
        loader._unload(name)
        loader.loaded.pop(name, None)
        self._note("unload_controller", name=name, robot=robot)


def _loaded(robot: SimulatedRobot) -> dict[str, ManagedController]:
    return {one.name: one for one in robot.control.managed if one.name not in robot.unloaded}


def _require_loaded(name: str, managed: Mapping[str, ManagedController]) -> ManagedController:
    if not isinstance(name, str):
        raise KbotError(f"a controller has a name, not {shortened(name)}")
    if name not in managed:
        hint = did_you_mean(name, managed)
        raise KbotError(f"no controller {name} is loaded" + (f": {hint}" if hint else ""))
    return managed[name]


def _stoppable(name: str, managed: Mapping[str, ManagedController], running: Iterable[str]) -> str:
    if _require_loaded(name, managed).kind == JOINT_STATE:
        raise KbotError(f"{name} is not stopped: the simulation tells joint states itself")
    if name not in running:
        raise KbotError(f"{name} is not stopped: it does not run")
    return name


def _startable(
    name: str, robot: SimulatedRobot, managed: Mapping[str, ManagedController], running: Iterable[str]
) -> str:
    kind = _require_loaded(name, managed).kind
    if name in running:
        raise KbotError(f"{name} is not started: it runs already")
    if kind == DIFF_DRIVE and (robot.settings is None or robot.settings.controller != name):
        raise KbotError(
            f"{name} is not started: what drives is chosen when a run begins, so spawn it started"
        )
    states = f"{name.rpartition('/')[0]}/joint_states"
    if kind == JOINT_STATE and states not in (
        robot.naming.topic("joint_states"),
        *robot.control.state_topics,
    ):
        raise KbotError(f"{name} is not started: nothing tells {states}, so spawn it started")
    return name


def _require_free_joints(
    starts: Iterable[str], running: Iterable[str], managed: Mapping[str, ManagedController]
) -> None:
    for name in sorted(starts):
        for other in sorted(running):
            both = set(managed[name].joints) & set(managed[other].joints)
            if other != name and both:
                raise KbotError(f"{name} is not started: {other} commands '{min(both)}' too")
