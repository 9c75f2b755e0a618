"""KBot loads all files that libsdformat, Gazebo's reader, parses without error, in each version of SDF."""

import shutil
import subprocess
from pathlib import Path

import pytest

from kbot.text import DescriptionError
from kbot.world import load_world
from kbot.world.sdf.model_paths import LIBRARY

VERSIONS = ("1.4", "1.5", "1.6", "1.7", "1.8", "1.9")
"""The SDF versions that libsdformat 12 supports."""

BOX = "<geometry><box><size>1 1 1</size></box></geometry>"
SHAPES = {
    "box": BOX,
    "sphere": "<geometry><sphere><radius>1</radius></sphere></geometry>",
    "cylinder": "<geometry><cylinder><radius>1</radius><length>2</length></cylinder></geometry>",
    "capsule": "<geometry><capsule><radius>1</radius><length>2</length></capsule></geometry>",
    "ellipsoid": "<geometry><ellipsoid><radii>1 2 3</radii></ellipsoid></geometry>",
    "plane": "<geometry><plane><normal>0 0 1</normal><size>2 2</size></plane></geometry>",
    "polyline": "<geometry><polyline><point>0 0</point><point>1 0</point><point>0 1</point>"
    "<height>1</height></polyline></geometry>",
    "empty": "<geometry><empty/></geometry>",
}
JOINTS = (
    "revolute",
    "revolute2",
    "universal",
    "prismatic",
    "ball",
    "screw",
    "gearbox",
    "fixed",
    "continuous",
)


def model(inner: str, name: str = "m") -> str:
    return f"<model name='{name}'>{inner}</model>"


def link(name: str, inner: str = f"<collision name='c'>{BOX}</collision>") -> str:
    return f"<link name='{name}'>{inner}</link>"


def joint(kind: str) -> str:
    axis = "<xyz>0 1 0</xyz><limit><lower>-1</lower><upper>1</upper></limit>"
    axes = f"<axis>{axis}</axis>" + (f"<axis2>{axis}</axis2>" if kind not in ("ball", "fixed") else "")
    more = "<gearbox_reference_body>a</gearbox_reference_body>" if kind == "gearbox" else ""
    ends = "<parent>a</parent><child>b</child>"
    return link("a") + link("b") + f"<joint name='j' type='{kind}'>{ends}{axes}{more}</joint>"


WORLDS = {
    **{
        f"shape_{name}": model(link("a", f"<collision name='c'>{g}</collision>"))
        for name, g in SHAPES.items()
    },
    **{f"joint_{kind}": model(joint(kind)) for kind in JOINTS},
    "fixed_to_world": model(
        link("a") + "<joint name='j' type='fixed'><parent>world</parent><child>a</child></joint>"
    ),
    "include": "<include><uri>model://crate</uri><name>c</name><pose>1 0 0 0 0 0</pose></include>",
    "static_include": "<include><uri>model://table</uri><static>true</static></include>",
    "nested": model(model(link("x"), "inner") + link("a")),
    "nested_include": model(link("a") + "<include><uri>model://ball</uri></include>"),
    "frames": "<frame name='f'><pose>1 0 0 0 0 0</pose></frame>"
    + model("<frame name='g' attached_to='a'/>" + link("a")),
    "relative": model(link("a") + "<link name='b'><pose relative_to='a'>1 0 0 0 0 0</pose></link>"),
    "same_names": model(
        link("a") + link("b") + "<joint name='a' type='fixed'><parent>b</parent><child>a</child></joint>"
    ),
    "no_geometry": model(link("a", "<collision name='c'/><visual name='v'/>")),
    "endless_limits": model(
        link("a") + link("b") + "<joint name='j' type='revolute'><parent>a</parent><child>b</child>"
        "<axis><xyz>0 0 1</xyz><limit><lower>-inf</lower><upper>inf</upper></limit></axis></joint>"
    ),
    "surface": model(
        link(
            "a",
            f"<collision name='c'>{BOX}<surface><friction><ode><mu>0.5</mu><mu2>0.2</mu2><fdir1>1 0 0</fdir1>"
            "</ode></friction><contact><ode><kp>1e6</kp><kd>10</kd></ode></contact></surface></collision>",
        )
    ),
    "light": "<light name='sun' type='directional'><direction>0 0 -1</direction></light>",
    "physics": "<physics name='p' type='ode'><max_step_size>0.001</max_step_size></physics>"
    "<gravity>0 0 -3.7</gravity>",
    "unknown_elements": model("<custom:thing xmlns:custom='x'>1</custom:thing><other/>" + link("a")),
    "undeclared_prefix": model("<mine:thing>1</mine:thing>" + link("a")),
    "two_models": model(link("a")) + model(link("a"), "n"),
    "degrees": model(link("a") + "<link name='b'><pose degrees='true'>0 0 0 0 0 90</pose></link>"),
    "dashes_in_a_comment": "<!-- a -- b ---><!-- c -->" + model(link("a")),
    "shapes_without_sizes": model(
        "".join(
            link(shape, f"<collision name='c'><geometry><{shape}/></geometry></collision>")
            for shape in ("box", "sphere", "cylinder")
        )
    ),
    "mesh_that_is_not_there": model(
        link("a", "<visual name='v'><geometry><mesh><uri>no.dae</uri></mesh></geometry></visual>")
    ),
}


