"""Moving bodies of the world without anything to draw."""

import kbot
from kbot.kinematics.transform import Transform
from kbot.workbench.driving.world_actions import other_robots
from kbot.workbench.meshes.store import MeshStore
from kbot.workbench.scene.scene import all_bodies

UNSEEN = """<sdf version="1.7"><model name="m"><link name="l"><inertial><mass>1</mass></inertial>
<collision name="c"><geometry><sphere><radius>0.1</radius></sphere></geometry></collision></link></model>
</sdf>"""


def test_a_scene_has_a_body_for_each_pose_in_a_state() -> None:
    sim = kbot.Simulation("kbot", "boxes")
    sim.models.spawn_model("kbot", "b", x=1.0)
    sim.models.spawn_sdf(UNSEEN, "m", Transform.from_xyz_rpy((0.0, 2.0, 0.1), (0.0, 0.0, 0.0)))
    reported = [*sim.models.body_poses(), *(f"b/{link}" for link in sim.robots["b"].robot.links)]
    shown = all_bodies(sim.world, other_robots(sim), MeshStore())
    assert [body.name for body in shown if body.moving] == reported
    assert "m" in reported
