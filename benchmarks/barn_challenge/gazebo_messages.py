"""Generates the part of the Python package gazebo_msgs that the challenge imports. Debian does not have it.

python3 gazebo_messages.py FOLDER
"""

import sys
from pathlib import Path

from genpy import generator
from geometry_msgs.msg import Point, Pose, Quaternion, Twist, Vector3
from std_msgs.msg import Header

USED = (Header, Point, Pose, Quaternion, Twist, Vector3)
"""Types in the definitions below. Debian has them as Python classes with their text."""
DEFINITIONS = {
    "msg/ModelState.msg": "string model_name\ngeometry_msgs/Pose pose\ngeometry_msgs/Twist twist\n"
    "string reference_frame\n",
    "srv/SetModelState.srv": "gazebo_msgs/ModelState model_state\n---\nbool success\nstring status_message\n",
    "srv/GetModelState.srv": "string model_name\nstring relative_entity_name\n---\nHeader header\n"
    "geometry_msgs/Pose pose\ngeometry_msgs/Twist twist\nbool success\nstring status_message\n",
}
GENERATORS = {"msg": generator.MsgGenerator, "srv": generator.SrvGenerator}


def main(folder: Path) -> None:
    package = folder / "gazebo_msgs"
    search = {"gazebo_msgs": [str(package / "msg")]}
    for used in USED:
        home, name = used._type.split("/")
        texts = package / "used" / home
        texts.mkdir(parents=True, exist_ok=True)
        (texts / f"{name}.msg").write_text(used._full_text.partition("=" * 80)[0])
        search[home] = [str(texts)]
    for kind, make in GENERATORS.items():
        files = []
        for name, text in DEFINITIONS.items():
            if name.startswith(kind):
                file = package / name
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_text(text)
                files.append(str(file))
        if make().generate_messages("gazebo_msgs", files, str(package / kind), search):
            sys.exit(1)
        modules = [Path(file).stem for file in files]
        lines = [f"from ._{module} import *" for module in modules]
        (package / kind / "__init__.py").write_text("\n".join(lines) + "\n")
    (package / "__init__.py").write_text("")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
