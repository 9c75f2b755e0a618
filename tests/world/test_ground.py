"""The upper surfaces of a world's parts are found where the parts are."""

from kbot.kinematics.transform import Transform
from kbot.world.ground import Surfaces
from kbot.world.world import Body, Box, Part, Plane, World


def test_the_surface_of_a_part_after_an_infinite_one_is_at_its_own_body() -> None:
    """Both bodies have parts with the same pose in their body."""
    box = Part(Box((1.0, 1.0, 1.0)))
    near = Body("near", (box,), Transform.from_xyz_rpy((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    far = Body("far", (Part(Plane()), box), Transform.from_xyz_rpy((5.0, 0.0, 1.0), (0.0, 0.0, 0.0)))
    surfaces = Surfaces(World("w", (near, far)))
    at_far = {(body.name, type(part.shape), height) for body, part, height in surfaces.at(5.0, 0.0)}
    assert at_far == {("far", Plane, 1.0), ("far", Box, 1.5)}
