"""Films of trials: the robot is in the picture where the run has it, and filming changes nothing."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from kbot.render import film as films
from kbot.render.look import FIELD_OF_VIEW, Look
from kbot.render.offscreen import require_offscreen
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.trials import AddObject, Bound, Command, NeverTouches, RobotSource, Scenario, Step, run_trial
from kbot.trials.films import film_before_and_after, film_of, run_filmed
from kbot.trials.trial import load_source

KBOT = RobotSource("kbot")
AHEAD = Scenario("ahead", 3.0, [Step(Command(0.2))], [Bound("final_forward", max=0.1)], KBOT)
SIZE = (160, 120)
_LABEL = 26
"""Rows of pixels with the time and the line of progress."""
SMALL = Look(*SIZE, theme="light")


@pytest.fixture(autouse=True)
def _needs_opengl() -> None:
    try:
        require_offscreen()
    except KbotError as error:
        pytest.skip(str(error))


def pictures(film: bytes) -> tuple[list[np.ndarray], list[int]]:
    """The pictures of a film, (h, w, 3) each, and how long each is shown in ms."""
    shown, times = [], []
    with Image.open(io.BytesIO(film)) as image:
        for index in range(image.n_frames):
            image.seek(index)
            image.load()
            shown.append(np.asarray(image.convert("RGB")).astype(int))
            times.append(int(image.info["duration"]))
    return shown, times


def blue(picture: np.ndarray) -> np.ndarray:
    """The middle (column, row) of the pixels that are as blue as KBot's plate."""
    r, g, b = np.moveaxis(picture, 2, 0)
    rows, columns = np.nonzero((b > 120) & (r < 40) & (g < 40))
    return np.array([columns.mean(), rows.mean()])


def projected(point: Sequence[float], centre: np.ndarray, look: Look, view_radius: float) -> np.ndarray:
    """Column and row of a point in m, by a pinhole camera as `Look` describes it."""
    away = view_radius * 1.35 * 1.05 / math.sin(math.radians(16.0)) / min(1.0, look.width / look.height)
    a, e = math.radians(look.azimuth), math.radians(look.elevation)
    towards = np.array([math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)])
    right = np.array([-math.sin(a), math.cos(a), 0.0])
    from_eye = np.asarray(point) - (centre + towards * away)
    scale = look.height / 2.0 / math.tan(FIELD_OF_VIEW / 2.0) / -(from_eye @ towards)
    up = np.cross(towards, right)
    return np.array([look.width / 2 + from_eye @ right * scale, look.height / 2 - from_eye @ up * scale])


def test_a_film_shows_the_last_seconds() -> None:
    shown, times = pictures(film_of(AHEAD, last_seconds=2.0, look=SMALL))
    assert len(shown) == 21
    assert all(picture.shape == (SIZE[1], SIZE[0], 3) for picture in shown)
    assert times == [100] * 20 + [1500]


def test_a_film_of_a_failure_ends_a_second_after_it() -> None:
    """KBot touches the wall at about 5 s. Then it stands: its last seconds would show nothing."""
    steps = [Step(Command(0.3))]
    crash = Scenario("crash", 12.0, steps, [NeverTouches()], KBOT, "corridor:length=2")
    failed_at = run_trial(crash).failed_at
    assert failed_at == pytest.approx(5.0, abs=0.3)
    shown, _ = pictures(film_of(crash, last_seconds=2.0, look=SMALL))
    assert len(shown) in (20, 21)
    tapes: list[films.Tape] = []
    run_trial(crash, watch=lambda simulation: tapes.append(films.Tape(simulation, 12.0)))
    (tape,) = tapes
    wanted = [moment for moment in tape.moments if failed_at - 1.05 < moment.time < failed_at + 1.05]
    expected = [np.asarray(frame).astype(int) for frame in films.frames([wanted], SMALL)]
    for picture, frame in zip(shown, expected, strict=True):
        assert np.abs(picture - frame).mean() < 4.0  # WebP is lossy


def test_a_film_of_a_failure_in_the_first_seconds_begins_at_the_start() -> None:
    soon = Scenario("soon", 6.0, [Step(Command(0.3))], [Bound("max_speed", max=0.1)], KBOT)
    assert (run_trial(soon).failed_at or math.inf) < 0.5
    assert len(pictures(film_of(soon, last_seconds=2.0, look=SMALL))[0]) == 21


def test_the_camera_follows_and_the_robot_is_where_the_run_has_it() -> None:
    """Two robots that part: each is in its pane where a pinhole camera sees it."""
    tapes = []
    for speed in (0.3, 0.1):
        simulation = Simulation("kbot")
        tape = films.Tape(simulation, 3.0)
        simulation.cmd_vel(speed, 0.0)
        simulation.run(3.0)
        tapes.append(tape.moments)
    whole = list(films.frames(tapes, SMALL))
    panes = [films._Pane(run, SMALL) for run in tapes]
    look = films._choose_look(panes, list(zip(*tapes, strict=True)), SMALL)
    for index in (5, 15, 30):
        centres = [pane.centre(run[index]) for pane, run in zip(panes, tapes, strict=True)]
        centre = np.mean(centres, axis=0)
        view = panes[0].radius * films._VIEW + float(np.linalg.norm(centres[0] - centre))
        picture = np.asarray(whole[index]).astype(int)
        for left, run in ((0, tapes[0]), (SIZE[0] + films._GAP, tapes[1])):
            plate = run[index].poses["kbot/base_link"].translation
            seen = blue(picture[:, left : left + SIZE[0]])
            # the wheels hide a part of the plate
            assert np.linalg.norm(seen - projected(plate, centre, look, view)) < 2.0
    parted = [blue(picture[:, at : at + SIZE[0]]) for at in (0, SIZE[0] + films._GAP)]
    assert np.linalg.norm(parted[0] - parted[1]) > 20.0


