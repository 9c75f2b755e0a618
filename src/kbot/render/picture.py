"""Draw a picture as PNG without a browser, with the page's colours, light and floor."""

from __future__ import annotations

import io
import itertools
import math
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


def draw_picture(things: PictureScene, look: Look) -> bytes:
    """Return a PNG of exactly the size of `look`: with the floor, or without it if the look is transparent.

    Raises:
        KbotError: off-screen OpenGL is not available. The message says what to install.
    """
    finer = max(1, min(_FINER, _MOST_DRAWN // max(look.width, look.height)))
    drawing = _Drawing(things, look, finer)
    palette = PALETTES[look.theme]
    floor = Floor(things, look, palette)
    background = palette.background[:, None, None]
    pixels = np.empty((look.height, look.width, 4 if look.transparent else 3), dtype=np.uint8)
    for top in range(0, look.height, band := max(1, _BAND_PIXELS // look.width)):
        rows = slice(top, min(top + band, look.height))
        colours, opacity, depth = drawing.averaged(rows)
        if look.transparent:
            mixed = np.concatenate([colours, opacity[None]])
        else:
            tiles, shown = floor.draw(rows)
            ground = background + (tiles - background) * shown
            over = np.where(depth < floor.depth[rows, None], opacity, opacity * (1.0 - shown))
            mixed = ground + (colours - ground) * over
        pixels[rows] = np.moveaxis(np.rint(mixed * 255.0), 0, -1)
    packed = io.BytesIO()
    Image.fromarray(pixels).save(packed, "PNG")
    return packed.getvalue()


class _Drawing:
    """The robot and objects of one picture, drawn `finer` times larger."""

    def __init__(self, things: PictureScene, look: Look, finer: int) -> None:
        self._finer = finer
        width, height = look.width * finer, look.height * finer
        model = _model(things, look, width, height)
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_camlight(model, data)
        try:
            self._canvas = Canvas(model, width, height)
            self._colours, self._depths = self._canvas.draw_depths(data)
        except KbotError as error:
            raise KbotError(str(error).replace("cameras need", "pictures need")) from None

    def averaged(self, rows: slice) -> tuple[Array, Array, Array]:
        """Return colours (3, rows, w), opacity (rows, w) in 0..1, and the least depth (rows, w) in m.

        The depth is the distance along the camera's axis.
        """
        finer = self._finer
        part = slice(rows.start * finer, rows.stop * finer)
        depths, colours = self._depths[part], self._colours[part]
        hit = depths < 1.0
        count = _reduced(np.add, hit.view(np.uint8), finer)
        planes = (np.where(hit, colours[..., channel], 0) for channel in range(3))
        summed = np.stack([_reduced(np.add, plane.astype(np.uint16), finer) for plane in planes])
        nearest = _reduced(np.minimum, depths, finer)
        return summed / (255.0 * np.maximum(count, 1)), count / finer**2, self._canvas.metres(nearest)


def _reduced(combine: np.ufunc, plane: NDArray[Number], finer: int) -> NDArray[Number]:
    """Combine each block of `finer` x `finer` values.

    Adding whole rows and then every n-th column is several times as fast as numpy's sum over axes of blocks.
    """
    rows: NDArray[Number] = reduce(combine, (plane[row::finer] for row in range(finer)))
    blocks: NDArray[Number] = reduce(combine, (rows[:, column::finer] for column in range(finer)))
    return blocks


def _model(things: PictureScene, look: Look, width: int, height: int) -> mujoco.MjModel:
    spec = mujoco.MjSpec()
    visual = spec.visual
    visual.global_.offwidth, visual.global_.offheight = width, height
    visual.quality.offsamples = visual.quality.shadowsize = 0
    distance = look.distance(things.view_radius)
    spec.stat.extent = 1.0
    visual.map.znear, visual.map.zfar = distance / 100.0, distance * 200.0
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
    pose = Transform.from_rotation_translation(look.axes, things.centre + look.towards_eye * distance)
    x, y, z, w = pose.quaternion_xyzw
    spec.worldbody.add_camera(pos=pose.translation, quat=(w, x, y, z), fovy=math.degrees(FIELD_OF_VIEW))
    surfaces = itertools.chain(*things.links.values(), things.others)
    for number, surface in enumerate(surfaces):
        if _area(surface) < _SMALLEST * things.view_radius**2:
            continue
        _add(spec, f"surface{number}", surface)
    return spec.compile()


def _area(surface: PaintedSurface) -> float:
    """Return the area of a surface in m²."""
    return float(np.linalg.norm(face_normals(surface.vertices, surface.faces), axis=1).sum()) / 2.0


def _add(spec: mujoco.MjSpec, name: str, surface: PaintedSurface) -> None:
    faces, texture = surface.faces, surface.texture
    mesh = add_triangles(spec, name, surface.vertices, faces)
    geom = spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name)
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
