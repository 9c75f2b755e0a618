"""The elements and attributes of URDF, as urdfdom and its common extensions read them."""

from __future__ import annotations

ATTRIBUTES: dict[str, tuple[str, ...]] = {
    "robot": ("name", "version"),
    "link": ("name", "type"),
    "joint": ("name", "type"),
    "inertial": (),
    "visual": ("name",),
    "collision": ("name", "group"),
    "geometry": (),
    "origin": ("xyz", "rpy", "quat_xyzw"),
    "mass": ("value",),
    "inertia": ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"),
    "box": ("size",),
    "cylinder": ("radius", "length"),
    "sphere": ("radius",),
    "capsule": ("radius", "length"),
    "mesh": ("filename", "scale"),
    "material": ("name",),
    "color": ("rgba",),
    "texture": ("filename",),
    "parent": ("link",),
    "child": ("link",),
    "axis": ("xyz",),
    "calibration": ("rising", "falling", "reference_position"),
    "dynamics": ("damping", "friction"),
    "limit": ("lower", "upper", "effort", "velocity", "acceleration", "deceleration", "jerk"),
    "mimic": ("joint", "multiplier", "offset"),
    "safety_controller": ("k_velocity", "k_position", "soft_lower_limit", "soft_upper_limit"),
}
"""The attributes of each element."""

CHILDREN: dict[str, tuple[str, ...]] = {
    "robot": ("link", "joint", "material", "gazebo", "transmission", "ros2_control", "sensor"),
    "link": ("inertial", "visual", "collision"),
    "joint": (
        "origin",
        "parent",
        "child",
        "axis",
        "calibration",
        "dynamics",
        "limit",
        "mimic",
        "safety_controller",
    ),
    "inertial": ("origin", "mass", "inertia"),
    "visual": ("origin", "geometry", "material"),
    "collision": ("origin", "geometry"),
    "geometry": ("box", "cylinder", "sphere", "capsule", "mesh"),
    "material": ("color", "texture"),
}
"""The allowed children of each element."""

TOLERATED: dict[str, frozenset[str]] = {
    "link": frozenset(
        {
            "gazebo",
            "sensor",
            "contact",
            "self_collision_checking",
            "collision_checking",
            "turnGravityOff",
            "xacro",
        }
    ),
    "joint": frozenset({"gazebo", "hardwareInterface", "disable_fixed_joint_lumping", "sensor"}),
    "collision": frozenset({"material", "contact_coefficients", "surface", "verbose", "max_contacts"}),
    "visual": frozenset({"cast_shadows", "meta", "plugin", "verbose", "transparency"}),
    "geometry": frozenset({"plane", "heightmap", "ellipsoid", "octree", "sdf", "cone", "cdf"}),
    "material": frozenset({"script", "ambient", "diffuse", "specular", "emissive", "pbr"}),
}
"""Elements that other readers use (Gazebo's SDF, Bullet, Drake, PR2). Not reported inside these parents."""

FOREIGN_ATTRIBUTES: dict[str, frozenset[str]] = {
    "robot": frozenset({"format"}),
    "mesh": frozenset({"convexdecomposition", "use_mesh_materials"}),
    "dynamics": frozenset(
        {"spring_stiffness", "spring_reference", "armature", "rotor_inertia", "gear_ratio"}
    ),
}
