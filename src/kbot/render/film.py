"""Draw the last seconds of a run as a short animated picture. The camera follows the robot."""

from __future__ import annotations

import io
import math
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from kbot.kinematics.transform import Transform
from kbot.model import RobotModel
from kbot.render.look import FIELD_OF_VIEW, Look
from kbot.render.palette import PALETTES, Colour, Theme
from kbot.render.picture import Painter
from kbot.render.picture_scene import PictureScene
from kbot.render.surfaces import PaintedSurface, body_surfaces, robot_surfaces, solid_surfaces
from kbot.sim import Simulation
from kbot.text import KbotError
from kbot.world.sdf.materials import link_colours
from kbot.world.world import Body

Array = NDArray[np.float64]

RATE = 10.0
"""Pictures per second."""
LOOK = Look(400, 300, elevation=32.0, theme="light")
"""The size and colours of films. The azimuth is chosen so that the robot is seen."""
MOST_MOMENTS = 3001
"""Moments that a tape keeps: 5 minutes. In a world of 30 bodies, they take 16 MB."""
_HOLD = 1.5
"""Seconds for which the last picture is held before the film starts again."""
_FINER = 2  # edges of moving things need not be as smooth as those of a still picture
_QUALITY, _STILL_QUALITY = 65, 85
"""The quality of WebP. Nobody sees a picture of a film for long."""
_VIEW = 2.4
"""How many times larger than the robot the view is."""
_BEHIND = (215.0, 145.0, 180.0, 255.0, 105.0, 0.0)
"""Azimuths of the camera in degrees from the robot's heading, the best one first: from behind."""
_SIGHTS = ((0.0, 0.0), (-0.6, 0.0), (0.6, 0.0), (0.0, -0.4), (0.0, 0.4))
"""Points of the robot that should be seen: right and up from its middle, in radii."""
_STEEP = 62.0
"""Elevation in degrees from which walls hide little."""
_TRAIL_WIDTH = 2.2
"""Width in pixels of the robot's path on the floor."""
_INKS: dict[Theme, str] = {"light": "#1b222b", "dark": "#e6eaf0"}
_GAP = 6
"""Pixels between two pictures side by side."""


@dataclass(frozen=True, slots=True)
class Moment:
    """Where everything is at one time: `world_from_body` by body, and that of the first robot's base.

    The names of bodies are `/NAME` for those of the world and `ROBOT/LINK` for those of robots.
    """

    time: float
    poses: Mapping[str, Transform]
    base: Transform
    bodies: tuple[Body, ...]
    robots: Mapping[str, RobotModel]


class Tape:
    """Keeps the moments of the last `seconds` of a run, at most `MOST_MOMENTS`. Nothing is drawn yet."""

    def __init__(self, simulation: Simulation, seconds: float = 5.0) -> None:
        self._simulation = simulation
        self._moments = deque[Moment](maxlen=min(MOST_MOMENTS, max(2, round(seconds * RATE) + 1)))
        self._timer = simulation.clock.every(RATE, self._add)
        self._add()

    @property
    def moments(self) -> tuple[Moment, ...]:
        """The moments until now, in order of time."""
        if self._simulation.time > self._moments[-1].time:
            self._add()
        return tuple(self._moments)

    def close(self) -> None:
        self._timer.cancel()

    def _add(self) -> None:
        simulation = self._simulation
        now = simulation.models.body_poses()
        bodies = simulation.world.bodies
        poses = {f"/{body.name}": now.get(body.name, body.pose) for body in bodies}
        for name, robot in simulation.robots.items():
            poses.update((f"{name}/{link}", pose) for link, pose in robot.body.link_poses().items())
        if not all(math.isfinite(float(pose.matrix.sum())) for pose in poses.values()):
            return  # a simulation that diverges
        first = simulation.robots.first
        robots = {name: robot.robot for name, robot in simulation.robots.items()}
        base = poses[f"{first.name}/{first.robot.root}"]
        self._moments.append(Moment(simulation.time, poses, base, bodies, robots))


def draw_film(moments: Sequence[Moment], look: Look = LOOK, kind: str = "WEBP") -> bytes:
    """Return an animated picture of moments. `kind` is WEBP, GIF or PNG.

    Raises:
        KbotError: off-screen OpenGL is not available. The message names the package to install.
    """
    return encode(list(frames((moments,), look)), kind)


