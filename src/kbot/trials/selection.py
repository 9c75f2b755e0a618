"""What to try: the scenarios of files, and batteries for robots, as tasks of a pool."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from kbot.model import RobotModel
from kbot.model.load import SHIPPED_NAME
from kbot.text import DescriptionError, KbotError
from kbot.text.file_kind import MAY_BE_ROBOT
from kbot.text.folders import names_in
from kbot.text.suggest import did_you_mean, suggest_or_list
from kbot.trials.batteries import BATTERIES, NotApplicable, battery
from kbot.trials.errors import first_error, sentence
from kbot.trials.formats import summary_of
from kbot.trials.places import find_robot
from kbot.trials.pool import Outcome, Pool, Task, load_once
from kbot.trials.robot_folder import robot_files, robot_of_folder
from kbot.trials.scenario import RobotSource, Scenario
from kbot.trials.scenario_file import (
    SUFFIXES,
    FoundScenario,
    find_scenario_files,
    python_scenarios,
    yaml_scenarios,
)
from kbot.worker import WorkerLimits
from kbot.xacro import PackageNotFound, Packages

NO_ROBOT = "the scenario '{}' names no robot. Add robot: FILE, or try a robot with kbot try ROBOT --battery"
ALL = "all"
"""The word for all batteries."""


@dataclass(frozen=True, slots=True)
class Overrides:
    """What the command line overrides in scenarios.

    values    xacro arguments or top-level properties of the robot, by name
    packages  folders in which packages are searched first
    seeds     instead of the scenarios' own
    """

    values: Mapping[str, str] = field(default_factory=dict)
    packages: tuple[str, ...] = ()
    seeds: tuple[int, ...] = ()

    def robot(self, source: RobotSource) -> RobotSource:
        kept = {name: value for name, value in source.properties.items() if name not in self.values}
        arguments = {**source.arguments, **self.values}
        return replace(
            source, arguments=arguments, properties=kept, packages=(*self.packages, *source.packages)
        )


@dataclass
class Selection:
    """Tasks in order.

    errors        of scenario files, whose scenarios are tasks that cannot run
    robot_errors  of robots, whose trials are tasks that cannot run
    notes         which batteries are left out, and why
    """

    tasks: list[Task] = field(default_factory=list)
    errors: list[KbotError] = field(default_factory=list)
    robot_errors: list[KbotError] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def add_failed(self, name: str, error: str, robot: str = "") -> None:
        """Add a trial that cannot run."""
        self.tasks.append(Task(Scenario(name, 1.0), robot=robot, error=error))


def select_scenarios(pool: Pool, paths: Iterable[str], overrides: Overrides) -> Selection:
    """The trials of scenario files and of folders of them."""
    chosen = Selection()
    for path in paths:
        try:
            files = find_scenario_files(_scenario_path(path))
        except KbotError as error:
            chosen.errors.append(error)
            continue
        for found in _read(pool, files, chosen):
            scenario = found.scenario
            if scenario.robot is None:
                reason = f"{found.file}: {NO_ROBOT.format(scenario.name)} {found.file}"
                chosen.errors.append(KbotError(reason))
                chosen.tasks += [replace(task, error=reason) for task in _tasks(found, overrides)]
                continue
            scenario = replace(scenario, robot=overrides.robot(scenario.robot))
            chosen.tasks += _tasks(replace(found, scenario=scenario), overrides)
    return chosen


def select_batteries(
    pool: Pool, robots: Sequence[str], batteries: Sequence[str], overrides: Overrides
) -> Selection:
    """The trials of batteries with robots. A battery is the name of a built-in one, `all`, or a file.

    The robots are read in other processes, with the limits for files of strangers.

    Raises:
        KbotError: there is no such battery.
    """
    chosen = Selection()
    parts = _parts(pool, batteries)
    names = tuple(each for each in parts if isinstance(each, str))
    requests = [_Request(path, overrides, names, may_skip=ALL in batteries) for path in robots]
    outcomes = pool.map(_prepare, requests, lambda _: WorkerLimits().seconds)
    for path, outcome in zip(robots, outcomes, strict=True):
        if outcome is None:  # Ctrl-C
            continue
        if outcome.value is None:
            reason = sentence(outcome.error, f"reading {path}")
            known = isinstance(outcome.error, DescriptionError)
            chosen.robot_errors.append(outcome.error if known else KbotError(reason))  # type: ignore[arg-type]
            for each in parts:
                if isinstance(each, str):
                    chosen.add_failed(each, reason, path)
                else:
                    chosen.tasks += [replace(task, error=reason) for task in _tasks(each, overrides, path)]
            continue
        chosen.notes += outcome.value.skipped
        for each in parts:
            if isinstance(each, str):
                if each in outcome.value.failed:
                    chosen.add_failed(each, outcome.value.failed[each], path)
                if each not in outcome.value.made:
                    continue
            scenario = outcome.value.made[each] if isinstance(each, str) else each.scenario
            found = FoundScenario(scenario, "") if isinstance(each, str) else each
            placed = replace(scenario, robot=outcome.value.robot)
            chosen.tasks += _tasks(replace(found, scenario=placed), overrides, path)
    return chosen


def scenarios_for(pool: Pool, robot: RobotModel, words: Sequence[str]) -> list[FoundScenario]:
    """The scenarios of batteries for a robot that is read already. A word is one of `select_batteries`.

    Raises:
        KbotError: there is no such battery or file, it cannot be made for the robot, or two scenarios have
            the same name.
    """
    found: list[FoundScenario] = []
    skipped: list[str] = []
    for part in _parts(pool, words):
        if isinstance(part, FoundScenario):
            found.append(part)
            continue
        try:
            found.append(FoundScenario(battery(part, robot), ""))
        except NotApplicable as reason:
            if ALL not in words:
                raise
            skipped.append(str(reason))
    if not found:
        raise KbotError("; ".join(skipped) or "there is nothing to run")
    require_names([each.scenario.name for each in found])
    return found


def require_names(names: Sequence[str]) -> None:
    """Raises KbotError: two scenarios have the same name, whose results could not be distinguished."""
    for name in names:
        if names.count(name) > 1:
            raise KbotError(f"two scenarios are named '{name}'. Rename one of them")


def _parts(pool: Pool, words: Sequence[str]) -> list[str | FoundScenario]:
    return [part for word in words for part in _battery_parts(pool, word)]


def _battery_parts(pool: Pool, word: str) -> Sequence[str | FoundScenario]:
    """The names of built-in batteries that a word means, or the scenarios of a file."""
    if word.endswith(SUFFIXES) or Path(word).is_dir():
        read = Selection()
        found = _read(pool, find_scenario_files(_scenario_path(word)), read)
        if read.errors:
            raise read.errors[0]
        return found
    if word != ALL and word not in BATTERIES:
        hint = suggest_or_list(word, [ALL, *BATTERIES])
        raise KbotError(f"there is no battery and no scenario file '{word}': {hint}")
    return list(BATTERIES) if word == ALL else [word]


@dataclass(frozen=True)
class _Request:
    """A robot as it was typed, and the built-in batteries to make for it.

    `may_skip`: batteries that do not apply to the robot are left out.
    """

    path: str
    overrides: Overrides
    batteries: tuple[str, ...]
    may_skip: bool


@dataclass(frozen=True)
class _Prepared:
    """A robot that can be read, and its built-in batteries.

    made     by name
    failed   why a battery cannot be made, by name
    skipped  why batteries do not apply
    """

    robot: RobotSource
    made: dict[str, Scenario] = field(default_factory=dict)
    failed: dict[str, str] = field(default_factory=dict)
    skipped: list[str] = field(default_factory=list)


def _prepare(request: _Request) -> _Prepared:
    """Find and read a robot, in a process of the pool."""
    found = _Prepared(request.overrides.robot(RobotSource(robot_path(request.path))))
    robot = load_once(found.robot)
    for name in request.batteries:
        try:
            found.made[name] = battery(name, robot)
        except NotApplicable as reason:
            if request.may_skip:
                found.skipped.append(str(reason))
            else:
                found.failed[name] = first_error(reason)
        except KbotError as error:
            found.failed[name] = first_error(error)
    return found


def _tasks(found: FoundScenario, overrides: Overrides, robot: str = "") -> list[Task]:
    scenario = found.scenario
    return [
        Task(scenario, seed, found.python_file, found.index, robot=robot)
        for seed in overrides.seeds or scenario.seeds
    ]


def _read(pool: Pool, files: Sequence[str], chosen: Selection) -> list[FoundScenario]:
    """The scenarios of files. Those with errors are added to `chosen` as failed ones."""
    python = [file for file in files if file.endswith(".py")]
    outcomes = dict(
        zip(python, pool.map(python_scenarios, python, lambda _: WorkerLimits().seconds), strict=True)
    )
    found: list[FoundScenario] = []
    for file in files:
        if file in outcomes:
            found += _python(file, outcomes[file], chosen)
            continue
        scenarios, unusable, errors = yaml_scenarios(file)
        found += [FoundScenario(each, file) for each in scenarios]
        if errors:
            chosen.errors.append(DescriptionError(errors))
        for name in unusable:
            chosen.add_failed(name, first_error(DescriptionError(errors)))
    return found


def _python(
    file: str, outcome: Outcome[list[FoundScenario]] | None, chosen: Selection
) -> list[FoundScenario]:
    if outcome is None:  # Ctrl-C
        return []
    if outcome.value is None:
        error = sentence(outcome.error, file)
        chosen.errors.append(
            outcome.error if isinstance(outcome.error, DescriptionError) else KbotError(error)
        )
        chosen.add_failed(Path(file).name, error)
        return []
    return outcome.value


def _scenario_path(word: str) -> str:
    """The path of scenario files that was typed. Raises KbotError for a robot, with what to type instead."""
    path = Path(word)
    if word == SHIPPED_NAME or path.suffix in MAY_BE_ROBOT or _has_only_robots(word):
        raise KbotError(
            f"{word} is a robot. To try it with the built-in scenarios, use kbot try {word} --battery all. "
            f"For your own scenarios, write a file such as drive.scenario.yaml with robot: {word}"
        )
    if not path.exists():
        near = did_you_mean(path.name, names_in(path.parent))
        raise KbotError(f"there is no file or folder {word}" + (f": {near}" if near else ""))
    if path.is_file() and not word.endswith(SUFFIXES):
        raise KbotError(f"{word} is not a scenario file: their names end in {', '.join(SUFFIXES)}")
    return word


def _has_only_robots(word: str) -> bool:
    """Whether a word is a package or folder with robots, but without scenario files."""
    folder = word if Path(word).exists() else _package(word)
    if not folder or not Path(folder).is_dir():
        return False
    try:
        find_scenario_files(folder)
    except KbotError:
        return (Path(folder) / "package.xml").is_file() or _has_robot(folder)
    return folder != word


def _has_robot(folder: str) -> bool:
    return any(True for _ in robot_files(folder))


def robot_path(word: str) -> str:
    """The robot's file that was typed: a file, a folder, the name of a package, or `kbot`."""
    if not Path(word).exists() and (folder := _package(word)):
        return robot_of_folder(folder)
    return find_robot(word, Path())


def _package(word: str) -> str:
    """The folder of the package with this name, or an empty text."""
    if not word.replace("_", "").isalnum() or word == SHIPPED_NAME:
        return ""
    try:
        return Packages().find(word)
    except PackageNotFound:
        return ""


def battery_texts() -> dict[str, str]:
    """The built-in batteries by name, with one line each."""
    return {name: summary_of(function) for name, function in BATTERIES.items()}
