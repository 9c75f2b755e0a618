"""Fuzzes the readers of worlds: SDF files, and maps with their images.

Any file either gives a world or a KbotError. tests/world/ has the inputs that failed.
"""

import io
from contextlib import suppress
from pathlib import Path

from choices import Choices
from edits import edited, real_files
from PIL import Image

from kbot.text import KbotError
from kbot.text.render import render_text
from kbot.world.load import map_world
from kbot.world.sdf import read_sdf

SDF = b"""<?xml version="1.0"?><sdf version="1.7"><world name="w"><gravity>0 0 -9.8</gravity>
<frame name="f" attached_to="m"><pose>1 0 0 0 0 0</pose></frame>
<model name="m"><static>false</static><pose relative_to="f">0 0 1 0 0 0.5</pose>
<link name="a"><inertial><mass>1</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial>
<collision name="c"><geometry><box><size>1 2 3</size></box></geometry><surface><friction><ode><mu>0.5</mu></ode></friction>
</surface></collision><visual name="v"><geometry><cylinder><radius>0.5</radius><length>1</length></cylinder></geometry>
<material><diffuse>1 0 0 1</diffuse></material></visual></link>
<link name="b"><pose>0 0 1 0 0 0</pose><collision name="c"><geometry><sphere><radius>0.3</radius></sphere></geometry></collision></link>
<joint name="j" type="revolute"><parent>a</parent><child>b</child><axis><xyz>0 0 1</xyz><limit><lower>-1</lower><upper>1</upper>
</limit><dynamics><damping>0.1</damping></dynamics></axis></joint></model>
<model name="p"><static>1</static><link name="l"><collision name="c"><geometry><plane><normal>0 0 1</normal><size>9 9</size></plane>
</geometry></collision><visual name="v"><geometry><polyline><point>0 0</point><point>1 0</point><point>0 1</point><height>1</height>
</polyline></geometry></visual></link></model>
<include><uri>model://cardboard_box</uri><pose>1 1 0 0 0 0</pose></include>
<include><uri>a.sdf</uri></include>
<spherical_coordinates><latitude_deg>10</latitude_deg><longitude_deg>20</longitude_deg><elevation>3</elevation></spherical_coordinates>
</world></sdf>"""
MAP = b"""image: p.pgm
mode: trinary
resolution: 0.05
origin: [0.0, 1.0, 0.5]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
"""
PGM = b"P5\n# a map\n4 4\n255\n" + bytes([0, 205, 254, 255] * 4)
WORDS = [
    b"<heightmap><uri>p.pgm</uri><size>1 1 1</size></heightmap>", b"<capsule><radius>1</radius><length>1</length></capsule>",
    b"<joint name='k' type='ball'><parent>a</parent><child>b</child></joint>", b"<joint name='k' type='screw'>", b"</joint>",
    b"<ellipsoid><radii>1 1 1</radii></ellipsoid>", b"<cone><radius>1</radius><length>1</length></cone>", b"<model name='n'>",
    b"</model>", b"<link name='a'/>", b"<frame name='g' attached_to='g'/>", b"<pose relative_to='m::a'>", b"<static>true</static>",
    b"<mesh><uri>p.pgm</uri></mesh>", b"<pose degrees='true'>", b"<pose rotation_format='quat_xyzw'>", b"<population/>",
    b"<include><uri>a.sdf</uri></include>", b"<mimic joint='j'><multiplier>2</multiplier></mimic>", b"<plugin name='p' filename='q'/>",
    b"&a [*a]", b"<<: *a", b"mode: scale\n", b"mode: raw\n", b"- ", b"? ", b"!!int ", b"!!float ", b"P2\n", b"P6\n",
]  # fmt: skip


def png(mode: str) -> bytes:
    stream = io.BytesIO()
    Image.new(mode, (4, 4)).save(stream, "PNG")
    return stream.getvalue()


SDF_SEEDS = [SDF, *real_files(".sdf", ".world")]
IMAGES = [PGM, b"P2\n2 2\n255\n0 205 254 255\n", *map(png, ("1", "L", "P", "LA", "RGB", "RGBA", "I;16"))]
MOST_PIXELS = 10_000
"""Of a seed. atheris never frees the bytes that it sees compared, so larger images would fill the memory."""


def is_small(image: bytes) -> bool:
    width, height = Image.open(io.BytesIO(image)).size
    return bool(width * height <= MOST_PIXELS)


IMAGES += filter(is_small, real_files(".png", ".pgm"))


def one_sdf(choices: Choices) -> None:
    Path("a.sdf").write_bytes(edited(choices, SDF_SEEDS, WORDS))
    Path("p.pgm").write_bytes(PGM)
    with suppress(KbotError):
        render_text(read_sdf("a.sdf").diagnostics)


def one_map(choices: Choices) -> None:
    read_map(edited(choices, [MAP], WORDS), PGM)


def one_image(choices: Choices) -> None:
    read_map(MAP, edited(choices, IMAGES, WORDS))


def read_map(settings: bytes, image: bytes) -> None:
    Path("m.yaml").write_bytes(settings)
    Path("p.pgm").write_bytes(image)
    with suppress(KbotError):
        map_world("m.yaml")


TARGETS = {"sdf": one_sdf, "map": one_map, "map-image": one_image}
