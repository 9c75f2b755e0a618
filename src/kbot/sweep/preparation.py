"""Checks what the user asked for, and makes the plan of a sweep from it. Nothing runs before."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TypeVar

from kbot.model.load import resolve_robot_path
from kbot.model.units import units_of
from kbot.sweep.designs import MOST_TOGETHER, Method
from kbot.sweep.inputs import file_digests, read_inputs, scenario_files
from kbot.sweep.objectives import parse_objectives
from kbot.sweep.plan import Plan, world_with_parameter
from kbot.sweep.space import Dimension, Space, Target, parse_space
from kbot.text import KbotError
from kbot.text.extras import needs_extra
from kbot.text.notes import note
from kbot.trials.actions import TO_GOALS
from kbot.trials.batteries import BATTERIES
from kbot.trials.errors import sentence
from kbot.trials.places import find_world
from kbot.trials.pool import Pool, Task
from kbot.trials.python_file import read_python_scenarios
from kbot.trials.scenario import RobotSource, Scenario
from kbot.trials.scenario_keys import unit_of_key, with_key
from kbot.trials.selection import ALL, Overrides, require_names, robot_path, select_batteries
from kbot.worker import WorkerLimits
from kbot.world import built_in, parameters
from kbot.xacro import Packages, expand
from kbot.xacro.assignments import resolve_names
from kbot.xacro.result import Expansion

A = TypeVar("A")
T = TypeVar("T")

_GOAL_MEASURES = frozenset({"goal_time", "goals_reached"})
"""Measures that only a scenario with a goal has."""
_LIBRARIES = {Method.LHS: "SciPy", Method.OPTIMIZE: "Optuna"}
"""The library that chooses the designs of these methods. NumPy draws its random numbers."""
RUN_PROGRAMS = ("kbot", "mujoco-core")
"""The programs on which the result of a run depends. The others choose the designs."""


@dataclass(frozen=True, kw_only=True)
class Request:
    """What the user asked for.

    robot       a file, a package, or `kbot`
    dimensions  what varies, each as `NAME=VALUES`
    scenarios   names of batteries, or scenario files
    objectives  measures or dimensions, each with `:min` or `:max`
    method      how designs are chosen
    runs        the number of designs; None: all of a grid
    values      of arguments or top-level properties that do not vary
    packages    folders in which packages are searched first
    """

    robot: str
    dimensions: Sequence[str]
    scenarios: Sequence[str]
    objectives: Sequence[str] = ()
    method: Method = Method.GRID
    runs: int | None = None
    values: Mapping[str, str] = field(default_factory=dict)
    packages: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Raises KbotError: no `--set` or no `--scenario` is given."""
        if not self.dimensions:
            raise KbotError(
                "nothing varies. Add --set NAME=VALUES, for example --set wheel_radius=0.02:0.05:7"
            )
        if not self.scenarios:
            raise KbotError("no scenario is given. Add --scenario NAME|FILE; kbot try --list lists the names")


def prepare(request: Request, pool: Pool) -> Plan:
    """The plan of a sweep.

    Raises:
        KbotError: something that was asked for does not exist, or cannot be.
        KeyboardInterrupt: Ctrl-C.
    """
    space = parse_space(request.dimensions)
    _require_fixed(request.values, space)
    designs = _count(space, request)
    for each in space.dimensions:
        if each.is_integer_range and each.target is not Target.SEED:
            note(f"{each} has only integers. For all numbers, write 1.0 instead of 1")
    versions = _versions(request.method)
    numeric = [each.name for each in space.dimensions if each.kind is not str]
    objectives = parse_objectives(request.objectives, numeric)
    if request.method is Method.OPTIMIZE and not objectives:
        raise KbotError("--method optimize needs --objective MEASURE, for example --objective energy")
    tasks = _select(request, _call(pool, _required, (request, space), request.robot), pool)
    if any(each.target is Target.SEED for each in space.dimensions):
        tasks = _first_seeds(tasks)
    robot = tasks[0].scenario.robot
    if robot is None:
        raise TypeError("a selected battery has a robot")
    _require_worlds(request, space, tasks)
    _require_goals([each.name for each in objectives], tasks)
    found = _call(pool, _read, _ReadRequest(robot, space, tuple(tasks)), request.robot)
    for text in found.notes:
        note(text)
    space = Space(
        tuple(
            replace(
                each,
                target=Target.PROPERTY if each.name in found.varied_properties else each.target,
                unit=found.units.get(each.name, ""),
            )
            for each in space.dimensions
        )
    )
    read = read_inputs(found.robot, space, tasks, pool)
    return Plan(
        found.robot,
        space,
        tuple(replace(task, with_all_values=True) for task in tasks),
        objectives,
        request.method,
        designs,
        file_digests(found.files | read.files),
        read.optional_parts,
        versions,
    )


