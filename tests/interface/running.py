"""What KBot prints as JSON, writes and publishes, from verbs that run in this process.

Drives and scenarios are as short as possible: only the names and types of the outputs count. The robots are
the one of `kbot new`, and the same with sensors and another joint.
"""

from __future__ import annotations

import json
import math
import threading
import time
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, chdir, contextmanager
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple
from unittest.mock import patch
from xml.etree import ElementTree

import yaml
from click.testing import CliRunner
from mcap.reader import make_reader
from pyarrow import parquet

from kbot.cli.main import group
from kbot.learn import PolicyInterface, Sectors
from kbot.navigation import Goals, NavigationTopics
from kbot.record.run_outputs import RunOutputs
from kbot.ros.peers import RosPeers
from kbot.sensors.declared import mount_declared
from kbot.sim import Simulation
from kbot.worker import Worker

from .commands import commands

ROBOT = "bot/urdf/bot.xacro"
EQUIPPED = """\
<robot name="equipped" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:include filename="bot/urdf/bot.xacro"/>
  <link name="slider">
    <inertial>
      <mass value="0.1"/> <inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/>
    </inertial>
  </link>
  <joint name="slide" type="prismatic">
    <parent link="base_link"/><child link="slider"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="0.1" effort="1" velocity="1"/><mimic joint="left_wheel_joint" multiplier="0.01"/>
  </joint>
  <gazebo reference="base_link">
    <sensor name="scan" type="ray">
      <ray><scan><horizontal><samples>4</samples></horizontal></scan></ray>
    </sensor>
    <sensor name="imu" type="imu"/>
    <sensor name="gps" type="gps"/>
    <sensor name="range" type="sonar"/>
  </gazebo>
</robot>
"""
_TRIAL = "--scenario drive.scenario.yaml -j 1"
CASES: Mapping[str, tuple[str, ...]] = {
    "check": ("check broken.xacro --statistics", "check twice.urdf"),
    "compare": (f"compare {ROBOT} wider/bot/urdf/bot.xacro {_TRIAL}",),
    "identify": (f"identify log.csv {ROBOT}",),
    "info": ("info equipped.xacro", "info broken.xacro"),
    "rule": ("rule D131",),
    "sim": (
        "sim equipped.xacro --headless --goto 0.1,0,0 --record run.mcap",
        f"sim {ROBOT} --headless --script fails.py",
    ),
    "bag info": ("bag info run.mcap",),  # after `sim` wrote it
    "sweep": (f"sweep {ROBOT} --set seed=1,2 --objective final_turn --out sweep {_TRIAL}",),
    "try": (
        f"try {ROBOT} --battery drive.scenario.yaml --csv grades.csv -j 1",
        f"try {ROBOT} --battery fails.scenario.yaml --junit junit.xml -j 1",
    ),
    "where": (f"where {ROBOT} left_wheel", f"where {ROBOT} wheel_radius"),
}
"""The verbs with `--json`, each with command lines that show all its keys."""
QUERIES: Mapping[str, str] = {
    "node info": "node info /kbot",
    "node list": "node list",
    "service list": "service list",
    "tf echo": "tf echo odom base_link --once",
    "tf tree": "tf tree",
    "topic info": "topic info /odom",
    "topic list": "topic list",
}
"""The verbs with `--json` that ask a running KBot."""
PLAIN = {"param get", "service call", "topic echo"}
"""The verbs with `--json` that print a message or a value as it is."""
_BY_NAME = {
    "kbot check: statistics",
    "kbot bag info: topics",
    "kbot identify: sources",
    "kbot node info: Publishers",
    "kbot node info: Service Servers",
    "kbot node info: Subscribers",
    "kbot service list: ",
    "kbot sim: failure.values",
    "kbot sweep: objectives",
    "kbot sweep: best[].objectives",
    "kbot sweep: best[].values",
    "kbot tf tree: ",
    "kbot topic list: ",
    "source map: elements[].attributes",
    "sweep.json: inputs",
}
"""Objects whose keys are names of the user, the robot or a message. A line has `*` for them."""


class _Facts(NamedTuple):
    json: tuple[str, ...]
    files: tuple[str, ...]
    ros: tuple[str, ...]


def json_lines() -> Iterable[str]:
    """One line for each value that a verb prints with `--json`, with its types."""
    return _facts().json


def files() -> Iterable[str]:
    """One line for each part of a file that KBot writes."""
    return _facts().files


def ros() -> Iterable[str]:
    """One line for each topic, service, parameter and frame of a running KBot."""
    return _facts().ros