def draw_side_by_side(
    before: Sequence[Moment],
    after: Sequence[Moment],
    titles: tuple[str, str] = ("before", "after"),
    look: Look = LOOK,
    kind: str = "WEBP",
) -> bytes:
    """Return an animated picture of two runs, seen by the same camera, so that the difference is visible.

    Raises:
        KbotError: off-screen OpenGL is not available. The message names the package to install.
    """
    return encode(list(frames((before, after), look, titles)), kind)


def still(film: bytes) -> bytes:
    """Return the last picture of a film as WebP: a picture for print, and for readers who avoid motion."""
    with Image.open(io.BytesIO(film)) as image:
        image.seek(getattr(image, "n_frames", 1) - 1)
        packed = io.BytesIO()
        image.convert("RGB").save(packed, "WEBP", quality=_STILL_QUALITY)
    return packed.getvalue()


def encode(pictures: Sequence[Image.Image], kind: str = "WEBP") -> bytes:
    """Return pictures as one animated picture that repeats."""
    shown = [round(1000.0 / RATE)] * (len(pictures) - 1) + [round(1000.0 * _HOLD)]
    # a new key frame is a little different, so that a picture in which nothing moves would flicker
    options: dict[str, object] = {"quality": _QUALITY, "method": 2, "kmax": 0} if kind == "WEBP" else {}
    packed = io.BytesIO()
    pictures[0].save(
        packed, kind, save_all=True, append_images=pictures[1:], duration=shown, loop=0, **options
    )
    return packed.getvalue()


def frames(
    runs: Sequence[Sequence[Moment]], look: Look = LOOK, titles: Sequence[str] = ()
) -> Iterator[Image.Image]:
    """Yield the pictures of runs, which are drawn side by side and end together."""
    if not runs or not all(runs):
        raise KbotError("a film needs at least one moment of each run")
    panes = [_Pane(run, look) for run in runs]
    count = max(len(run) for run in runs)
    moments = [[run[max(0, at - count + len(run))] for run in runs] for at in range(count)]
    look = _choose_look(panes, moments, look)
    for at, now in enumerate(moments):
        centres = [pane.centre(moment) for pane, moment in zip(panes, now, strict=True)]
        centre = np.mean(centres, axis=0)
        apart = max(float(np.linalg.norm(each - centre)) for each in centres)
        view = max(pane.radius for pane in panes) * _VIEW + apart
        drawn = [
            pane.draw(moment, look, centre, view, [each[index].base for each in moments[: at + 1]])
            for index, (pane, moment) in enumerate(zip(panes, now, strict=True))
        ]
        yield _compose(drawn, titles, now[0].time, (at + 1) / count, look.theme)