def _require_fixed(values: Mapping[str, str], space: Space) -> None:
    """Raises KbotError: a value that does not vary is also varied."""
    for each in space.dimensions:
        if each.name in values:
            raise KbotError(f"{each.name}:={values[each.name]} and --set {each} both set it. Remove one")


def _count(space: Space, request: Request) -> int:
    """The number of designs."""
    if request.method is not Method.GRID:
        if request.runs is None:
            raise KbotError(f"--method {request.method} needs --runs N, the number of combinations to run")
        if request.method is Method.LHS and request.runs > MOST_TOGETHER:
            raise KbotError(
                f"--method lhs draws all combinations together, at most {MOST_TOGETHER}, not {request.runs}. "
                "For more, use --method random"
            )
        is_drawn = request.method in (Method.RANDOM, Method.LHS)
        if is_drawn and space.size is not None and request.runs > space.size:
            raise KbotError(
                f"--runs {request.runs} is more than the {space.size} combinations of these values. "
                "--method grid runs each of them once"
            )
        return request.runs
    if space.size is None:
        wide = next(each for each in space.dimensions if each.count is None)
        raise KbotError(
            f"--set {wide}: a grid needs the number of values, for example {wide}:7. "
            "For any values, add --method random, lhs or optimize, and --runs N"
        )
    return space.size if request.runs is None else min(request.runs, space.size)


def _versions(method: Method) -> dict[str, str]:
    """The versions of the programs on which the results depend. Raises KbotError: an extra is missing."""
    try:
        import pyarrow.parquet  # noqa: F401 - for the table; an extra, and slow to import
    except ModuleNotFoundError:
        raise KbotError(needs_extra("a sweep", "sweep")) from None
    found = {}
    library = _LIBRARIES.get(method, "")
    chooses = () if method is Method.GRID else ("numpy", *filter(None, [library.lower()]))
    for name in (*RUN_PROGRAMS, *chooses):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            if name == library.lower():
                raise KbotError(needs_extra(f"--method {method.value}", "sweep")) from None
    return found


def _first_values(space: Space) -> dict[str, str]:
    """The first value of each dimension of the robot."""
    return {
        each.name: str(each.domain.samples()[0])
        for each in space.dimensions
        if each.target is Target.ARGUMENT  # properties too, until the robot is read
    }


def _required(asked: tuple[Request, Space]) -> dict[str, str]:
    """The first value of each dimension without which the robot cannot be read, because it has no default."""
    request, space = asked
    path, first = resolve_robot_path(robot_path(request.robot)), _first_values(space)
    packages = Packages(request.packages).beside(path)
    found = expand(path, {**request.values, **first}, packages=packages, lenient=True)
    return {
        name: value for name, value in first.items() if name in found.declared and name not in found.defaults
    }


def _select(request: Request, required: Mapping[str, str], pool: Pool) -> list[Task]:
    overrides = Overrides({**request.values, **required}, request.packages)
    selection = select_batteries(pool, [request.robot], request.scenarios, overrides)
    if pool.interrupted:
        raise KeyboardInterrupt
    errors = [*selection.robot_errors, *selection.errors]
    errors += [KbotError(task.error) for task in selection.tasks if task.error]
    if errors:
        raise errors[0]
    if not selection.tasks:
        raise KbotError("; ".join(selection.notes) or "the scenarios contain nothing to run")
    require_names([task.scenario.name for task in _first_seeds(selection.tasks)])
    return selection.tasks


def _first_seeds(tasks: Sequence[Task]) -> list[Task]:
    """The first run of each scenario."""
    found: dict[int, Task] = {}
    for task in tasks:
        found.setdefault(id(task.scenario), task)  # all runs of a scenario have the same object
    return list(found.values())


def _require_worlds(request: Request, space: Space, tasks: Sequence[Task]) -> None:
    """Raises KbotError: a world, or a parameter of the scenarios' world, does not exist."""
    worlds = next((each for each in space.dimensions if each.target is Target.WORLD), None)
    names = [task.scenario.world for task in tasks]
    if worlds is not None:
        names = [str(value) for value in worlds.domain.samples()]
        for name in names:
            find_world(name, Path())
        batteries = BATTERIES if ALL in request.scenarios else set(request.scenarios) & set(BATTERIES)
        for task in tasks:
            if task.scenario.name in batteries and task.scenario.world != Scenario.world:
                raise KbotError(
                    f"--set {worlds.name}: the battery {task.scenario.name} has its own world,"
                    f" {task.scenario.world}, which tests the robot. Try other worlds with other scenarios"
                )
    for each in space.dimensions:
        if each.target is Target.WORLD_PARAMETER:
            part = each.name.partition(".")[2]
            for name in dict.fromkeys(names):
                if not built_in(name):
                    raise KbotError(f"--set {each.name}: the world {name} has no parameters")
                parameters(world_with_parameter(name.replace("{seed}", "0"), part, each.domain.samples()[0]))


