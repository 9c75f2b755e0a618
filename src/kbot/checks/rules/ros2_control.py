"""Rules about `<ros2_control>` and the files of its controllers' parameters."""

from __future__ import annotations

from collections.abc import Iterator

from kbot.checks.context import Context
from kbot.checks.registry import Finding, Found, reported, rule
from kbot.model.extensions import extensions
from kbot.text import Element, Severity
from kbot.text.suggest import did_you_mean

_GAZEBO = (
    "gazebo_ros2_control/GazeboSystem",
    "gz_ros2_control/GazeboSimSystem",
    "ign_ros2_control/IgnitionSystem",
    "ignition_ros2_control/IgnitionSystem",
)
_PLUGINS = (*_GAZEBO, "fake_components/GenericSystem", "mock_components/GenericSystem")
_INTERFACES = ("position", "velocity", "effort")
_SHORT = {"pos": "position", "vel": "velocity", "eff": "effort", "torque": "effort", "force": "effort"}


@rule("D129", "hardware-plugin-unknown", Severity.ERROR, "robot", is_ros_only=True)
def hardware_plugin_unknown(context: Context) -> Found:
    """A hardware plugin does not exist in its package.

    Why: pluginlib finds no such class, and the controller manager does not load the hardware. No controller
    then finds the interfaces of its joints. `kbot sim` and `kbot launch` simulate the rest of the robot, and
    report it as a warning.

    Example: `<plugin>gz_ros2_control/GazeboSimSystm</plugin>`

    Fix: Write the plugin's name as its package declares it. KBot does not report plugins of packages that it
    does not know.

    Autofix: safe: KBot corrects the name if it is a typo of exactly one known name.
    """
    packages = {name.partition("/")[0] for name in _PLUGINS}
    for plugin in _plugins(context):
        name = plugin.text.strip()
        hint = did_you_mean(name, _PLUGINS)
        if name not in _PLUGINS and (hint.sure or name.partition("/")[0] in packages):
            message = f"there is no hardware plugin '{name}': the controller manager does not load it"
            yield Finding(plugin.origin, message, hint)


@rule("D130", "interface-unknown", Severity.ERROR, "robot", is_ros_only=True)
def interface_unknown(context: Context) -> Found:
    """The hardware of a joint does not have an interface of this name.

    Why: Gazebo's hardware offers the interfaces position, velocity and effort only. A controller that claims
    `arm/position` is not loaded if the joint offers `arm/pos`. `kbot sim` and `kbot launch` simulate the rest
    of the robot, and report it as a warning.

    Example: `<command_interface name="pos"/>`

    Fix: Write `position`, `velocity` or `effort`. Your own hardware may have other interfaces.
    For such hardware, KBot reports only typos of these three names.

    Autofix: safe: KBot corrects the name if it is a typo of exactly one known name.
    """
    for extension in extensions(context.robot, "ros2_control"):
        is_gazebo = any(e.text.strip().partition("/")[0] in _GAZEBO_PACKAGES for e in _plugins_of(extension))
        for joint in extension.elements("joint"):
            for element in (*joint.elements("command_interface"), *joint.elements("state_interface")):
                name = element.attributes.get("name", "").strip()
                hint = did_you_mean(name, _INTERFACES)
                if name in _INTERFACES or not (is_gazebo or hint.sure) or "$" in name:
                    continue
                suggestion = hint or (f"did you mean '{_SHORT[name]}'?" if name in _SHORT else "")
                yield Finding(
                    element.attribute_origin("name"),
                    f"{joint.attributes.get('name', '')}: its hardware has no interface '{name}'",
                    suggestion or f"it has {', '.join(_INTERFACES)}",
                )


_GAZEBO_PACKAGES = frozenset(name.partition("/")[0] for name in _GAZEBO)


def _plugins(context: Context) -> Iterator[Element]:
    for extension in extensions(context.robot, "ros2_control"):
        yield from _plugins_of(extension)


def _plugins_of(control: Element) -> Iterator[Element]:
    for hardware in control.elements("hardware"):
        yield from hardware.elements("plugin")


def _faults(context: Context, code: str) -> Found:
    return reported((fault for file in context.controller_files for fault in file.faults), code)


@rule("W132", "controllers-unreadable", Severity.ERROR, "robot")
def controllers_unreadable(context: Context) -> Found:
    """KBot cannot read a file of controller parameters.

    Why: The controller manager loads none of the controllers, and the limits and sizes of the drive are
    unknown.

    Example: A YAML file that is indented with a tab.

    Fix: Correct the file. If the file is missing, the severity is warning.

    Autofix: none.
    """
    return _faults(context, "W132")


@rule("W143", "controller-type-unknown", Severity.ERROR, "robot", is_ros_only=True)
def controller_type_unknown(context: Context) -> Found:
    """The type of a controller does not exist in its package.

    Why: The controller manager finds no such class and does not load the controller. Nothing commands its
    joints.

    Example: `type: joint_trajectory_controller/JointTrajectoryControler`

    Fix: Write the type as its package declares it. KBot does not report types of packages that it does not
    know.

    Autofix: none.
    """
    for file in context.controller_files:
        for name, kind, origin, meant in file.unknown_types():
            yield Finding(
                origin, f"the controller '{name}' is not loaded: its type '{kind}' does not exist", meant
            )


@rule("W144", "parameters-misnamed", Severity.ERROR, "robot", is_ros_only=True)
def parameters_misnamed(context: Context) -> Found:
    """The parameters of a node are under a misspelt key instead of `ros__parameters`, which has two
    underscores.

    Why: rcl refuses the whole file ("Cannot have a value before ros__parameters"), and the controller manager
    exits before it starts.

    Example: `arm_controller: {ros_parameters: {joints: [elbow]}}`

    Fix: Write `ros__parameters`.

    Autofix: none.
    """
    return _faults(context, "W144")