@pytest.fixture(scope="module")
def peer(tmp_path_factory):
    """A function that returns the number of libsdformat errors for each file."""
    program = tmp_path_factory.mktemp("sdformat") / "peer"
    if not (shutil.which("g++") and shutil.which("pkg-config")):
        pytest.skip("g++ or pkg-config is not installed")
    flags = subprocess.run(["pkg-config", "--cflags", "--libs", "sdformat12"], capture_output=True, text=True)
    if flags.returncode:
        pytest.skip("libsdformat is not installed: run scripts/need_sdformat.sh")
    source = str(Path(__file__).with_name("sdf_peer.cc"))
    subprocess.run(["g++", "-std=c++17", source, "-o", str(program), *flags.stdout.split()], check=True)

    def count(files):
        output = subprocess.run(
            [str(program), str(LIBRARY), "--", *map(str, files)], capture_output=True, text=True, check=True
        ).stdout
        rows = [line.split("\t") for line in output.splitlines() if "\t" in line]
        return {file: int(errors) for errors, file in rows}

    return count


def errors_of(files) -> dict[str, list[str]]:
    """KBot's errors for the files that it does not load."""
    found = {}
    for file in files:
        try:
            load_world(str(file))
        except DescriptionError as error:
            found[str(file)] = [d.message for d in error.diagnostics if d.is_error]
    return found


@pytest.mark.parametrize("version", VERSIONS)
def test_kbot_loads_files_that_libsdformat_parses(peer, tmp_path, version):
    files = []
    for name, inner in WORLDS.items():
        file = tmp_path / f"{name}.sdf"
        file.write_text(f"<sdf version='{version}'><world name='w'>{inner}</world></sdf>")
        files.append(file)
    errors = peer(files)
    fine = [file for file in files if errors[str(file)] == 0]
    assert len(fine) > len(files) / 2
    assert errors_of(fine) == {}


@pytest.mark.parametrize(
    ("before", "after"),
    [("\n ", ""), ("<?xml version='1.0'?>", ""), ("", "</sdf>"), ("", "<sdf version='1.7'/>")],
)
def test_kbot_loads_files_that_are_not_well_formed_but_that_libsdformat_parses(peer, tmp_path, before, after):
    file = tmp_path / "world.sdf"
    world = f"<sdf version='1.7'><world name='w'>{model(link('a'))}</world></sdf>"
    file.write_text(f"{before}<?xml version='1.0'?>{world}{after}")
    assert peer([file]) == {str(file): 0}
    assert errors_of([file]) == {}


def test_both_read_text_before_the_root_element(peer, tmp_path):
    file = tmp_path / "world.sdf"
    file.write_text(
        f"?xml version='1.0'?>\n<sdf version='1.7'><world name='w'>{model(link('a'))}</world></sdf>"
    )
    assert peer([file]) == {str(file): 0}
    assert errors_of([file]) == {}


def test_libsdformat_parses_every_model_of_the_library(peer):
    files = sorted(LIBRARY.glob("*/model.sdf"))
    assert set(peer(files).values()) == {0}
    assert errors_of(files) == {}


def test_both_report_an_invalid_world(peer, tmp_path):
    """The peer reports errors: the tests above do not compare two readers that accept everything."""
    file = tmp_path / "ring.sdf"
    turn = "<pose relative_to='{}'>0 0 0 0 0 0</pose>"
    file.write_text(
        f"<sdf version='1.7'><world name='w'>{model(turn.format('n') + link('a'))}"
        f"{model(turn.format('m') + link('a'), 'n')}</world></sdf>"
    )
    assert peer([file])[str(file)] > 0
    assert load_world(str(file)).diagnostics  # KBot repairs it
