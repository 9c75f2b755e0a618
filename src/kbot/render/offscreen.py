"""Draw off screen with OpenGL: on Linux through EGL, which also works with Mesa's software driver."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from kbot.text import KbotError
from kbot.text.extras import install_command


class Canvas:
    """Draw the only camera of a model. Raises KbotError if off-screen OpenGL is not available.

    MuJoCo draws each see-through shape twice, front to back and then back to front (`mjr_render`), without
    depth. The opacities of the model are changed to those that, drawn twice, have the intended effect.
    """

    def __init__(self, model: mujoco.MjModel, width: int, height: int, shadows: bool = False) -> None:
        self._gl = _context(width, height)
        self._model = model
        with self._current():
            self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_50)
            mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        self._scene = mujoco.MjvScene(model, maxgeom=model.ngeom + 100)
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = shadows
        self._scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = False
        self._option = mujoco.MjvOption()
        self._camera = mujoco.MjvCamera()
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        self._camera.fixedcamid = 0
        self._rectangle = mujoco.MjrRect(0, 0, width, height)
        self._colours = np.empty((height, width, 3), dtype=np.uint8)
        self._depths = np.empty((height, width), dtype=np.float32)
        alpha = model.geom_rgba[:, 3]
        self._is_see_through = bool(((alpha > 0.0) & (alpha < 1.0)).any())
        alpha[:] = 1.0 - np.sqrt(1.0 - np.clip(alpha, 0.0, 1.0))

    def draw(self, data: mujoco.MjData) -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
        """Return colours (height, width, 3) and distances along the camera's axis (height, width) in m.

        The distance is inf where nothing is drawn. The first row is the top of the picture.
        """
        colours, depths = self.draw_depths(data)
        return colours.copy(), self.metres(depths)

    def draw_depths(self, data: mujoco.MjData) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Return colours and depths of OpenGL, which grow with the distance and are 1 where nothing is drawn.

        See-through shapes have the depth of opaque ones. Their colours are mixed with those behind them: with
        black where nothing is drawn. Both arrays are only valid until the next call.
        """
        self._draw(data, self._colours, self._depths)
        if self._is_see_through:
            rgba = self._model.geom_rgba.copy()
            rgba[:, 3] = rgba[:, 3] > 0.0
            with self._painted(rgba):
                self._draw(data, None, self._depths)
        return self._colours[::-1], self._depths[::-1]

    def draw_opacity(self, data: mujoco.MjData) -> NDArray[np.uint8] | None:
        """Return the opacity (height, width) of all that is drawn, in 0..255.

        None if nothing is see-through: what has a depth of less than 1 is then opaque.
        """
        if not self._is_see_through:
            return None
        rgba = self._model.geom_rgba.copy()
        rgba[:, :3] = 1.0
        colours = np.empty_like(self._colours)
        with self._painted(rgba, shaded=False):
            self._draw(data, colours, None)
        opacity: NDArray[np.uint8] = colours[::-1, :, 0]
        return opacity

    def _draw(
        self, data: mujoco.MjData, colours: NDArray[np.uint8] | None, depths: NDArray[np.float32] | None
    ) -> None:
        model, everything = self._model, mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(model, data, self._option, None, self._camera, everything, self._scene)
        with self._current():
            mujoco.mjr_render(self._rectangle, self._scene, self._context)
            mujoco.mjr_readPixels(colours, depths, self._rectangle, self._context)

    @contextmanager
    def _painted(self, rgba: NDArray[np.float32], shaded: bool = True) -> Iterator[None]:
        """Draw with other colours (ngeom, 4): shaded, or equal from every side and without textures."""
        model, headlight = self._model, self._model.vis.headlight
        kept = model.geom_rgba.copy(), model.geom_matid.copy(), headlight.ambient.copy()
        model.geom_rgba[:] = rgba
        if not shaded:
            model.geom_matid[:] = -1
            headlight.ambient[:] = 1.0  # the sum of all light is at most 1
        try:
            yield
        finally:
            model.geom_rgba[:], model.geom_matid[:], headlight.ambient[:] = kept

    def metres(self, depths: NDArray[np.float32]) -> NDArray[np.float64]:
        """The distances in m of depths of OpenGL."""
        near = self._model.vis.map.znear * self._model.stat.extent
        far = self._model.vis.map.zfar * self._model.stat.extent
        metres: NDArray[np.float64] = near / (1.0 - depths.astype(np.float64) * (1.0 - near / far))
        metres[depths >= 1.0] = np.inf
        return metres

    @contextmanager
    def _current(self) -> Iterator[None]:
        """Make the context current and release it afterwards, so that another thread can draw the next
        picture."""
        if hasattr(self._gl, "as_current"):
            with self._gl.as_current():
                yield
        else:
            self._gl.make_current()
            yield


def add_triangles(
    spec: mujoco.MjSpec, name: str, vertices: NDArray[np.float64], faces: NDArray[np.int_]
) -> mujoco.MjsMesh:
    """Add a mesh of `vertices` (n, 3) in m and `faces` (m, 3) to a model that is only drawn, and return
    it."""
    return spec.add_mesh(
        name=name,
        uservert=at_least_four(np.asarray(vertices, dtype=np.float64)).ravel(),
        userface=np.asarray(faces, dtype=np.int32).ravel(),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,  # a drawn mesh may be open
    )


def at_least_four(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Repeat the last row until there are four. MuJoCo accepts no mesh of fewer than four vertices."""
    return rows[np.minimum(np.arange(max(4, len(rows))), len(rows) - 1)]


def require_offscreen() -> None:
    """Raise KbotError if off-screen OpenGL is not available."""
    _context(1, 1).free()


def _context(width: int, height: int) -> Any:  # noqa: ANN401 - each platform has its own class
    try:
        if sys.platform.startswith("linux"):
            from mujoco.egl import GLContext  # imported lazily: each platform has its own module
        else:
            from mujoco.gl_context import GLContext
        return GLContext(width, height)
    except (ImportError, RuntimeError, AttributeError, OSError) as error:
        why = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise KbotError(
            f"cameras need off-screen OpenGL, which is not available ({why}). Install the extra 'camera' "
            f"with: {install_command('camera')}. On Linux, also: apt install libegl1 libgl1-mesa-dri"
        ) from None