@cache
def _facts() -> _Facts:
    # trials run in this process: starting others takes seconds
    in_this_process = patch.object(Worker, "call", lambda worker, work, *items: work(*items))
    with TemporaryDirectory() as folder, in_this_process, ExitStack() as stack:
        Path(folder, "here").mkdir()  # without siblings, in which KBot searches for packages
        stack.enter_context(chdir(Path(folder, "here")))
        _write_inputs()
        outputs = {verb: [_json(words) for words in cases] for verb, cases in CASES.items()}
        with patch.dict("os.environ", XDG_RUNTIME_DIR=folder), _running() as simulation:
            outputs |= {verb: [_answer(words)] for verb, words in QUERIES.items()}
            published = tuple(_published(simulation, outputs))
        shapes = (line for verb in sorted(outputs) for line in _shape(f"kbot {verb}", outputs[verb]))
        return _Facts(tuple(shapes), tuple(_files()), published)


def verbs_with_json() -> Iterator[str]:
    """The verbs that have the option."""
    for words, command in commands():
        if any("--json" in each.opts for each in command.params):
            yield words.removeprefix("kbot ")


def _kbot(words: str) -> str:
    """The output of a command line."""
    result = CliRunner().invoke(group, words.split())
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.stdout


def _json(words: str) -> Any:
    return json.loads(_kbot(f"{words} --json"))


def _answer(words: str) -> Any:
    """The JSON of a query, as soon as it shows something: messages may not have arrived yet."""
    return next(found for _ in range(60) if (found := _json(words)))


def _write_inputs() -> None:
    Path("wider").mkdir()
    _kbot("new bot")
    _kbot("new bot --in wider --separation 0.4")
    Path("equipped.xacro").write_text(EQUIPPED)
    Path("twice.urdf").write_text('<robot name="r"><link name="a"/><link name="a"/></robot>')
    Path("broken.xacro").write_text(
        '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:macro name="m" params="name">'
        '<link name="${name}" colour="red"/></xacro:macro><xacro:m name="a"/></robot>'
    )
    Path("fails.py").write_text("def drive(sim):\n    sim.run(0.01)\n    assert sim.time > 1.0\n")
    for name, most in ("drive", 1), ("fails", 0):
        Path(f"{name}.scenario.yaml").write_text(
            "duration: 0.5\nsteps:\n  - command: {angular: 1.0}\n"
            f"expect:\n  - final_turn: {{min: 0, max: {most}}}\n"
        )
    Path("log.csv").write_text("".join(_log()))


def _log() -> Iterator[str]:
    """A log of a robot with the wheels of `kbot new`, which drives arcs: speeds v and w in each interval."""
    yield "duration,left_wheel_velocity,right_wheel_velocity,displacement_x,displacement_y,displacement_yaw\n"
    for n in range(40):
        v, w, seconds = 0.2 + 0.05 * (n % 3), 0.5 - 0.3 * (n % 4), 0.1
        turn, middle = w * seconds, w * seconds / 2
        way = v * seconds * math.sin(middle) / middle if middle else v * seconds
        left, right = (v - w * 0.12) / 0.05, (v + w * 0.12) / 0.05
        noise = 1e-5 * (n % 5 - 2)
        x, y, yaw = way * math.cos(middle) + noise, way * math.sin(middle), turn + noise
        yield f"{seconds},{left},{right},{x},{y},{yaw}\n"


@contextmanager
def _running() -> Iterator[Simulation]:
    """A simulation of the equipped robot, with all that `kbot sim` connects to it."""
    simulation = Simulation("equipped.xacro")
    mount_declared(simulation)
    NavigationTopics(simulation, Goals(simulation))
    outputs = RunOutputs(str, peers=RosPeers(str))
    outputs.join(simulation, "", "empty")
    is_over = threading.Event()

    def step() -> None:
        while not is_over.is_set():
            simulation.run_errands()
            simulation.step(10)
            time.sleep(0.001)  # the server's thread runs meanwhile

    thread = threading.Thread(target=step)
    thread.start()
    try:
        yield simulation
    finally:
        is_over.set()
        thread.join()
        outputs.close()


