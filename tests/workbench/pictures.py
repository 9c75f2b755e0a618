"""What a screenshot shows: a PNG as an array, and where a colour is in it."""

import base64
from io import BytesIO
from typing import Any

import numpy as np
from PIL import Image

DRAWN = """async () => {
  await kbot.drawn();
  const { x, y, width, height } = document.querySelector(".picture").getBoundingClientRect();
  return { x, y, width, height, scale: 1 };
}"""


def screenshot(page: Any) -> np.ndarray:
    """Return the visible page, (height, width, 3) in 0..255.

    It asks the browser directly. Playwright's own screenshot would wait until a moving picture stands still.
    """
    if not hasattr(page, "tools"):
        page.tools = page.context.new_cdp_session(page)
    wanted = {"format": "png", "optimizeForSpeed": True, "clip": page.evaluate(DRAWN)}
    return decode_png(base64.b64decode(page.tools.send("Page.captureScreenshot", wanted)["data"]))


def decode_png(data: bytes) -> np.ndarray:
    """Return the pixels of a PNG without opacity, (height, width, 3) in 0..255."""
    with Image.open(BytesIO(data)) as image:
        return np.asarray(image.convert("RGB"))


def blue(image: np.ndarray) -> np.ndarray:
    """Return where the picture is as blue as KBot's plate, (height, width)."""
    r, g, b = (image[..., i].astype(int) for i in range(3))
    return (b > 90) & (r < b // 2) & (g < b // 2)


def middle(mask: np.ndarray) -> tuple[float, float]:
    """Return mean column and row of a mask."""
    rows, columns = np.nonzero(mask)
    return float(columns.mean()), float(rows.mean())


def id_image(page: Any) -> tuple[np.ndarray, list[str]]:
    """Return the link index at each pixel from the page's id buffer, (height, width), -1 for none, and the
    links."""
    seen = page.evaluate("kbot.ids()")
    runs = np.array(seen["runs"]).reshape(-1, 2)
    return np.repeat(runs[:, 0], runs[:, 1]).reshape(seen["height"], seen["width"]), seen["links"]


def pixels_per_metre(page: Any) -> float:
    """Return the scale of the picture at the ground in its middle."""
    camera = page.evaluate("kbot.camera()")
    clip = np.array(camera["clipFromWorld"]).reshape(4, 4)
    ends = []
    for x in (-0.05, 0.05):
        seen = clip @ (x, 0.0, 0.0, 1.0)
        ends.append(seen[:2] / seen[3] * (camera["width"] / 2, camera["height"] / 2))
    return float(np.linalg.norm(ends[1] - ends[0]) / 0.1)
