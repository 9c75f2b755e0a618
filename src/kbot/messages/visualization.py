"""Messages for displays: visualization_msgs/Marker, compressed images, poses, polygons."""

from __future__ import annotations

from dataclasses import dataclass

from kbot.brief import Brief
from kbot.messages.control import Duration
from kbot.messages.types import Float32, Header, Int32, Point, Pose, Vector3

HEADER, ORIGIN, HERE, NO_SIZE, FOR_EVER = Header(), Pose(), Point(), Vector3(), Duration()

ARROW, CUBE, SPHERE, CYLINDER, LINE_STRIP, LINE_LIST = 0, 1, 2, 3, 4, 5
CUBE_LIST, SPHERE_LIST, POINTS, TEXT_VIEW_FACING, MESH_RESOURCE, TRIANGLE_LIST = 6, 7, 8, 9, 10, 11
ARROW_STRIP = 12
ADD, DELETE, DELETE_ALL = 0, 2, 3


@dataclass(frozen=True, slots=True)
class ColorRGBA:
    """Each component is in 0..1."""

    r: Float32 = 0.0
    g: Float32 = 0.0
    b: Float32 = 0.0
    a: Float32 = 0.0


@dataclass(frozen=True, slots=True, repr=False)
class CompressedImage(Brief):
    """`data` is a file in the given `format`, jpeg or png."""

    header: Header = HEADER
    format: str = ""
    data: bytes = b""


@dataclass(frozen=True, slots=True)
class UVCoordinate:
    u: Float32 = 0.0
    v: Float32 = 0.0


@dataclass(frozen=True, slots=True, repr=False)
class MeshFile(Brief):
    filename: str = ""
    data: bytes = b""


BLACK, NO_IMAGE, NO_FILE = ColorRGBA(), CompressedImage(), MeshFile()


@dataclass(frozen=True, slots=True, repr=False)
class Marker(Brief):
    """A shape to draw, identified by `ns` and `id`. `type` and `action` are the numbers above.

    Without a `lifetime` it stays until it is deleted.
    """

    header: Header = HEADER
    ns: str = ""
    id: Int32 = 0
    type: Int32 = ARROW
    action: Int32 = ADD
    pose: Pose = ORIGIN
    scale: Vector3 = NO_SIZE
    color: ColorRGBA = BLACK
    lifetime: Duration = FOR_EVER
    frame_locked: bool = False
    points: tuple[Point, ...] = ()
    colors: tuple[ColorRGBA, ...] = ()
    texture_resource: str = ""
    texture: CompressedImage = NO_IMAGE
    uv_coordinates: tuple[UVCoordinate, ...] = ()
    text: str = ""
    mesh_resource: str = ""
    mesh_file: MeshFile = NO_FILE
    mesh_use_embedded_materials: bool = False


@dataclass(frozen=True, slots=True, repr=False)
class MarkerArray(Brief):
    markers: tuple[Marker, ...] = ()


@dataclass(frozen=True, slots=True, repr=False)
class PoseArray(Brief):
    header: Header = HEADER
    poses: tuple[Pose, ...] = ()


@dataclass(frozen=True, slots=True)
class Point32:
    x: Float32 = 0.0
    y: Float32 = 0.0
    z: Float32 = 0.0


@dataclass(frozen=True, slots=True, repr=False)
class Polygon(Brief):
    """Corners in order. The last is connected to the first."""

    points: tuple[Point32, ...] = ()


NO_CORNERS = Polygon()


@dataclass(frozen=True, slots=True, repr=False)
class PolygonStamped(Brief):
    header: Header = HEADER
    polygon: Polygon = NO_CORNERS


@dataclass(frozen=True, slots=True, repr=False)
class PointStamped(Brief):
    header: Header = HEADER
    point: Point = HERE
