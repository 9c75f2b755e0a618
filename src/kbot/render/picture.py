"""Draw pictures without a browser, with the page's colours, light and floor."""

from __future__ import annotations

import io
import itertools
import math
from collections.abc import Mapping, Sequence
from functools import reduce
from typing import TypeVar

import mujoco
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from kbot.kinematics.transform import Transform
from kbot.model.meshes import Texture
from kbot.render.floor import Floor
from kbot.render.look import FIELD_OF_VIEW, Look
from kbot.render.normals import face_normals
from kbot.render.offscreen import Canvas, add_triangles, at_least_four
from kbot.render.palette import PALETTES
from kbot.render.picture_scene import PictureScene
from kbot.render.surfaces import PaintedSurface
from kbot.text import KbotError

Array = NDArray[np.float64]
Number = TypeVar("Number", bound=np.generic)

_FINER = 3  # pictures are drawn this many times larger and averaged, for smooth edges
_BAND_PIXELS = 16384  # pixels that are mixed at a time, so that their numbers fit into the processor's cache
_MOST_DRAWN = 8192  # pixels of a side that is drawn before averaging
# Surfaces below this share of the view radius squared are skipped: they are invisible, and MuJoCo rejects
# meshes without area.
_SMALLEST = 1e-9
# The page's lights for MuJoCo, which adds them in display colours, not in linear ones.
_AMBIENT, _SUN, _FILL = 0.46, 0.52, 0.2
_AWAY = Transform.from_xyz_rpy((0.0, 0.0, -1e6), (0.0, 0.0, 0.0))
"""Where bodies that are not in a picture are: farther than everything that is drawn."""


def draw_picture(things: PictureScene, look: Look) -> bytes:
    """Return a PNG of exactly the size of `look`: with the floor, or without it if the look is transparent.

    Raises:
        KbotError: off-screen OpenGL is not available. The message names what to install.
    """
    surfaces = {"": tuple(itertools.chain(*things.links.values(), things.others))}
    pixels = Painter(surfaces, look, things.view_radius).paint({"": Transform.identity()}, things)
    packed = io.BytesIO()
    Image.fromarray(pixels).save(packed, "PNG")
    return packed.getvalue()