def _require_goals(objectives: Sequence[str], tasks: Sequence[Task]) -> None:
    """Raises KbotError: an objective is about goals, and no scenario has one."""
    for name in objectives:
        may_have_goals = any(
            task.python_file or any(isinstance(step.action, TO_GOALS) for step in task.scenario.steps)
            for task in tasks
        )
        if name in _GOAL_MEASURES and not may_have_goals:
            raise KbotError(f"--objective {name}: no scenario measures it, because none has a goal")


@dataclass(frozen=True)
class _ReadRequest:
    """What to read in a process of the pool, with the limits for files of strangers."""

    robot: RobotSource
    space: Space
    tasks: tuple[Task, ...]


@dataclass(frozen=True)
class _ReadResult:
    """What the dimensions mean for the robot.

    robot              with the arguments and properties that do not vary
    varied_properties  the names of dimensions that are top-level properties
    files              the files of the scenarios
    notes              one line for each name that has two meanings
    units              the units of dimensions by name, as far as they are known
    """

    robot: RobotSource
    varied_properties: frozenset[str]
    files: frozenset[str]
    notes: tuple[str, ...]
    units: Mapping[str, str]


def _call(pool: Pool, work: Callable[[A], T], item: A, name: str) -> T:
    """Call a function that reads the robot `name`, in a process of the pool."""
    (outcome,) = pool.map(work, [item], lambda _: WorkerLimits().seconds)
    if outcome is None:
        raise KeyboardInterrupt
    if outcome.value is None:
        known = isinstance(outcome.error, KbotError)
        raise outcome.error if known else KbotError(sentence(outcome.error, f"reading {name}"))  # type: ignore[misc]  # `known` shows that it is one
    return outcome.value


def _read(reading: _ReadRequest) -> _ReadResult:
    """Find what the dimensions mean. Raises KbotError: a name is unknown, or no value is accepted."""
    robot = reading.robot
    path, packages = resolve_robot_path(robot.file), Packages(robot.packages)
    first = _first_values(reading.space)
    fixed = {name: value for name, value in robot.arguments.items() if name not in first}
    properties = resolve_names(path, {**fixed, **first}, packages).require().properties
    files: set[str] = set()
    units: dict[str, set[str]] = {each.name: set() for each in reading.space.dimensions}
    for task in reading.tasks:
        scenario = task.scenario
        if task.python_file:
            files.add(task.python_file)
            scenario = replace(read_python_scenarios(task.python_file)[task.index], robot=robot)
        for each in reading.space.dimensions:
            if each.target is Target.SCENARIO:
                _require_key(scenario, each)
                units[each.name].add(unit_of_key(scenario, each.name.partition(".")[2]))
        files |= set(scenario_files(scenario, reading.space))
    robot = replace(
        robot,
        arguments={name: value for name, value in fixed.items() if name not in properties},
        properties={name: value for name, value in fixed.items() if name in properties},
    )
    expansion = expand(path, {**fixed, **first}, packages=packages, lenient=True)
    of_parameters = units_of(expansion)
    known = {**(expansion.scope.values if expansion.scope is not None else {}), **expansion.defaults}
    for name in first:
        if name in known:
            units[name].add(of_parameters.get(id(known[name]), ""))
    return _ReadResult(
        robot,
        frozenset(properties) & frozenset(first),
        frozenset(files),
        tuple(_same_names(reading.space, expansion)),
        # scenarios may disagree, as about the bound of a measure
        {name: each.pop() for name, each in units.items() if len(each) == 1},
    )


def _same_names(space: Space, found: Expansion) -> Iterator[str]:
    """A note for each dimension whose name the robot also uses for something that does not vary."""
    for each in space.dimensions:
        binding = found.scope.values.get(each.name) if found.scope is not None else None
        node = binding.node if binding is not None and binding.attribute == "value" else None
        is_argument = each.name in found.declared
        if each.target in (Target.WORLD, Target.SEED) and (is_argument or node is not None):
            kind = "argument" if is_argument else "property"
            yield (
                f"--set {each} varies the {each.target} of the simulation, not the robot's {kind} "
                f"'{each.name}'. To vary that one, give it another name"
            )
        elif each.target is Target.ARGUMENT and is_argument and node is not None:
            value = node.attributes["value"]
            if "$" not in value:  # else it may be computed from the argument
                yield (
                    f"--set {each} varies the argument '{each.name}'. The property of the same name is "
                    f"{value} in all designs"
                )


def _require_key(scenario: Scenario, dimension: Dimension) -> None:
    """Raises KbotError: the scenario has no such key, or accepts none of a few values."""
    errors: list[KbotError] = []
    values = dimension.domain.samples()
    for value in values:
        try:
            with_key(scenario, dimension.name.partition(".")[2], value)
        except KbotError as error:
            errors.append(error)
    if len(errors) == len(values):
        raise KbotError(f"scenario {scenario.name}: {errors[0]}")
