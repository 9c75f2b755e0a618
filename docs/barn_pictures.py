"""Draws the ten BARN worlds in which a robot without a map was slowest, with the path that it drove.

    python benchmarks/bench_barn.py --paths paths.json
    python docs/barn_pictures.py paths.json

writes docs/reference/images/barn_worst.png. The worlds are in the folder that KBOT_SHARED names.
"""

from __future__ import annotations

import io
import json
import os
import sys
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont

from kbot.kinematics import PlanarPose
from kbot.learn.environments.tasks.barn_worlds import read_barn_worlds
from kbot.render.path_plot import INK, LEFT, SIZE, TOP, WHITE, draw

FILE = Path(__file__).parent / "reference" / "images" / "barn_worst.png"
COUNT, COLUMNS = 10, 5
SHARE = 0.5
"""Share of the plot's width that the worlds fill: they are 4.5 m wide, and the paths 9 m long."""
HEIGHT, TITLE = 400, 24
"""Pixels of a world, and of the line above it."""
COLOURS = 32


def main() -> int:
    paths = json.loads(Path(sys.argv[1]).read_text())
    worlds = read_barn_worlds(Path(os.environ.get("KBOT_SHARED", "shared")) / "barn")
    # a path has ten points per second
    worst = sorted(paths, key=lambda name: (paths[name][0], -len(paths[name][1])))[:COUNT]
    pictures = []
    for name in worst:
        path = [PlanarPose(x, y) for x, y in paths[name][1]]
        plot = Image.open(io.BytesIO(draw(path, path, worlds[name].world, name)))
        half = round(SHARE * SIZE / 2)
        middle = LEFT + SIZE // 2
        part = plot.crop((middle - half, TOP, middle + half, TOP + SIZE))
        pictures.append(part.resize((round(2 * half * HEIGHT / SIZE), HEIGHT)))
    width = pictures[0].width + 8
    rows = -(-len(pictures) // COLUMNS)
    sheet = Image.new("RGB", (COLUMNS * width, rows * (HEIGHT + TITLE)), WHITE)
    pen = ImageDraw.Draw(sheet)
    for number, (name, picture) in enumerate(zip(worst, pictures, strict=True)):
        left, top = number % COLUMNS * width, number // COLUMNS * (HEIGHT + TITLE)
        text = f"world {name}: metric {paths[name][0]:.3f}"
        pen.text((left + 4, top + 4), text, INK, ImageFont.load_default(14))
        sheet.paste(picture, (left + 4, top + TITLE))
    FILE.parent.mkdir(exist_ok=True)
    sheet.quantize(COLOURS).save(FILE, optimize=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