def _published(simulation: Simulation, outputs: Mapping[str, Sequence[Any]]) -> Iterator[str]:
    (node,) = outputs["node info"]
    for what in ("Publishers", "Subscribers"):
        verb = what.lower().removesuffix("rs") + "s"
        yield from (f"{verb} {topic}: {kind}" for topic, kind in sorted(node[what].items()))
    (services,) = outputs["service list"]
    for service, kind in sorted(services.items()):
        yield f"service {service}: {kind}"
        part = "request"
        for line in _kbot(f"service type {service}").splitlines()[1:]:
            if line == "---":
                part = "response"
            elif line:
                yield f"service {service} {part}: {line}"
    yield from (f"parameter {name}" for name in sorted(_kbot("param list").split()))
    yield from (f"frame {name}" for name in sorted(simulation.transforms))


def _files() -> Iterator[str]:
    yield from _recording()
    _kbot("bag convert run.mcap run.bag")
    with Path("run.bag").open("rb") as stream:
        yield f"run.bag: {stream.readline().decode().strip()}"
    _kbot("bag convert run.mcap folder")
    for file in sorted(Path("folder").iterdir()):
        yield f"rosbag2 folder: {file.name}"
    yield from _shape("metadata.yaml", [yaml.safe_load(Path("folder/metadata.yaml").read_text())])
    header = _kbot("bag export run.mcap --topic /odom").partition("\n")[0]
    yield from (f"bag export --to csv: {name}" for name in header.split(","))
    yield from _shape("sweep.json", [json.loads(Path("sweep/sweep.json").read_text())])
    rows = [json.loads(line) for line in Path("sweep/runs.jsonl").read_text().splitlines()]
    yield from _shape("runs.jsonl", rows)
    yield from (
        f"results.parquet: {each.name} {each.type}" for each in parquet.read_schema("sweep/results.parquet")
    )
    yield from (
        f"grades.csv: {name}" for name in Path("grades.csv").read_text().partition("\n")[0].split(",")
    )
    for element in ElementTree.parse("junit.xml").iter():
        yield f"junit.xml: <{element.tag}> {' '.join(element.attrib)}"
    _kbot("check broken.xacro --write-baseline baseline.json")
    yield from _shape("baseline.json", [json.loads(Path("baseline.json").read_text())])
    _kbot("expand bot/urdf/bot.xacro --source-map map.json -o bot.urdf")
    yield from _shape("source map", [json.loads(Path("map.json").read_text())])
    policy = PolicyInterface("goal", (0.0, 0.3), (-2.0, 2.0), (-0.3, 0.3), Sectors(4))
    yield from _shape("metadata of a policy", [json.loads(policy.to_json())])
    yield from (f"kbot new: {file.as_posix()}" for file in sorted(Path("bot").rglob("*")) if file.is_file())


def _recording() -> Iterator[str]:
    """The header, channels, schemas and metadata of an MCAP file."""
    with Path("run.mcap").open("rb") as stream:
        reader = make_reader(stream)
        yield f"run.mcap: profile {reader.get_header().profile!r}"
        summary = reader.get_summary()
        assert summary is not None
        for channel in sorted(summary.channels.values(), key=lambda each: each.topic):
            schema = summary.schemas[channel.schema_id]
            keys = " ".join(sorted(channel.metadata))
            yield f"run.mcap: {channel.topic}: {schema.name}, {channel.message_encoding}, with {keys}"
        for schema in sorted(summary.schemas.values(), key=lambda each: each.name):
            lines = schema.data.decode().partition("===")[0].splitlines()  # without the types of its fields
            yield from (f"run.mcap: {schema.encoding} {schema.name}: {line}" for line in lines if line)
        for entry in reader.iter_metadata():
            yield from (f"run.mcap: metadata {entry.name}: {key}" for key in sorted(entry.metadata))


def _shape(name: str, values: Sequence[Any]) -> list[str]:
    """One line for each value in JSON, with all its types."""
    found: dict[str, set[str]] = defaultdict(set)

    def add(value: Any, path: str) -> None:
        if isinstance(value, dict) and value:
            is_by_name = f"{name}: {path}" in _BY_NAME
            for key, part in value.items():
                add(part, f"{path}.{'*' if is_by_name else key}".removeprefix("."))
        elif isinstance(value, list) and value:
            for part in value:
                add(part, f"{path}[]")
        elif isinstance(value, int) and path.rpartition(".")[2] in ("format", "schema", "version"):
            found[path].add(str(value))
        else:
            found[path].add(_TYPES[type(value)])

    for value in values:
        add(value, "")
    lines = (
        (f"{path}: " if path else "", " or ".join(sorted(types))) for path, types in sorted(found.items())
    )
    return [f"{name}: {path}{types}" for path, types in lines]


_TYPES = {
    bool: "boolean",
    int: "number",
    float: "number",
    str: "string",
    list: "empty list",
    dict: "empty object",
    type(None): "null",
}
