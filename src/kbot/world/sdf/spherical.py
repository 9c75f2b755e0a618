"""`<spherical_coordinates>`: where on the earth a world lies."""

from __future__ import annotations

import math

from kbot.text import Element
from kbot.world.georeference import Georeference
from kbot.world.sdf.values import Values


def georeference(world: Element, values: Values) -> Georeference | None:
    """What a `<world>` says of it; None where it says nothing, or nothing that is a place on the earth."""
    element = world.find("spherical_coordinates")
    if element is None:
        return None
    for tag, usual in (("surface_model", "EARTH_WGS84"), ("world_frame_orientation", "ENU")):
        said = element.find(tag)
        if said is not None and said.text.strip() != usual:
            values.unsupported(said, f"<{tag}> is taken for {usual}")
    latitude = values.number(element, "latitude_deg", 0.0)
    longitude = values.number(element, "longitude_deg", 0.0)
    if not (abs(latitude) <= 90.0 and abs(longitude) <= 180.0):
        values.findings.error(
            "W204", f"({latitude:g}, {longitude:g}) degrees is no place on the earth", element.origin
        )
        return None
    heading = math.radians(values.number(element, "heading_deg", 0.0))
    return Georeference(latitude, longitude, values.number(element, "elevation", 0.0), heading)
