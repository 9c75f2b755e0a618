"""The documented parameters of goals without a map are those of the code."""

import re
from dataclasses import MISSING, fields, replace
from pathlib import Path

import pytest

from kbot.navigation.simulated.motion_limits import MotionLimits
from kbot.navigation.space.footprint import Outline
from kbot.navigation.without_map.local_navigator import LocalNavigator, LocalSettings
from kbot.navigation.without_map.trajectory_sampling import SamplingSettings

PAGE = Path(__file__).parents[3] / "docs" / "reference" / "navigation.md"
ROW = re.compile(r"^\| `(\w+)` \| ([\d.]+) \|", re.MULTILINE)


def _documented(title):
    text = PAGE.read_text()
    table = text[text.index(title) :].split("\n\n")[1]
    return {name: float(value) for name, value in ROW.findall(table)}


@pytest.mark.parametrize("settings", [LocalSettings, SamplingSettings])
def test_each_parameter_is_documented_with_its_default(settings):
    defaults = {entry.name: entry.default for entry in fields(settings) if entry.default is not MISSING}
    assert _documented(f"`{settings.__name__}`") == defaults


def test_the_samples_can_be_set():
    sampling = replace(SamplingSettings(), batch_size=50)
    settings = LocalSettings(sampling=sampling, margin=0.1)
    outline = Outline.rectangle(-0.2, 0.2, -0.2, 0.2)
    navigator = LocalNavigator(outline, MotionLimits(1.0, 1.0), 20.0, settings)
    assert navigator.sampling.batch_size == 50
    assert navigator.sampling.margin > 0.1  # and half a cell
