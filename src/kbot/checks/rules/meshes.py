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

_LARGEST, _SMALLEST = 5.0, 1e-3
"""Limits of the longest side of a scaled mesh, m. Outside, the mesh is probably not in metres."""
_MANY_TRIANGLES = 10_000


def _meshes(context: Context) -> Iterator[tuple[Link, Visual | Collision, Mesh]]:
    for link in context.sure_links:
        for shape in link.shapes:
            if isinstance(shape.geometry, Mesh):
                yield link, shape, shape.geometry


@rule("G101", "mesh-missing", Severity.ERROR, "robot")
def mesh_missing(context: Context) -> Found:
    """A mesh file does not exist or cannot be read, or its package is not found.

    Why: RViz shows the link white or not at all, Gazebo rejects the model, and the link has no contacts.
    Verbs that show or simulate the rest of the robot, such as `kbot sim`, report it as a warning.

    Example: `<mesh filename="package://my_robot/meshes/bsae.stl"/>`

    Fix: Add the file, correct its name, or pass the folder of the package with `--package-path`.

    Autofix: none.
    """
    for link, shape, mesh in _meshes(context):
        if mesh.path is not None:
            if why := unreadable(mesh.path):
                yield Finding(mesh.origin, f"{link.name}: {why}", cause=why)
            continue
        if not mesh.uri.strip():
            message = f"{link.name}: the {shape_name(shape)}'s mesh names no file"
            yield Finding(mesh.origin, message, cause="no file")
            continue
        try:
            expected = _expected(context, mesh.uri)
        except KbotError as error:
            message = f"{link.name}: the {shape_name(shape)}'s mesh {mesh.uri}: {error}"
            yield Finding(mesh.origin, message, cause=str(error))
            continue
        if not expected:
            continue
        found = context.folders.find_ignoring_case(expected)
        if found == expected:
            message = f"{link.name}: {expected} is not a file that can be read"
            yield Finding(mesh.origin, message, cause=expected)
        elif found is None:
            folder, name = os.path.split(expected)
            hint = did_you_mean(name, context.folders.names(folder))
            message = f"{link.name}: the {shape_name(shape)}'s mesh {mesh.uri} does not exist"
            yield Finding(mesh.origin, message, hint, cause=expected)


def _expected(context: Context, uri: str) -> str:
    """The expected path of a mesh file. Empty for an http address.

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
    """The name of a mesh differs from the existing file only by case.

    Why: The mesh is found on Windows and macOS, but not on Linux, where the robot runs. Verbs that show or
    simulate the rest of the robot, such as `kbot sim`, report it as a warning.

    Example: `meshes/Base.STL`, but the file is `base.stl`.

    Fix: Write the name of the file exactly.

    Autofix: none.
    """
    for link, shape, mesh in _meshes(context):
        if not mesh.uri.strip():
            continue
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
                f"{link.name}: the {shape_name(shape)}'s mesh {mesh.uri} differs by case from the file "
                f"'{found}'",
                "write the name of the file exactly: Linux distinguishes upper and lower case",
                cause=expected,
            )


@rule("G103", "mesh-path-absolute", Severity.WARNING, "document")
def mesh_path_absolute(context: Context) -> Found:
    """The file name of a mesh is an absolute path.

    Why: The path exists only on one machine.

    Example: `<mesh filename="file:///home/me/ws/src/robot/meshes/base.stl"/>`

    Fix: Write `package://robot/meshes/base.stl` or `file://$(find robot)/meshes/base.stl`.

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
                f"{uri} is an absolute path, which exists only on one machine",
                "write package://PACKAGE/…",
            )


@rule("G104", "mesh-size", Severity.WARNING, "robot")
def mesh_size(context: Context) -> Found:
    """A scaled mesh is larger than 5 m or smaller than 1 mm, probably because its units are millimetres.

    Why: A part of 30 cm that was drawn in millimetres is 300 m long. The camera is then inside it, and the
    physics engine computes contacts with it.

    Example: `<mesh filename="package://robot/base.stl"/>` for a file in millimetres.

    Fix: Write `scale="0.001 0.001 0.001"`.

    Autofix: none.
    """
    for link, shape, mesh in _meshes(context):
        facts = mesh_facts(mesh.path) if mesh.path else None
        if facts is None:
            continue
        extent = max((end - start) * abs(s) for start, end, s in zip(*facts.bounds, mesh.scale, strict=True))
        if not _SMALLEST <= extent <= _LARGEST:
            hint = 'scale="0.001 0.001 0.001"?' if extent > _LARGEST else "is the file already in metres?"
            yield Finding(
                mesh.origin,
                f"{link.name}: the {shape_name(shape)}'s mesh measures {extent:.4g} m: check its units",
                hint,
                cause=f"{mesh.path} {mesh.scale}",
            )


@rule("G105", "collada-scaled-twice", Severity.WARNING, "robot")
def collada_scaled_twice(context: Context) -> Found:
    """A COLLADA mesh is scaled by the unit that its file already declares.

    Why: URDF readers apply the `<unit meter="0.001"/>` of the file and then the scale. The part is a thousand
    times too small.

    Example: `<mesh filename="….dae" scale="0.001 0.001 0.001"/>` for a file with `<unit meter="0.001"/>`.

    Fix: Remove the scale.

    Autofix: none.
    """
    for link, _, mesh in _meshes(context):
        if not mesh.path or not mesh.path.lower().endswith(".dae"):
            continue
        unit = _collada_unit(mesh.path)
        factor = abs(mesh.scale[0])
        if unit is not None and unit != 1.0 and abs(factor / unit - 1.0) < 1e-6:
            yield Finding(
                mesh.origin,
                f"{link.name}: the mesh file declares the unit {unit:g} m and is scaled by {factor:g} again: "
                f"the part is {1.0 / unit:g} times too small",
                "remove the scale",
                cause=mesh.path,
            )


def _collada_unit(path: str) -> float | None:
    """The unit that a COLLADA file declares, in m. It is in the header, so the start of the file is
    enough."""
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
    """A collision mesh has more than 10,000 triangles.

    Why: Collision checks must search all triangles. Simulation and motion planning run many times slower than
    with a box, a cylinder or a convex hull, and contacts with the edges of the mesh chatter.

    Example: The detailed visual mesh, with all its screws, is used as collision too.

    Fix: Use a few simple shapes, or a decimated convex hull.

    Autofix: none.
    """
    for link, shape, mesh in _meshes(context):
        if not isinstance(shape, Collision) or not mesh.path:
            continue
        facts = mesh_facts(mesh.path)
        if facts is not None and facts.triangles > _MANY_TRIANGLES:
            yield Finding(
                mesh.origin,
                f"{link.name}: the collision's mesh has {facts.triangles:,} triangles",
                "use simple shapes",
                cause=mesh.path,
            )
