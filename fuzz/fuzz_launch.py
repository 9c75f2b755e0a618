"""Coverage-guided fuzzing of the launch files of ROS 1 and of ROS 2 (XML and YAML).

    pip install atheris
    python fuzz/fuzz_launch.py CORPUS_FOLDER [-runs=1000000]

For every input, reading must end within its limits and report errors as diagnostics with a code, a message
and a place. Anything else is a finding, and so is an input that takes more than 10 s of CPU time.
"""

import sys
import time

import atheris

with atheris.instrument_imports(include=["kbot.ros.launch", "kbot.xacro", "kbot.text"]):
    from kbot.ros.launch.ros1.reader import read_launch
    from kbot.ros.launch.ros2.reader import read_launch_2
    from kbot.text import Source
    from kbot.xacro.packages import Packages

from diagnostics import check_diagnostics

MOST_CPU_S = 10.0
TAGS = [
    '<arg name="a" default="{}"/>',
    '<arg name="b" value="$(arg a)$(arg a)"/>',
    '<param name="p" value="$(eval {})"/>',
    '<param name="q" value="{}" type="yaml"/>',
    "<rosparam>{}</rosparam>",
    '<group ns="{}" if="$(eval {})">',
    "</group>",
    '<node pkg="p" type="t" name="n" args="{}"/>',
    '<remap from="{}" to="b"/>',
    '<let name="a" value="$(var a){}$(var a)"/>',
    '<let name="a" value="$(eval \'{}\')"/>',
    '<node pkg="p" exec="e" name="n"><param name="p" value="{}"/></node>',
    '<set_env name="A" value="$(env A){}"/>',
    '<push_ros_namespace namespace="{}"/>',
]
WORDS = [
    *("$(arg a)", "$(var a)", "$(env HOME)", "$(optenv A b)", "$(anon a)", "$(dirname)", "$(find p)"),
    *("$(not true)", "$(path-join $(var a) $(var a))", "$(if true a b)", "'a' * 3000000", "2**20000"),
    *("[[1] * 999] * 999", "('a'*3000000).rfind('ab'+'a'*1000000)", "dict.fromkeys(map(str, [1] * 9999))"),
    *("$(", ")", "1", "a: [b, {c: d}]"),
]


def check(name: str, text: str) -> None:
    """Read a launch file and check the time and the diagnostics."""
    source = Source(name, text)
    start = time.process_time()
    read = read_launch if name.endswith(".launch") else read_launch_2
    plan = read(name, {"a": "1"}, Packages(), source=source)
    assert time.process_time() - start < MOST_CPU_S, text
    check_diagnostics(plan.diagnostics)


def one_input(data: bytes) -> None:
    provider = atheris.FuzzedDataProvider(data)
    name = ("fuzz.launch", "fuzz.launch.xml", "fuzz.launch.yaml")[provider.ConsumeIntInRange(0, 2)]
    if provider.ConsumeBool():
        check(name, provider.ConsumeUnicodeNoSurrogates(4_000))
        return
    parts = []
    for _ in range(provider.ConsumeIntInRange(1, 12)):
        word = WORDS[provider.ConsumeIntInRange(0, len(WORDS) - 1)]
        if provider.ConsumeBool():
            word += provider.ConsumeUnicodeNoSurrogates(20)
        parts.append(TAGS[provider.ConsumeIntInRange(0, len(TAGS) - 1)].replace("{}", word))
    check(name, f"<launch>{''.join(parts)}</launch>")


if __name__ == "__main__":
    atheris.Setup(sys.argv, one_input)
    atheris.Fuzz()
