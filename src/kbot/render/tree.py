"""Draw the kinematic tree as SVG, in the style of `urdf_to_graphviz`: links as boxes, joints as ovals."""

from __future__ import annotations

from kbot.model import Joint, RobotModel
from kbot.text.xml_text import escaped

_ROW, _HIGH, _GAP, _LETTER = 56, 30, 34, 7.4
_STYLE = (
    "text{font:13px system-ui,sans-serif;text-anchor:middle;dominant-baseline:central;fill:#18212c}"
    ".link rect{fill:#fff;stroke:#18212c}.joint ellipse{fill:#e8f1fd;stroke:#0b6fd3}.joint text{fill:#0b4f96}"
    ".fixed ellipse{fill:#f3f4f6;stroke:#758393}.fixed text{fill:#4a5663}"
    "path{fill:none;stroke:#758393}"
)


def tree_svg(robot: RobotModel) -> str:
    """Return the tree from left to right, starting with the root. Each joint's tooltip shows its type."""
    children: dict[str, list[Joint]] = {name: [] for name in robot.links}
    for joint in robot.joints.values():
        children[joint.parent].append(joint)
    order = _depth_first(robot.root, children)
    depth = {robot.root: 0}
    for name in order[1:]:
        depth[name] = depth[robot.parent_joint[name].parent] + 1
    row: dict[str, float] = {}
    leaves = 0
    for name in reversed(order):
        below = [row[joint.child] for joint in children[name]]
        if not below:
            leaves += 1
        row[name] = (below[0] + below[-1]) / 2.0 if below else -float(leaves)
    levels = range(max(depth.values()) + 1)
    link_width = [max(_width(n) for n in order if depth[n] == level) for level in levels]
    joint_width = [
        max((_width(robot.parent_joint[n].name) + 26 for n in order if depth[n] == level), default=0.0)
        for level in levels[1:]
    ]
    left = [20.0]
    for level in levels[1:]:
        left.append(left[-1] + link_width[level - 1] + joint_width[level - 1] + 2 * _GAP)
    width, height = left[-1] + link_width[-1] + 20, leaves * _ROW + 20
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height}"'
        f' viewBox="0 0 {width:.0f} {height}" role="img">',
        f"<title>{escaped(robot.name)}</title>",
        f"<style>{_STYLE}</style>",
        '<rect width="100%" height="100%" fill="#fff"/>',
    ]
    for name in order:
        x, y, wide = left[depth[name]], (row[name] + leaves + 0.5) * _ROW + 10, link_width[depth[name]]
        if name != robot.root:
            joint = robot.parent_joint[name]
            above = (row[joint.parent] + leaves + 0.5) * _ROW + 10
            start = left[depth[name] - 1] + link_width[depth[name] - 1]
            across = joint_width[depth[name] - 1]
            middle = start + _GAP + across / 2
            lines.append(
                f'<path d="M{start:.1f} {above:.1f}C{start + _GAP:.1f} {above:.1f} {start:.1f} {y:.1f}'
                f' {start + _GAP:.1f} {y:.1f}H{x:.1f}"/>'
            )
            kind = joint.type.value
            lines.append(
                f'<g class="joint {kind}"><title>{escaped(joint.name)}: {kind}</title>'
                f'<ellipse cx="{middle:.1f}" cy="{y:.1f}" rx="{across / 2:.1f}" ry="{_HIGH / 2 + 2}"/>'
                f'<text x="{middle:.1f}" y="{y:.1f}">{escaped(joint.name)}</text></g>'
            )
        lines.append(
            f'<g class="link" id="{escaped(name)}"><title>{escaped(name)}</title>'
            f'<rect x="{x:.1f}" y="{y - _HIGH / 2:.1f}" width="{wide:.1f}" height="{_HIGH}" rx="5"/>'
            f'<text x="{x + wide / 2:.1f}" y="{y:.1f}">{escaped(name)}</text></g>'
        )
    return "\n".join([*lines, "</svg>"]) + "\n"


def _depth_first(root: str, children: dict[str, list[Joint]]) -> list[str]:
    """Return all links, parents before children. It is not recursive, because chains can be long."""
    order, waiting = [], [root]
    while waiting:
        order.append(waiting.pop())
        waiting += [joint.child for joint in reversed(children[order[-1]])]
    return order


def _width(name: str) -> float:
    return len(name) * _LETTER + 22
