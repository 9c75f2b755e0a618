"""Runs one scenario with one seed. Equal inputs give equal results, bit for bit."""

from __future__ import annotations

import io
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace

from kbot.extensions import program_runner
from kbot.kinematics.planar_pose import PlanarPose
from kbot.learn.policies.driving import fitted, policy_goals
from kbot.learn.policies.policy import Policy
from kbot.model import RobotModel
from kbot.model.load import load_robot, resolve_robot_path
from kbot.navigation.goal_status import GoalState
from kbot.navigation.goals.goals import Goals
from kbot.navigation.simulated.odometry_estimate import OdometryEstimate
from kbot.record.record_options import RecordOptions
from kbot.record.run_outputs import Peers, RunOutputs
from kbot.sensors.declared import Sensors, mount_declared
from kbot.sensors.lidar import Lidar, LidarSensor
from kbot.sim import Simulation
from kbot.sim.script import Script
from kbot.text import KbotError
from kbot.text.errors import Stopped
from kbot.text.suggest import suggest_or_list
from kbot.trials.actions import (
    TO_GOALS,
    AddObject,
    Command,
    DriveWithPolicy,
    InjectFault,
    JointCommand,
    MoveObject,
    Push,
    RemoveObject,
)
from kbot.trials.errors import first_error
from kbot.trials.expectations import Bound, NeverTouches
from kbot.trials.failure import failure_time
from kbot.trials.measures import all_measures
from kbot.trials.results import MeasureResult, TrialResult
from kbot.trials.scans import ScanSampler
from kbot.trials.scenario import RobotSource, Scenario, Step, holds
from kbot.trials.surroundings import concerned_lines, surroundings
from kbot.trials.trace import RATE, Event, Sampler
from kbot.xacro import Packages
from kbot.xacro.assignments import require_overridden, resolve_names

ScriptSource = str | Callable[[Simulation], object]


def load_source(source: RobotSource) -> RobotModel:
    """The robot of a source. Raises DescriptionError: it has errors. Raises KbotError: it cannot be read."""
    packages = Packages(source.packages)
    path = resolve_robot_path(source.file)
    given = resolve_names(path, source.arguments, packages, source.properties).require()
    properties = {**given.properties, **source.properties}
    loaded = load_robot(source.file, given.arguments, properties, packages)
    robot = loaded.require()
    require_overridden(properties, loaded.expansion)
    return robot


def run_trial(
    scenario: Scenario,
    seed: int = 0,
    robot: RobotModel | None = None,
    *,
    with_all_values: bool = False,
    with_trace: bool = False,
    with_scans: bool = False,
    record: str = "",
    watch: Callable[[Simulation], object] | None = None,
) -> TrialResult:
    """Run a scenario. What goes wrong is in the result's `error`.

    `robot` replaces the scenario's own.
    `with_all_values` computes all measures. `with_trace` keeps the trace, and `with_scans` the scans of the
    lidars.
    `record` is a file to record the run to. `watch` gets the simulation before it starts.
    """
    begun = time.perf_counter()
    result = TrialResult(scenario.name, seed)
    try:
        robot = robot if robot is not None else load_source(_require_robot(scenario))
        result = _run(
            scenario,
            seed,
            robot,
            record,
            watch,
            with_all_values=with_all_values,
            with_trace=with_trace,
            with_scans=with_scans,
        )
    except KbotError as error:
        result = replace(result, error=first_error(error))
    return replace(result, wall=time.perf_counter() - begun)


def _require_robot(scenario: Scenario) -> RobotSource:
    if scenario.robot is None:
        raise KbotError(f"the scenario '{scenario.name}' names no robot")
    return scenario.robot