def _choose_look(panes: Sequence[_Pane], moments: Sequence[Sequence[Moment]], look: Look) -> Look:
    """The direction from which most of the robots is seen most of the time. Walls may hide them."""
    some = [*moments[:: max(1, len(moments) // 8)], moments[-1]]
    heading = math.degrees(moments[-1][0].base.rpy[2])
    best, most = look, -1
    for elevation in (look.elevation, _STEEP):
        for around in _BEHIND:
            tried = replace(look, azimuth=heading + around, elevation=elevation)
            seen = sum(
                pane.seen(moment, tried) for now in some for pane, moment in zip(panes, now, strict=True)
            )
            if seen == len(_SIGHTS) * len(some) * len(panes):
                return tried
            if seen > most:
                best, most = tried, seen
    return best


class _Pane:
    """Draws one run."""

    def __init__(self, run: Sequence[Moment], look: Look) -> None:
        bodies: dict[str, tuple[PaintedSurface, ...]] = {}
        for moment in run:
            for body in moment.bodies:
                if f"/{body.name}" not in bodies:
                    bodies[f"/{body.name}"] = tuple(body_surfaces(body))
            for name, robot in moment.robots.items():
                if f"{name}/{robot.root}" not in bodies:
                    bodies.update((f"{name}/{link}", parts) for link, parts in _robot_surfaces(robot))
        low, high = _bounds(run[0], bodies)
        self.radius = max(0.02, float(np.linalg.norm(high - low)) / 2.0)
        self._middle = (low + high) / 2.0
        self._painter = Painter({n: parts for n, parts in bodies.items() if parts}, look, self.radius, _FINER)

    def centre(self, moment: Moment) -> Array:
        """The middle (3,) of the robot, as if it were not turned: a camera that looks at it does not sway."""
        centre: Array = moment.base.translation + self._middle
        return centre

    def seen(self, moment: Moment, look: Look) -> int:
        """How many points in and around the robot's middle are seen by a camera."""
        view = _view(self.centre(moment), self.radius, self.radius * _VIEW)
        painter = self._painter
        painter.look = look
        painter.place(moment.poses, view)
        eye = view.centre + look.towards_eye * look.distance(view.view_radius)
        geom, count = np.zeros(1, dtype=np.int32), 0
        for right, up in _SIGHTS:
            point = view.centre + self.radius * (right * look.axes[:, 0] + up * look.axes[:, 1])
            distance = float(np.linalg.norm(point - eye))
            towards = (point - eye) / distance
            hit = mujoco.mj_ray(painter.model, painter.data, eye, towards, None, 1, -1, geom)
            count += hit < 0.0 or hit >= distance - self.radius
        return count

    def draw(
        self, moment: Moment, look: Look, centre: Array, view_radius: float, path: Sequence[Transform]
    ) -> Image.Image:
        self._painter.look = look
        view = _view(centre, self.radius, view_radius)
        return Image.fromarray(self._painter.paint(moment.poses, view, _trail(path, look, view)))


def _bounds(moment: Moment, bodies: Mapping[str, Sequence[PaintedSurface]]) -> tuple[Array, Array]:
    """The lowest and highest corner (3,) of the first robot, in m from its base in the base's frame."""
    first = next(iter(moment.robots))
    base_from_world = moment.base.inverse()
    corners = [
        (base_from_world @ moment.poses[name]).apply(surface.vertices)
        for name, surfaces in bodies.items()
        if name.startswith(f"{first}/")
        for surface in surfaces
    ]
    points = np.concatenate([*corners, np.zeros((1, 3))])  # a robot without shapes is a point
    return points.min(axis=0), points.max(axis=0)


def _robot_surfaces(robot: RobotModel) -> Iterator[tuple[str, tuple[PaintedSurface, ...]]]:
    """Yield the surfaces of each link: its collisions if the meshes of its visuals are missing, or if the
    whole robot has no visuals. A film of an invisible robot would show nothing."""
    surfaces = robot_surfaces(robot, link_colours(robot))
    is_invisible = not any(surfaces.values())
    for name, link in robot.links.items():
        yield name, surfaces[name] or (solid_surfaces(link) if link.visuals or is_invisible else ())


def _view(centre: Array, radius: float, view_radius: float) -> PictureScene:
    return PictureScene({}, (), centre, radius, 0.0, view_radius)


def _trail(path: Sequence[Transform], look: Look, view: PictureScene) -> Array:
    """Return how much the path covers each pixel of the floor, (h, w) in 0..1."""
    points = np.array([(*pose.translation[:2], 0.0) for pose in path]) - view.centre
    right, above, back = (points @ look.axes).T
    depth = look.distance(view.view_radius) - back
    half = math.tan(FIELD_OF_VIEW / 2.0) * np.maximum(depth, 1e-6)
    twice = 2.0 * np.array([look.width, look.height])
    columns = (right / (half * look.aspect) + 1.0) / 2.0 * twice[0]
    rows = (1.0 - above / half) / 2.0 * twice[1]
    mask = Image.new("L", (2 * look.width, 2 * look.height))
    # what is beside the camera is far outside the picture
    seen = [(x, y) for x, y, d in zip(columns, rows, depth, strict=True) if d > 0.1 * view.view_radius]
    if len(seen) > 1:
        ImageDraw.Draw(mask).line(seen, 255, round(2 * _TRAIL_WIDTH), "curve")
    return np.asarray(mask.reduce(2), dtype=float) / 255.0


def _compose(
    pictures: Sequence[Image.Image], titles: Sequence[str], time: float, progress: float, theme: Theme
) -> Image.Image:
    """Put pictures side by side, with their titles, the time, and a line that shows how far the film is."""
    width, height = pictures[0].size
    whole = Image.new("RGB", ((width + _GAP) * len(pictures) - _GAP, height), "white")
    font, ink = ImageFont.load_default(13), _INKS[theme]
    paper = _rgb(PALETTES[theme].background)  # around letters, which may be before a wall
    for index, picture in enumerate(pictures):
        whole.paste(picture, ((width + _GAP) * index, 0))
    pen = ImageDraw.Draw(whole)
    for index, title in enumerate(titles):
        pen.text(((width + _GAP) * index + 10, 8), title, ink, font, stroke_width=2, stroke_fill=paper)
    pen.text((10, height - 12), f"{time:.1f} s", ink, font, "ls", stroke_width=2, stroke_fill=paper)
    pen.rectangle((0, height - 3, progress * whole.width, height), _rgb(PALETTES[theme].mark))
    return whole


def _rgb(colour: Colour) -> tuple[int, int, int]:
    red, green, blue = (round(255.0 * part) for part in colour.tolist())
    return red, green, blue
