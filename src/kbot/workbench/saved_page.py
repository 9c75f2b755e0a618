"""Make one HTML file that displays a robot without a server."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from kbot.kinematics.frames import mimics, unit_axis
from kbot.kinematics.transform import Transform
from kbot.model import Joint, JointType, RobotModel
from kbot.text import KbotError
from kbot.text.xml_text import escaped
from kbot.workbench.built_page import FOLDER, LICENCES
from kbot.workbench.protocol import Findings, Scene, State
from kbot.workbench.protocol.codec import encode
from kbot.workbench.scene.scene import position_quaternion
from kbot.workbench.session.session import Session

_ALLOWED = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; font-src data:;"
    " img-src data: blob:"
)


def saved_page(
    session: Session, robot: RobotModel, states: Sequence[State] = (), folder: Path = FOLDER
) -> str:
    """Return the HTML of a session that displays `robot`, with sliders for its joints.

    With `states` of its scene it has a slider over those states instead.

    Raises:
        KbotError: the page is not built.
    """
    try:
        script = (folder / "offline" / "page.js").read_text("utf-8").replace("</script", "<\\/script")
        style = (folder / "offline" / "page.css").read_text("utf-8")
        licences = (folder / LICENCES).read_text("utf-8")
    except OSError:
        raise KbotError("the page is not built: run `python hatch_build.py` in the checkout") from None
    is_checked = session.shown.is_written
    greeting = [
        json.loads(encode(message))
        for message in session.greeting(0)
        if is_checked
        or not isinstance(message, Findings)  # without checks, an empty list would claim that there are none
    ]
    saved = {
        "greeting": greeting,
        "sources": list(_sources(session)),
        "meshes": dict(_meshes(session)),
        "kinematics": kinematics(robot, session.scene),
        "licences": licences,
        "states": [json.loads(encode(state)) for state in states],
    }
    title = escaped(f"{session.scene.robot} · KBot")
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f'<meta http-equiv="Content-Security-Policy" content="{_ALLOWED}">'
        f'<meta name="color-scheme" content="dark light"><title>{title}</title><style>{style}</style></head>'
        f'<body><script type="application/json" id="saved">{_in_html(saved)}</script>'
        f"<script>{script}</script></body></html>\n"
    )


def kinematics(robot: RobotModel, scene: Scene) -> dict[str, object]:
    """Return the tree of links as `web/src/offline/kinematics.ts` reads it.

    Frames are in m and quaternions, in the order of the scene's links and joints.
    """
    links = {link.name: index for index, link in enumerate(scene.links)}
    joints = {joint.name: index for index, joint in enumerate(scene.joints)}
    hinges = [_hinge(robot.parent_joint.get(name), links, joints) for name in links]
    follows = [
        {
            "joint": joints[joint],
            "leader": joints[follow.leader],
            "multiplier": follow.multiplier,
            "offset": follow.offset,
        }
        for joint, follow in mimics(robot).items()
    ]
    return {"hinges": hinges, "follows": follows, "order": [links[name] for name in _parents_first(robot)]}


def _hinge(joint: Joint | None, links: dict[str, int], joints: dict[str, int]) -> dict[str, object]:
    if joint is None:
        return {
            "parent": -1,
            "origin": [0, 0, 0, 0, 0, 0, 1],
            "joint": -1,
            "axis": [1, 0, 0],
            "slides": False,
        }
    position, quaternion = position_quaternion(Transform.of(joint.pose))
    return {
        "parent": links[joint.parent],
        "origin": [*position, *quaternion],
        "joint": joints.get(joint.name, -1),
        "axis": unit_axis(joint).tolist(),
        "slides": joint.type is JointType.PRISMATIC,
    }


def _parents_first(robot: RobotModel) -> Iterator[str]:
    below: dict[str, list[str]] = {}
    for joint in robot.joints.values():
        below.setdefault(joint.parent, []).append(joint.child)
    waiting = [robot.root]
    while waiting:
        name = waiting.pop()
        yield name
        waiting += below.get(name, ())


def _sources(session: Session) -> Iterator[Any]:  # Any: JSON
    for file in session.shown.files:
        try:
            yield json.loads(encode(session.shown.source(file)))
        except KbotError:
            continue  # the file was deleted after it was read: the page shows no text for it


def _meshes(session: Session) -> Iterator[tuple[str, str]]:
    scene = session.scene
    shapes = [shape for link in scene.links for shape in (*link.visuals, *link.collisions)]
    shapes += [part for body in scene.bodies for part in body.parts]
    for mesh in dict.fromkeys(shape.mesh for shape in shapes if shape.mesh):
        packed = session.meshes.packed(mesh)
        if packed is not None:
            yield mesh, base64.b64encode(packed).decode("ascii")


def _in_html(value: object) -> str:
    """Return JSON in which no HTML parser finds the end of a script."""
    return json.dumps(value, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