def test_filming_changes_nothing() -> None:
    plain, filmed = run_trial(AHEAD), run_filmed(AHEAD, last_seconds=0.5)
    assert filmed.state_sha256 == plain.state_sha256
    assert filmed.measures == plain.measures
    assert len(pictures(filmed.film)[0]) == 6
    assert filmed.trace is not None


def test_walls_do_not_hide_the_robot() -> None:
    """A wall between the robot and the usual place of the camera, behind it on the right."""
    simulation = Simulation("kbot")
    simulation.models.spawn_thing("box", "screen", -0.33, -0.23, 0.0, math.radians(215.0), (0.05, 1.0, 0.5))
    tape = films.Tape(simulation, 1.0)
    simulation.run(1.0)
    picture = np.asarray(list(films.frames([tape.moments], SMALL))[-1]).astype(int)
    assert np.abs(blue(picture) - (80, 60)).max() < 8.0


@pytest.mark.parametrize(
    "visual", ["", '<visual><geometry><mesh filename="missing.stl"/></geometry></visual>']
)
def test_a_robot_without_visible_shapes_is_drawn_with_its_collisions(visual: str, tmp_path: Path) -> None:
    """A box of 0.2 m, grey on a light floor."""
    shape = '<geometry><box size="0.2 0.2 0.2"/></geometry>'
    inertia = '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>'
    (tmp_path / "box.urdf").write_text(
        f'<robot name="box"><link name="base">{visual}<collision>{shape}</collision>'
        f'<inertial><mass value="1"/>{inertia}</inertial></link></robot>'
    )
    scenario = Scenario("box", 0.5, robot=RobotSource(str(tmp_path / "box.urdf")))
    result = run_filmed(scenario)
    assert result.film, (result.error, result.film_problem)
    picture = pictures(result.film)[0][-1]
    height, width, _ = picture.shape
    middle = picture[height // 2 - 5 : height // 2 + 5, width // 2 - 5 : width // 2 + 5]
    assert middle.mean() < 200.0 < picture[: height // 8].mean()


def test_an_object_is_in_the_film_from_the_time_it_is_added() -> None:
    steps = [Step(AddObject("red", 0.4, 0.0, size=(0.1, 0.1, 0.1)), at=0.5)]
    scenario = Scenario("box", 1.0, steps, robot=KBOT)
    shown, _ = pictures(film_of(scenario, last_seconds=1.0, look=SMALL, kind="PNG"))
    changed = [int(np.abs(picture - shown[0])[:-_LABEL].max()) for picture in shown]
    assert max(changed[:5]) <= 1  # the robot settles by a few micrometres
    assert min(changed[6:]) > 100


def test_a_picture_in_which_nothing_moves_does_not_flicker() -> None:
    shown, _ = pictures(film_of(Scenario("rest", 1.5, robot=KBOT), last_seconds=1.5, look=SMALL))
    assert len(shown) == 16
    for picture in shown:
        assert np.array_equal(picture[:-_LABEL], shown[0][:-_LABEL])


def test_before_and_after_are_side_by_side_with_equal_cameras() -> None:
    robot = load_source(KBOT)
    shown, _ = pictures(film_before_and_after(AHEAD, 0, robot, robot, 1.0, look=SMALL, kind="PNG"))
    assert shown[0].shape == (SIZE[1], 2 * SIZE[0] + films._GAP, 3)
    inside = np.s_[30:90]  # without the titles, the time and the line of progress
    left, right = shown[-1][inside, : SIZE[0]], shown[-1][inside, -SIZE[0] :]
    assert np.array_equal(left, right)


@pytest.mark.parametrize(("kind", "start"), [("GIF", b"GIF89a"), ("PNG", b"\x89PNG"), ("WEBP", b"RIFF")])
def test_films_have_the_usual_formats(kind: str, start: bytes) -> None:
    film = film_of(AHEAD, last_seconds=0.3, look=SMALL, kind=kind)
    assert film.startswith(start)
    assert len(pictures(film)[0]) == 4


def test_a_still_is_the_last_picture() -> None:
    film = film_of(AHEAD, last_seconds=0.5, look=SMALL, kind="PNG")
    with Image.open(io.BytesIO(films.still(film))) as image:
        still = np.asarray(image.convert("RGB")).astype(int)
    apart = [float(np.abs(still - picture).mean()) for picture in pictures(film)[0]]
    # WebP stores colours at half the resolution, so that thin lines differ
    assert apart[-1] < min(apart[:-1]) / 2.0


def test_a_missing_extra_is_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(*_: object) -> None:
        raise KbotError("pictures need off-screen OpenGL")

    monkeypatch.setattr("kbot.render.picture.Canvas", missing)
    result = run_filmed(AHEAD, last_seconds=0.5)
    assert result.film == b""
    assert result.film_problem == "pictures need off-screen OpenGL"
    assert result.reason == run_trial(AHEAD).reason


def test_a_scenario_that_cannot_run_has_no_film() -> None:
    broken = Scenario("broken", 1.0, robot=RobotSource("/nowhere/robot.urdf"))
    result = run_filmed(broken)
    assert result.error
    assert result.film == b""
    with pytest.raises(KbotError, match=r"robot\.urdf"):
        film_of(broken)
