"""Write a robot as one GLB file (binary glTF 2.0): one node per link, meshes in metres, y up."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from kbot.kinematics import FrameTree
from kbot.kinematics.transform import Transform
from kbot.model import RobotModel
from kbot.render.normals import creased
from kbot.render.surfaces import PaintedSurface, robot_surfaces

if TYPE_CHECKING:
    import trimesh  # imported lazily: slow to import

# glTF 2.0, section 3.4: y is up and the front faces +z. In URDF z is up and the front faces +x (REP 103).
Y_UP_FROM_Z_UP = np.array(
    [[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
)


def glb(robot: RobotModel, joints: Mapping[str, float] | None = None) -> bytes:
    """Return the GLB of the robot with its joints at `joints` (rad, m). Joints that are not given are at 0.

    The nodes form the same tree as the links. The node of the root link is the child of a node that turns
    z-up into y-up.

    Raises:
        KbotError: an unknown joint, or a position that is not finite.
    """
    import trimesh
    from trimesh.exchange.gltf import export_glb

    tree = FrameTree(robot)
    poses = tree.poses(joints)
    scene = trimesh.Scene(base_frame="y_up")
    for name in robot.links:
        above = robot.parent_joint.get(name)
        if above is None:
            scene.graph.update(name, "y_up", matrix=Y_UP_FROM_Z_UP)
        else:
            parent_from_link = poses[above.parent].inverse() @ poses[name]
            scene.graph.update(name, above.parent, matrix=parent_from_link.matrix)
    for name, surfaces in robot_surfaces(robot).items():
        for index, surface in enumerate(surfaces):
            node = f"{name}/visual_{index}"
            scene.add_geometry(
                _mesh(surface, node),
                node_name=node,
                geom_name=node,
                parent_node_name=name,
                transform=Transform.identity().matrix,
            )
    packed: bytes = export_glb(scene, include_normals=True)
    return packed


def _mesh(surface: PaintedSurface, name: str) -> trimesh.Trimesh:
    import trimesh
    from trimesh.visual import TextureVisuals
    from trimesh.visual.material import PBRMaterial

    r, g, b, a = surface.rgba
    textured = surface.texture
    material = PBRMaterial(
        name=name,
        baseColorFactor=(1.0, 1.0, 1.0, 1.0) if textured else (*map(_linear, (r, g, b)), a),
        baseColorTexture=textured.image if textured else None,
        metallicFactor=0.05,
        roughnessFactor=0.62,
        alphaMode="BLEND" if a < 1.0 else "OPAQUE",
        doubleSided=a < 1.0,
    )
    vertices, normals, faces, sources = creased(surface.vertices, surface.faces)
    visual = TextureVisuals(uv=textured.uv[sources] if textured else None, material=material)
    return trimesh.Trimesh(vertices, faces, vertex_normals=normals, visual=visual, process=False)


def _linear(value: float) -> float:
    """Convert an sRGB component (IEC 61966-2-1) to the linear one that glTF stores."""
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4
