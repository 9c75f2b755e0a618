"""Rules about mesh files: missing files, sizes, and use as collision shapes."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

from kbot.checks.context import Context
from kbot.checks.facts.mesh_files import mesh_facts, unreadable
from kbot.checks.registry import Finding, Found, rule
from kbot.checks.rules.geometry import shape_name
from kbot.model import Collision, Link, Mesh, Visual
from kbot.text import KbotError, Severity
from kbot.text.files import check_regular
from kbot.text.suggest import did_you_mean

_LARGE, _TINY = 5.0, 1e-3
_MANY = 10_000


def _meshes(context: Context) -> Iterator[tuple[Link, Visual | Collision, Mesh]]:
    for link in context.sure_links:
        for shape in link.shapes:
            if isinstance(shape.geometry, Mesh):
                yield link, shape, shape.geometry


@rule("G101", "mesh-missing", Severity.ERROR, "robot")
def mesh_missing(context: Context) -> Found:
    """A mesh file that is not there, or whose package is not found.

    Why: rviz shows a white ghost or nothing, Gazebo refuses the model, and the link touches nothing.

    Example: `<mesh filename="package://my_robot/meshes/bsae.stl"/>`

    Fix: put the file there, correct the name, or say where the package is (`--package-path`).

    Autofix: none.
    """
    said: set[str] = set()
    for link, shape, mesh in _meshes(context):
        if mesh.path is not None:
            why = unreadable(mesh.path)
            if why and mesh.uri not in said:
                said.add(mesh.uri)
                yield Finding(mesh.origin, f"{link.name}: {why}")
            continue
        if mesh.uri in said:
            continue
        said.add(mesh.uri)
        if not mesh.uri.strip():
            yield Finding(mesh.origin, f"{link.name}: the {shape_name(shape)}'s mesh names no file")
            continue
        try:
            expected = _expected(context, mesh.uri)
        except KbotError as error:
            yield Finding(mesh.origin, f"{link.name}: the {shape_name(shape)}'s mesh {mesh.uri}: {error}")
            continue
        if not expected:
            continue
        found = context.folders.find_ignoring_case(expected)
        if found == expected:
            yield Finding(mesh.origin, f"{link.name}: {expected} is no file that can be read")
        elif found is None:
            folder, name = os.path.split(expected)
            hint = did_you_mean(name, context.folders.names(folder))
            message = f"{link.name}: the {shape_name(shape)}'s mesh {mesh.uri} is not there"
            yield Finding(mesh.origin, message, hint)


def _expected(context: Context, uri: str) -> str:
    """Where a mesh's file ought to be; empty for an address on the net.

    Raises:
        KbotError: its package is not found.
    """
    scheme, mark, rest = uri.partition("://")
    if mark and scheme in ("http", "https"):
        return ""
    if mark and scheme in ("package", "model"):
        context.packages.find(rest.partition("/")[0])
    return context.packages.expected(uri, context.entry.path) or uri


@rule("G102", "mesh-case", Severity.ERROR, "robot")
def mesh_case(context: Context) -> Found:
    """A mesh file whose name differs by capital letters from the one that is there.

    Why: it works on Windows and macOS and is missing on Linux, where the robot runs.

    Example: `meshes/Base.STL` where the file is `base.stl`.

    Fix: write the name as the file has it.

    Autofix: none.
    """
    said: set[str] = set()
    for link, shape, mesh in _meshes(context):
        if mesh.uri in said or not mesh.uri.strip():
            continue
        said.add(mesh.uri)
        try:
            expected = mesh.path or _expected(context, mesh.uri)
        except KbotError:
            continue
        folder, name = os.path.split(expected)
        if not name or name in context.folders.names(folder):
            continue
        found = os.path.basename(context.folders.find_ignoring_case(expected) or "")
        if found.lower() == name.lower():
            yield Finding(
                mesh.origin,
                f"{link.name}: the {shape_name(shape)}'s mesh {mesh.uri} differs by capital letters from the "
                f"file '{found}'",
                "write it as the file is called: Linux tells them apart",
            )


@rule("G103", "mesh-path-absolute", Severity.WARNING, "document")
def mesh_path_absolute(context: Context) -> Found:
    """A mesh named by an absolute path or by `file://` with one that was written by hand.

    Why: it is there on one machine only.

    Example: `<mesh filename="file:///home/me/ws/src/robot/meshes/base.stl"/>`

    Fix: `package://robot/meshes/base.stl`, or `file://$(find robot)/meshes/base.stl`.

    Autofix: none.
    """
    for element in context.tagged("mesh", "texture"):
        uri = element.attributes.get("filename", "")
        if not re.match(r"(file://)?(/|[A-Za-z]:[\\/])", uri):
            continue
        origin = element.attribute_origin("filename")
        if "$" not in origin.span.text:
            yield Finding(
                origin,
                f"{uri} is an absolute path: it is there on one machine only",
                "use package://PACKAGE/…",
            )


@rule("G104", "mesh-size", Severity.WARNING, "robot")
def mesh_size(context: Context) -> Found:
    """A mesh that measures over 5 m or under 1 mm with its scale: millimetres taken for metres.

    Why: a part of 30 cm drawn in millimetres is 300 m large: the camera is inside it, and the physics engine
    places its contacts there.

    Example: `<mesh filename="package://robot/base.stl"/>` for a file in millimetres.

    Fix: `scale="0.001 0.001 0.001"`.

    Autofix: none.
    """
    for link, shape, mesh in _meshes(context):
        facts = mesh_facts(mesh.path) if mesh.path else None
        if facts is None:
            continue
        extent = max((end - start) * abs(s) for start, end, s in zip(*facts.bounds, mesh.scale, strict=True))
        if not _TINY <= extent <= _LARGE:
            hint = 'scale="0.001 0.001 0.001"?' if extent > _LARGE else "is the file in metres already?"
            yield Finding(
                mesh.origin,
                f"{link.name}: the {shape_name(shape)}'s mesh measures {extent:.4g} m: units?",
                hint,
            )


@rule("G105", "collada-scaled-twice", Severity.WARNING, "robot")
def collada_scaled_twice(context: Context) -> Found:
    """A COLLADA mesh that says its unit and is scaled by the same factor again.

    Why: readers apply the file's own `<unit meter="0.001"/>`, then the scale: the part is a thousand
    times too small.

    Example: `<mesh filename="….dae" scale="0.001 0.001 0.001"/>` for a file with `<unit meter="0.001"/>`.

    Fix: leave the scale out.

    Autofix: none.
    """
    said: set[str] = set()
    for link, _, mesh in _meshes(context):
        if not mesh.path or not mesh.path.lower().endswith(".dae") or mesh.uri in said:
            continue
        said.add(mesh.uri)
        unit = _collada_unit(mesh.path)
        factor = abs(mesh.scale[0])
        if unit is not None and unit != 1.0 and abs(factor / unit - 1.0) < 1e-6:
            yield Finding(
                mesh.origin,
                f"{link.name}: the mesh's own unit is {unit:g} m and its scale {factor:g} once more: "
                f"the part is {1.0 / unit:g} times too small",
                "leave the scale out",
            )


def _collada_unit(path: str) -> float | None:
    try:
        check_regular(path)
        with Path(path).open("rb") as stream:
            head = stream.read(8192)
    except OSError:
        return None
    match = re.search(rb'<unit\b[^<>]*\bmeter\s*=\s*"([^"]+)"', head)
    try:
        return float(match[1]) if match else None
    except ValueError:
        return None


@rule("G110", "heavy-collision-mesh", Severity.INFO, "robot")
def heavy_collision_mesh(context: Context) -> Found:
    """A collision mesh of more than 10,000 triangles.

    Why: every contact is searched in it: simulation and motion planning run many times slower than with a
    box, a cylinder or a convex hull, and contacts with its edges chatter.

    Example: the visual's mesh, with all its screws, given as collision too.

    Fix: a few plain shapes, or a decimated convex hull.

    Autofix: none.
    """
    for link, shape, mesh in _meshes(context):
        if not isinstance(shape, Collision) or not mesh.path:
            continue
        facts = mesh_facts(mesh.path)
        if facts is not None and facts.triangles > _MANY:
            yield Finding(
                mesh.origin,
                f"{link.name}: the collision's mesh has {facts.triangles:,} triangles",
                "use plain shapes",
            )
