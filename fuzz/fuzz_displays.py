"""Fuzzes the readers of display settings: .rviz files and KBot's own.

Any text either gives settings that can be written and read again, or one KbotError.
"""

from functools import partial

from choices import Choices
from edits import edited, real_files

from kbot.text import KbotError
from kbot.workbench.displays.display_file import DisplayFile
from kbot.workbench.protocol.codec import encode

RVIZ = b"""Panels:
  - Class: rviz_common/Displays
    Name: Displays
Visualization Manager:
  Class: ""
  Displays:
    - {Class: rviz_default_plugins/Grid, Name: Grid, Enabled: true, Cell Size: 1, Color: 160; 160; 164, Plane: XY,
       Offset: {X: 0, Y: 0, Z: 0}, Line Style: {Line Width: 0.03, Value: Lines}, Reference Frame: <Fixed Frame>}
    - Class: rviz_default_plugins/RobotModel
      Name: RobotModel
      Enabled: true
      Alpha: 1
      Description Topic: {Depth: 5, Value: /robot_description}
      Links: {All Links Enabled: true, base_link: {Alpha: 1, Show Axes: false, Value: true}}
    - {Class: rviz_default_plugins/LaserScan, Name: Scan, Topic: {Value: /scan}, Size (m): 0.01, Style: Flat Squares,
       Color Transformer: Intensity, Min Intensity: 0, Max Intensity: 100, Decay Time: 0}
    - {Class: rviz_common/Group, Name: Group, Displays: [{Class: rviz/TF, Name: TF, Frames: {All Enabled: true},
       Marker Scale: 1, Tree: {map: {odom: {}}}}]}
    - {Class: rviz_default_plugins/MarkerArray, Name: M, Topic: {Value: /m}, Namespaces: {a: true}}
    - {Class: rviz_default_plugins/Camera, Name: C, Topic: {Value: /i}, Visibility: {Grid: true, Value: true}}
    - {Class: rviz_default_plugins/Map, Name: Map, Topic: {Value: /map}, Color Scheme: map, Alpha: 0.7}
    - {Class: rviz_default_plugins/Odometry, Name: O, Topic: {Value: /odom}, Shape: {Value: Arrow, Color: 255; 0; 0}}
  Global Options: {Background Color: 48; 48; 48, Fixed Frame: odom, Frame Rate: 30}
  Tools:
    - Class: rviz_default_plugins/MoveCamera
  Views:
    Current: {Class: rviz_default_plugins/Orbit, Distance: 10, Focal Point: {X: 0, Y: 0, Z: 0}, Pitch: 0.78, Yaw: 0.78,
              Target Frame: <Fixed Frame>}
    Saved: ~
"""
OWN = b"""globals: {frame: odom, background: '#303030', rate: 30}
displays:
- {kind: Grid, name: Grid, enabled: true, cell: 1.0}
- {kind: RobotModel, name: Robot}
- {kind: LaserScan, topic: /scan, size: 0.01}
view: {kind: orbit, distance: 3.0}
"""
WORDS = [
    b"&a ", b"*a", b"<<: *a", b"? ", b"- ", b"!!int ", b"!!float ", b"!!binary ", b"!!set ", b"~", b"[", b"{", b"}", b"]",
    b"Class: rviz/Grid", b"Class: rviz_common/Group", b"Displays: ", b"Value: ", b"Topic: ", b"255; 0; 0", b"1; 2", b"nan",
]  # fmt: skip


SEEDS = {"a.rviz": [RVIZ, *real_files(".rviz", ".rviz.in")], "a.kbot.yaml": [OWN]}


def one_input(name: str, choices: Choices) -> None:
    text = edited(choices, SEEDS[name], WORDS).decode("utf-8", "replace")
    file = DisplayFile()
    try:
        found = file.open(name, text)
    except KbotError:
        return
    encode(found)
    for kind in ("kbot", "rviz1", "rviz2"):
        written = file.save(kind, found.setup, "odom")
        DisplayFile().open("b.kbot.yaml" if kind == "kbot" else "b.rviz", written.text)


TARGETS = {"rviz": partial(one_input, "a.rviz"), "displays": partial(one_input, "a.kbot.yaml")}
