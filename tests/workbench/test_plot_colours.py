"""The plots' colours are distinct for colour-blind people, on paper and in the page."""

import itertools
import re
from pathlib import Path

import numpy as np
import pytest

from kbot.render.plot import Curve, plot_svg

TOKENS = Path(__file__).parents[2] / "web" / "src" / "style" / "tokens.css"
SEEN = {
    "all": np.eye(3),
    "no red": [[0.1523, 1.0526, -0.2049], [0.1145, 0.7863, 0.0992], [-0.0039, -0.0481, 1.052]],
    "no green": [[0.3673, 0.8606, -0.228], [0.2801, 0.6725, 0.0474], [-0.0118, 0.0429, 0.9689]],
    "no blue": [[1.2555, -0.0767, -0.1788], [-0.0784, 0.9308, 0.1476], [0.0047, 0.6914, 0.3039]],
}
"""Linear light as it is seen without one kind of cone (Machado, Oliveira and Fernandes, 2009)."""
XYZ_FROM_RGB = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
WHITE = XYZ_FROM_RGB.sum(axis=1)


def light(code: str) -> np.ndarray:
    """Return the linear light of an sRGB colour, (3,)."""
    c = np.array([int(code[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def lab(linear: np.ndarray) -> np.ndarray:
    """Return CIE L*a*b*, in which equal distances look about equal."""
    t = XYZ_FROM_RGB @ np.clip(linear, 0, 1) / WHITE
    x, y, z = np.where(t > 0.008856, np.cbrt(t), 7.787 * t + 16 / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def colours(theme: str) -> list[str]:
    """Return the colours of six drawn curves."""
    curves = [Curve(f"c{i}", [0.0, float(i)]) for i in range(6)]
    svg = plot_svg([0.0, 1.0], curves, 400, 300, theme="dark" if theme == "dark" else "light")
    return list(dict.fromkeys(re.findall(r'<path id="c\d"[^>]*stroke="(#\w{6})"', svg)))


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_curves_are_distinct_for_colour_blind_people(theme: str) -> None:
    drawn = colours(theme)
    assert len(drawn) == 6
    for cones, matrix in SEEN.items():
        for entry, other in itertools.combinations(drawn, 2):
            first, second = lab(np.array(matrix) @ light(entry)), lab(np.array(matrix) @ light(other))
            apart = np.linalg.norm(first - second)
            assert apart > 15, (cones, entry, other)


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_the_page_has_the_same_colours(theme: str) -> None:
    text = TOKENS.read_text(encoding="utf-8")
    dark, bright = text.split(':root[data-theme="light"]')
    expected = re.findall(r"--plot-\d: (#\w{6});", dark if theme == "dark" else bright)
    assert expected == colours(theme)
