"""Views of rviz as an eye and a target."""

import math

import numpy as np
import pytest
import yaml

from kbot.workbench.displays.display_settings import DisplaySettings, View, read_settings, write_settings
from kbot.workbench.displays.rviz import read_rviz, write_rviz

from .rviz_texts import RVIZ1


def test_an_orbit_view_becomes_an_eye_and_a_target() -> None:
    view = read_rviz(RVIZ1, "robot.rviz").settings.view
    assert view is not None
    # 2 m away from (1, 0, 0), towards y, 0.5 rad above
    assert np.allclose(view.eye, (1.0, 2.0 * math.cos(0.5), 2.0 * math.sin(0.5)), atol=1e-6)
    assert view.target == (1.0, 0.0, 0.0)
    assert not view.flat


@pytest.mark.parametrize(
    ("kind", "eye"),
    [
        ("FPS", (1.0, 2.0, 0.5)),
        ("ThirdPersonFollower", (3.0, 0.0, 0.0)),
        ("XYOrbit", (3.0, 0.0, 0.0)),
    ],
)
def test_other_rviz_views_are_read(kind: str, eye: tuple[float, float, float]) -> None:
    text = f"""\
Visualization Manager:
  Views:
    Current:
      Class: rviz/{kind}
      Distance: 3
      Focal Point: {{X: 0, Y: 0, Z: 0}}
      Position: {{X: 1, Y: 2, Z: 0.5}}
      Pitch: 0
      Yaw: 0
"""
    view = read_rviz(text, "a.rviz").settings.view
    assert view is not None
    assert np.allclose(view.eye, eye)
    assert view.follow == (kind == "ThirdPersonFollower")
    if kind == "FPS":
        assert np.allclose(view.target, (2.0, 2.0, 0.5))  # it looks ahead, along x
    again = yaml.safe_load(write_rviz(DisplaySettings({}, (), view), read_rviz(text, "a.rviz").document))
    assert read_rviz(yaml.safe_dump(again), "b.rviz").settings.view == View(
        tuple(round(v, 6) for v in view.eye),
        view.target,
        view.flat,
        view.follow,
    )


def test_a_view_is_relative_to_its_target_frame() -> None:
    """As in rviz, the focal point is in that frame and moves with it."""
    text = """\
Visualization Manager:
  Views:
    Current:
      Class: rviz_default_plugins/Orbit
      Distance: 2
      Focal Point: {X: 0.5, Y: 0, Z: 0}
      Pitch: 0
      Yaw: 0
      Target Frame: base_link
"""
    found = read_rviz(text, "a.rviz")
    assert found.settings.view == View((2.5, 0.0, 0.0), (0.5, 0.0, 0.0), follow=True, frame="base_link")
    kept = write_settings(found.settings)
    assert read_settings(kept, "a.kbot.yaml").view == found.settings.view

    def written(view: View) -> str:
        current = yaml.safe_load(write_rviz(DisplaySettings({}, (), view), found.document))
        return str(current["Visualization Manager"]["Views"]["Current"]["Target Frame"])

    eye, at = (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    assert written(View(eye, at, follow=True, frame="gripper")) == "gripper"
    assert written(View(eye, at, follow=False)) == "<Fixed Frame>"
