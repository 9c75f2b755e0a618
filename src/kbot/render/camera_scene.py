"""The world and the robot as a simulated camera sees them."""

from __future__ import annotations

import math
from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from kbot.kinematics.transform import Transform
from kbot.model import Geometry, Mesh
from kbot.model.meshes import load_mesh
from kbot.render.offscreen import add_triangles
from kbot.sim import Simulation
from kbot.sim.engine.geometry import Meshes, add_shape, mesh_name, wxyz
from kbot.text import KbotError
from kbot.world import Shape
from kbot.world import TriangleMesh as WorldMesh
from kbot.world.sdf.materials import link_colours

GREY = (0.6, 0.6, 0.6, 1.0)

# A MuJoCo camera looks along -z with y up. A sensor looks along x with z up.
_SENSOR_FROM_CAMERA = Transform.from_rotation_translation(
    np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), (0.0, 0.0, 0.0)
)


class PictureModel:
    """A model that is only drawn. Its bodies are moved to the poses of the simulation's bodies."""

    def __init__(
        self, simulation: Simulation, fovy: float, size: tuple[int, int], near: float, far: float
    ) -> None:
        """Build the model of a run.

        `fovy` is the vertical field of view in rad, `size` is width and height in pixels, `near` and `far`
        are the clipping planes in m.
        """
        self._simulation = simulation
        spec = mujoco.MjSpec()
        spec.compiler.degree = False
        visual = spec.visual
        visual.global_.offwidth, visual.global_.offheight = size
        visual.quality.offsamples = 0
        visual.quality.shadowsize = 0
        visual.map.znear, visual.map.zfar = near, far
        visual.headlight.ambient, visual.headlight.diffuse = (0.5, 0.5, 0.5), (0.5, 0.5, 0.5)
        visual.headlight.specular = (0.0, 0.0, 0.0)
        spec.stat.extent = 1.0
        self._add_world(spec)
        self._links = [link for name in simulation.robots for link in self._add_robot(spec, name)]
        camera = spec.worldbody.add_body(name="camera", mocap=True)
        camera.add_camera(name="camera", fovy=math.degrees(fovy), quat=wxyz(_SENSOR_FROM_CAMERA))
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        names = ["camera", *self._moving, *(f"{robot}/{link}" for robot, link in self._links)]
        self._mocap = {n: int(self.model.body(n).mocapid[0]) for n in names}

    def place(self, camera: NDArray[np.float64], axes: NDArray[np.float64]) -> None:
        """Move all bodies to their current poses, and the camera to `camera` (3,) with `axes` (3, 3) of the
        sensor.

        The frames of the simulation must be up to date.
        """
        simulation = self._simulation
        self._put("camera", Transform.from_rotation_translation(axes, camera))
        if self._moving:
            for name, pose in simulation.models.body_poses().items():
                self._put(f"/{name}", pose)
        for robot, link in self._links:
            self._put(f"{robot}/{link}", simulation.robots[robot].body.link_pose(link))
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)

    def _put(self, name: str, pose: Transform) -> None:
        at = self._mocap[name]
        self.data.mocap_pos[at] = pose.translation
        self.data.mocap_quat[at] = wxyz(pose)

    def _add_world(self, spec: mujoco.MjSpec) -> None:
        self._moving = [f"/{b.name}" for b in self._simulation.world.bodies if not b.is_static]
        for body in self._simulation.world.bodies:
            added = spec.worldbody.add_body(
                name=f"/{body.name}",
                pos=body.pose.translation,
                quat=wxyz(body.pose),
                mocap=not body.is_static,
            )
            for part in body.parts:
                if part.visible:
                    _add(spec, added, part.shape, part.pose, part.rgba)

    def _add_robot(self, spec: mujoco.MjSpec, robot: str) -> Iterator[tuple[str, str]]:
        """Add the links that have visuals, and yield robot and link name of each."""
        description = self._simulation.robots[robot].robot
        colours = link_colours(description)
        for name, link in description.links.items():
            if not link.visuals:
                continue
            yield robot, name
            added = spec.worldbody.add_body(name=f"{robot}/{name}", mocap=True)
            for visual in link.visuals:
                pose = Transform.of(visual.pose)
                known = colours.get(name) or (visual.material.rgba if visual.material else None)
                _add(spec, added, visual.geometry, pose, known or GREY)


def _add(
    spec: mujoco.MjSpec,
    body: mujoco.MjsBody,
    shape: Geometry | Shape,
    pose: Transform,
    rgba: tuple[float, ...],
) -> None:
    """Add one shape. Skip it if it cannot be drawn, because the simulation has already warned of it."""
    try:
        if isinstance(shape, Mesh | WorldMesh):
            geom = body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_MESH,
                pos=pose.translation,
                quat=wxyz(pose),
                meshname=_mesh(spec, shape),
            )
        else:
            geom = add_shape(Meshes(spec), body, shape, pose)
    except KbotError:
        return
    geom.rgba = rgba


def _mesh(spec: mujoco.MjSpec, shape: Mesh | WorldMesh) -> str:
    """Add the triangles of a mesh unless the model has them already, and return their name.

    Raises:
        KbotError: the file is missing or unreadable.
    """
    if isinstance(shape, WorldMesh):
        vertices, faces = shape.vertices, shape.faces.astype(np.int64)
    else:
        if shape.path is None:
            raise KbotError(f"the mesh {shape.uri} is not found")
        data = load_mesh(shape.path)
        vertices, faces = data.vertices * np.asarray(shape.scale), data.faces
    name = mesh_name(vertices, faces)
    if spec.mesh(name) is None:
        add_triangles(spec, name, vertices, faces)
    return name
