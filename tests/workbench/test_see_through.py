"""Shapes whose colour has an alpha below 1 are in pictures and films, as much as their alpha says."""

import io

import numpy as np
import pytest
from PIL import Image

from kbot.model import RobotModel
from kbot.model.load import load_robot_text
from kbot.render import film
from kbot.render.look import Look
from kbot.render.offscreen import require_offscreen
from kbot.render.picture import draw_picture
from kbot.render.picture_scene import PictureScene, robot_alone, robot_in_world
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.world import World
from kbot.world.builders import box, floor

RED, GREEN = "1 0 0", "0 1 0"
MOMENTS = 'ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"'
INERTIAL = f'<inertial><mass value="1"/><inertia {MOMENTS}/></inertial>'


@pytest.fixture(autouse=True)
def _needs_opengl() -> None:
    try:
        require_offscreen()
    except KbotError as error:
        pytest.skip(str(error))


def plates(*colours: str) -> RobotModel:
    """Square plates above each other, the first at the bottom. The camera sees their tops only."""
    shapes = "".join(
        f'<visual><origin xyz="0 0 {0.1 * level}"/><geometry><box size="0.4 0.4 0.02"/></geometry>'
        f'<material name="m{level}"><color rgba="{rgba}"/></material></visual>'
        for level, rgba in enumerate(colours)
    )
    solid = '<collision><geometry><box size="0.4 0.4 0.02"/></geometry></collision>'
    text = f'<robot name="plates"><link name="base">{INERTIAL}{shapes}{solid}</link></robot>'
    return load_robot_text(text, "plates.urdf").require()


def centre_pixel(scene: PictureScene, transparent: bool) -> np.ndarray:
    look = Look(64, 64, azimuth=0.0, elevation=90.0, transparent=transparent)
    with Image.open(io.BytesIO(draw_picture(scene, look))) as image:
        return np.asarray(image).astype(float)[32, 32]


def alone(*colours: str, transparent: bool = True) -> np.ndarray:
    return centre_pixel(robot_alone(plates(*colours)), transparent)


@pytest.mark.parametrize("alpha", [0.99, 0.5, 0.2])
def test_the_opacity_of_a_transparent_picture_is_alpha(alpha: float) -> None:
    pixel, opaque = alone(f"{RED} {alpha}"), alone(f"{RED} 1")
    assert pixel[3] == pytest.approx(255.0 * alpha, abs=1.0)
    assert pixel[:3] == pytest.approx(opaque[:3], abs=3.0)


def test_two_layers_cover_what_light_through_both_is_lost() -> None:
    assert alone(f"{RED} 0.5", f"{GREEN} 0.5")[3] == pytest.approx(255.0 * 0.75, abs=1.0)
    assert alone(f"{RED} 0.5", f"{GREEN} 0.2")[3] == pytest.approx(255.0 * 0.6, abs=1.0)


def test_the_nearer_of_two_layers_is_more_visible() -> None:
    red, green = alone(f"{RED} 0.5", f"{GREEN} 0.5")[:2]
    assert green > red
    red, green = alone(f"{GREEN} 0.5", f"{RED} 0.5")[:2]
    assert red > green


def test_an_opaque_shape_is_seen_through_another_and_hides_what_is_below() -> None:
    below, above = alone(f"{RED} 1")[:3], alone(f"{GREEN} 1")[:3]
    seen = alone(f"{RED} 1", f"{GREEN} 0.25")
    assert seen == pytest.approx([*(0.75 * below + 0.25 * above), 255.0], abs=3.0)
    assert alone(f"{RED} 0.5", f"{GREEN} 1") == pytest.approx([*above, 255.0], abs=1.0)


def test_the_floor_is_seen_through_a_robot() -> None:
    bare = alone(f"{RED} 0", transparent=False)
    opaque = alone(f"{RED} 1", transparent=False)
    assert alone(f"{RED} 0.5", transparent=False) == pytest.approx((bare + opaque) / 2.0, abs=3.0)


def test_alpha_0_is_invisible() -> None:
    """As in rviz."""
    assert alone(f"{RED} 0").tolist() == [0.0, 0.0, 0.0, 0.0]
    assert alone(f"{GREEN} 0.5", f"{RED} 0") == pytest.approx(alone(f"{GREEN} 0.5"))


def test_a_see_through_object_of_the_world_tints_the_robot() -> None:
    above = box("glass", (0.4, 0.4, 0.02), 0.0, 0.0, z=0.5, rgba=(0.0, 1.0, 0.0, 0.5))
    scenes = [
        robot_in_world(Simulation(plates(f"{RED} 1"), world=World("hall", (floor(), *bodies))))
        for bodies in ((), (above,))
    ]
    plain, tinted = (centre_pixel(scene, transparent=False) for scene in scenes)
    assert tinted[0] == pytest.approx(plain[0] / 2.0, abs=5.0)
    assert tinted[1] > plain[1] + 80.0


def test_a_see_through_robot_is_in_a_film() -> None:
    simulation = Simulation(plates(f"{RED} 0.5"))
    tape = film.Tape(simulation, 1.0)
    simulation.run(0.5)
    picture = np.asarray(list(film.frames([tape.moments], Look(160, 120)))[-1]).astype(int)
    assert (picture[..., 0] - picture[..., 1:3].max(axis=2) > 40).mean() > 0.02