class Painter:
    """Draws bodies at any poses, one picture after the other.

    The owner may change the direction of `look` between pictures, but not its size.
    """

    def __init__(
        self,
        bodies: Mapping[str, Sequence[PaintedSurface]],
        look: Look,
        view_radius: float,
        finer: int = _FINER,
    ) -> None:
        """Load the surfaces of each body. What is too small for `view_radius` m is not drawn.

        Pictures are drawn `finer` times larger and averaged, for smooth edges.

        Raises:
            KbotError: off-screen OpenGL is not available. The message names what to install.
        """
        self.look = look
        self._finer = max(1, min(finer, _MOST_DRAWN // max(look.width, look.height)))
        size = look.width * self._finer, look.height * self._finer
        self.model = _model(bodies, size, view_radius)
        self.data = mujoco.MjData(self.model)
        self._bodies = {name: int(self.model.body(f"/{name}").mocapid[0]) for name in bodies}
        self._camera = int(self.model.body("camera").mocapid[0])
        try:
            self._canvas = Canvas(self.model, *size)
        except KbotError as error:
            raise KbotError(str(error).replace("cameras need", "pictures need")) from None

    def paint(
        self, poses: Mapping[str, Transform], things: PictureScene, marks: Array | None = None
    ) -> NDArray[np.uint8]:
        """Return the pixels (h, w, 3), or (h, w, 4) if the look is transparent.

        The bodies of `poses` (`world_from_body`) are drawn, on the floor of `things`, whose centre the camera
        looks at. `marks` (h, w) is how much of each pixel of the floor is marked, in 0..1.
        """
        self.place(poses, things)
        look = self.look
        palette = PALETTES[look.theme]
        floor = Floor(things, look, palette)
        background, mark = palette.background[:, None, None], palette.mark[:, None, None]
        drawn = *self._canvas.draw_depths(self.data), self._canvas.draw_opacity(self.data)
        pixels = np.empty((look.height, look.width, 4 if look.transparent else 3), dtype=np.uint8)
        for top in range(0, look.height, band := max(1, _BAND_PIXELS // look.width)):
            rows = slice(top, min(top + band, look.height))
            colours, opacity, depth = self._averaged(*drawn, rows)
            if look.transparent:
                mixed = np.concatenate([colours, opacity[None]])
            else:
                tiles, shown = floor.draw(rows)
                ground = background + (tiles - background) * shown
                if marks is not None:
                    ground += (mark - ground) * marks[rows]
                over = np.where(depth < floor.depth[rows, None], opacity, opacity * (1.0 - shown))
                mixed = ground + (colours - ground) * over
            pixels[rows] = np.moveaxis(np.rint(mixed * 255.0), 0, -1)
        return pixels

    def place(self, poses: Mapping[str, Transform], things: PictureScene) -> None:
        """Move the bodies, and the camera before the centre of `things`."""
        for name, index in self._bodies.items():
            self._put(index, poses.get(name, _AWAY))
        distance = self.look.distance(things.view_radius)
        self.model.vis.map.znear, self.model.vis.map.zfar = distance / 100.0, distance * 200.0
        eye = things.centre + self.look.towards_eye * distance
        self._put(self._camera, Transform.from_rotation_translation(self.look.axes, eye))
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)

    def _put(self, index: int, pose: Transform) -> None:
        x, y, z, w = pose.quaternion_xyzw
        self.data.mocap_pos[index], self.data.mocap_quat[index] = pose.translation, (w, x, y, z)

    def _averaged(
        self,
        colours: NDArray[np.uint8],
        depths: NDArray[np.float32],
        opacity: NDArray[np.uint8] | None,
        rows: slice,
    ) -> tuple[Array, Array, Array]:
        """Return colours (3, rows, w), opacity (rows, w) in 0..1, and the least depth (rows, w) in m.

        The depth is the distance along the camera's axis.
        """
        finer = self._finer
        part = slice(rows.start * finer, rows.stop * finer)
        depths, colours = depths[part], colours[part]
        covered = (depths < 1.0) * np.uint16(255) if opacity is None else opacity[part].astype(np.uint16)
        count = _in_columns(np.add, _in_rows(np.add, covered, finer), finer).astype(np.float64) / 255.0
        added = _in_rows(np.add, colours.astype(np.uint16), finer)  # the engine's background is black
        summed = np.stack([_in_columns(np.add, added[..., channel], finer) for channel in range(3)])
        nearest = _in_columns(np.minimum, _in_rows(np.minimum, depths, finer), finer)
        # what is see-through is mixed with the background, which is black: this divides by its opacity
        unmixed = np.minimum(summed / np.maximum(255.0 * count, 1.0), 1.0)
        return unmixed, count / finer**2, self._canvas.metres(nearest)


def _in_rows(combine: np.ufunc, values: NDArray[Number], finer: int) -> NDArray[Number]:
    """Combine each `finer` rows.

    Adding whole rows and then every n-th column is several times as fast as numpy's sum over axes of blocks.
    """
    combined: NDArray[Number] = reduce(combine, (values[row::finer] for row in range(finer)))
    return combined


def _in_columns(combine: np.ufunc, values: NDArray[Number], finer: int) -> NDArray[Number]:
    """Combine each `finer` columns."""
    combined: NDArray[Number] = reduce(combine, (values[:, column::finer] for column in range(finer)))
    return combined


def _model(
    bodies: Mapping[str, Sequence[PaintedSurface]], size: tuple[int, int], view_radius: float
) -> mujoco.MjModel:
    spec = mujoco.MjSpec()
    visual = spec.visual
    visual.global_.offwidth, visual.global_.offheight = size
    visual.quality.offsamples = visual.quality.shadowsize = 0
    spec.stat.extent = 1.0
    visual.headlight.ambient = (_AMBIENT,) * 3
    visual.headlight.diffuse = visual.headlight.specular = (0.0, 0.0, 0.0)
    for towards, strength in (((-1.6, 2.2, -4.5), _SUN), ((2.0, 1.0, -0.6), _FILL)):
        spec.worldbody.add_light(
            type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
            dir=towards,
            ambient=(0.0, 0.0, 0.0),
            diffuse=(strength,) * 3,
            specular=(strength * 0.1,) * 3,
            castshadow=False,
        )
    camera = spec.worldbody.add_body(name="camera", mocap=True)
    camera.add_camera(fovy=math.degrees(FIELD_OF_VIEW))
    number = itertools.count()
    for name, surfaces in bodies.items():
        body = spec.worldbody.add_body(name=f"/{name}", mocap=True)
        for surface in surfaces:
            if _area(surface) >= _SMALLEST * view_radius**2:
                _add(spec, body, f"surface{next(number)}", surface)
    return spec.compile()


def _area(surface: PaintedSurface) -> float:
    """Return the area of a surface in m²."""
    return float(np.linalg.norm(face_normals(surface.vertices, surface.faces), axis=1).sum()) / 2.0


def _add(spec: mujoco.MjSpec, body: mujoco.MjsBody, name: str, surface: PaintedSurface) -> None:
    faces, texture = surface.faces, surface.texture
    mesh = add_triangles(spec, name, surface.vertices, faces)
    geom = body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name)
    if texture is None:
        geom.rgba = surface.rgba
    else:
        mesh.usertexcoord = at_least_four(texture.uv * (1.0, -1.0) + (0.0, 1.0)).ravel()
        mesh.userfacetexcoord = faces.astype(np.int32).ravel()
        _add_texture(spec, name, texture)
        geom.material = name
    geom.contype = geom.conaffinity = 0  # MuJoCo computes the convex hull of meshes that can collide


def _add_texture(spec: mujoco.MjSpec, name: str, texture: Texture) -> None:
    """Add a material that maps an image onto a mesh.

    The image's first row is its top, where MuJoCo has v = 0.
    """
    image = texture.image.convert("RGB")
    laid = spec.add_texture(name=name, type=mujoco.mjtTexture.mjTEXTURE_2D, nchannel=3)
    laid.width, laid.height, laid.data = image.width, image.height, image.tobytes()
    spec.add_material(name=name).textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name