def _run(
    scenario: Scenario,
    seed: int,
    robot: RobotModel,
    record: str,
    watch: Callable[[Simulation], object] | None,
    *,
    with_all_values: bool,
    with_trace: bool,
    with_scans: bool,
) -> TrialResult:
    world = scenario.world_of(seed)
    simulation = Simulation(robot, world, seed, start=scenario.start)
    sensors = _mount_sensors(simulation, scenario, is_watched=watch is not None)
    lidars = {name: each.spec for name, each in sensors.items() if isinstance(each.spec, Lidar)}
    scanner = ScanSampler(simulation, lidars if with_scans else {})
    if watch is not None:
        watch(simulation)
    needs_clearance = with_all_values or "clearance" in _quantities(scenario)
    stage = _Stage(simulation, scenario, Sampler(simulation, with_clearance=needs_clearance))
    outputs: RunOutputs | None = None
    with ExitStack() as stack:
        if record or scenario.programs:
            outputs = RunOutputs(lambda _: None, RecordOptions(record), _peers(scenario))
            stack.callback(outputs.close)
            outputs.join(simulation, "", world)
        known = {body.name for body in simulation.world.bodies}
        error = stage.run()
        known |= {body.name for body in simulation.world.bodies} | set(simulation.robots)
        error = error or _unknown_object(scenario, known)
        trace = stage.sampler.trace()
        values: dict[str, float] = {}
        if with_all_values:
            values = {measure.name: measure.compute(trace) for measure in all_measures(trace)}
        if outputs is not None:
            outputs.close()  # completes the recording
        is_recorded = outputs is not None and outputs.failure is None
        measures = tuple(result for each in scenario.expect for result in each.results(trace))
        measures += stage.steps_begun()
        result = TrialResult(
            scenario.name,
            seed,
            measures,
            error,
            simulation.state_sha256(),
            simulation.findings,
            all_values=values,
            trace=trace if with_trace else None,
            scans=scanner.scans(),
            surroundings=surroundings(simulation, scenario) if with_trace else None,
            source_lines=concerned_lines(robot, measures, trace) if with_trace else (),
            robot=robot.name,
            recording=record if is_recorded else "",
            is_deterministic=all(program.lockstep for program in scenario.programs),
        )
        if result.error:
            return replace(result, failed_at=simulation.time)
        return result if result.passed else replace(result, failed_at=failure_time(scenario.expect, trace))


def _peers(scenario: Scenario) -> Peers | None:
    if not scenario.programs:
        return None
    peers: Peers = program_runner().open_programs(scenario.programs, lambda _: None)
    return peers


_BLIND = (Command, *TO_GOALS, Push, InjectFault, AddObject, MoveObject, RemoveObject, JointCommand)
"""The actions that read no sensor, apart from the lidar of a goal."""


def _mount_sensors(simulation: Simulation, scenario: Scenario, *, is_watched: bool) -> Sensors:
    """Mount the declared sensors, and return them by name. Those whose readings nothing can read measure only
    for subscribers.

    A sensor has no influence on the motion, and an IMU at 200 Hz takes more time than the physics. Scripts
    and actions of users may read the newest reading without a subscription. So do goals, from a lidar.
    """
    sensors, _ = mount_declared(simulation, strict=False)
    actions = [step.action for step in scenario.steps]
    if is_watched or scenario.programs or not all(isinstance(each, _BLIND) for each in actions):
        return sensors
    has_goal = any(isinstance(each, TO_GOALS) for each in actions)
    for sensor in sensors.values():
        sensor.only_with_subscribers |= not (has_goal and isinstance(sensor, LidarSensor))
    return sensors


def _quantities(scenario: Scenario) -> set[str]:
    """The quantities that conditions and bounds use."""
    names = {name for step in scenario.steps for name in step.when} | set(scenario.until)
    return names | {each.measure for each in scenario.expect if isinstance(each, Bound)}


def _unknown_object(scenario: Scenario, known: set[str]) -> str:
    """Why an expectation about an object cannot fail: there was no such object. Empty if there was."""
    known = known | {step.action.name for step in scenario.steps if isinstance(step.action, AddObject)}
    for each in scenario.expect:
        for name in each.objects if isinstance(each, NeverTouches) else ():
            if name not in known:
                hint = suggest_or_list(name, sorted(known))
                return f"never_touches: no object has the name '{name}': {hint}"
    return ""


def _step_error(step: Step, number: int, error: KbotError) -> KbotError:
    place = f"{step.place}: " if step.place else ""
    return KbotError(f"{place}step {number}, {step.action}: {first_error(error)}")


class _Ended(Stopped):
    """The scenario is over. It ends a script, which may still be running."""


class _Stage:
    """A running scenario: begins its steps, and samples the run."""

    def __init__(self, simulation: Simulation, scenario: Scenario, sampler: Sampler) -> None:
        self.simulation, self.sampler = simulation, sampler
        self._scenario = scenario
        self._waiting: list[Step] = list(scenario.steps)
        self._scripts: list[ScriptSource] = []
        self._goals_on_map: Goals | None = None
        self._estimate: OdometryEstimate | None = None
        self._goals: Goals | None = None
        """Those that drive the robot now."""
        self._goal_reports = 0
        self._failure: KbotError | None = None
        self._timer = simulation.clock.every(RATE, self._tick)

    def run(self) -> str:
        """Run to the end. Returns why the run ended early, or an empty text."""
        simulation = self.simulation
        try:
            self._require_fitting_policies()
            self._begin_steps()
            while True:
                if self._scripts:
                    self._run(self._scripts.pop(0))
                else:
                    simulation.run(1.0 / RATE)
        except _Ended:
            pass
        except KbotError as error:  # a script that fails, or a simulation that diverges, too
            return first_error(error)
        finally:
            self._timer.cancel()
        return "" if self._failure is None else first_error(self._failure)

    def steps_begun(self) -> tuple[MeasureResult, ...]:
        """A failed measure if steps have not begun: the run did not test what the scenario describes."""
        if not self._waiting or self._failure is not None:
            return ()
        step, count = self._waiting[0], len(self._scenario.steps)
        begun = count - len(self._waiting)
        place = f"{step.place}: " if step.place else ""
        now = self.sampler.now
        values = ", ".join(f"{name} is {now[name]:.4g}" for name in step.when)
        why = f"{place}step {begun + 1} still waits for its condition: {values}" if values else ""
        return (MeasureResult("steps_begun", float(begun), "", float(count), None, why),)

    def go(self, goal: PlanarPose, timeout: float | None) -> None:
        if self._goals_on_map is None:
            self._goals_on_map = Goals(self.simulation)
        self._go(self._goals_on_map, goal, timeout)

    def go_with_policy(self, policy: Policy, goal: PlanarPose, arrive: float, timeout: float | None) -> None:
        self._estimate = self._estimate or OdometryEstimate(self.simulation)
        self._go(policy_goals(self.simulation, policy, arrive, self._estimate), goal, timeout)

    def _go(self, goals: Goals, goal: PlanarPose, timeout: float | None) -> None:
        """Drive to a goal. It replaces the goal of others."""
        if goals is not self._goals:
            if self._goals is not None:
                self._goals.give_way("another goal replaced it")
                self._goals.unwatch(self._look_at_goal)
            self._goals, self._goal_reports = goals, goals.count
            goals.watch(self._look_at_goal)
        goals.go(goal, timeout)

    def run_script(self, script: ScriptSource) -> None:
        self._scripts.append(script)

    def _run(self, script: ScriptSource) -> None:
        if isinstance(script, str):
            Script(script).run(self.simulation, io.StringIO())
        else:
            script(self.simulation)

    def _tick(self) -> None:
        self.sampler.sample()
        try:
            self._begin_steps()
        except KbotError as error:
            self._failure = error
            raise _Ended from error
        scenario = self._scenario
        is_over = self.simulation.time >= scenario.duration - 0.5 / RATE
        if is_over or (scenario.until and not self._waiting and holds(scenario.until, self.sampler.now)):
            raise _Ended

    def _begin_steps(self) -> None:
        """Begin the steps that are due. A step waits until the previous one has begun."""
        while self._waiting:
            step, now = self._waiting[0], self.simulation.time
            if now < step.at - 0.5 / RATE or not holds(step.when, self.sampler.now):
                return
            del self._waiting[0]
            self.sampler.events.append(Event(now, str(step.action)))
            self.sampler.last_step = now
            try:
                step.action.begin(self)
            except KbotError as error:
                raise _step_error(step, len(self._scenario.steps) - len(self._waiting), error) from error

    def _require_fitting_policies(self) -> None:
        """Raises KbotError: a policy does not fit the robot. A late step would report it late."""
        for number, step in enumerate(self._scenario.steps, 1):
            if isinstance(step.action, DriveWithPolicy):
                try:
                    fitted(Policy.read(step.action.file), self.simulation)
                except KbotError as error:
                    raise _step_error(step, number, error) from error

    def _look_at_goal(self) -> None:
        goals = self._goals
        status = goals.status if goals is not None else None
        if goals is None or status is None or not status.state.is_end or goals.count == self._goal_reports:
            return
        self._goal_reports = goals.count
        self.sampler.events.append(Event(self.simulation.time, f"goal {status}", "goal"))
        self.sampler.goals_reached += status.state is GoalState.REACHED
