"""Names of recordings on disk."""

from pathlib import Path

BAGS = (".bag", ".bag.active")
"""Suffixes of ROS 1 bags. rosbag uses the second until it closes the bag."""


def is_recording(path: str) -> bool:
    """Whether a path names a recording, by its suffix or by the files in the folder."""
    folder = Path(path)
    return (
        path.endswith((".mcap", *BAGS))
        or (folder / "metadata.yaml").is_file()
        or (folder.is_dir() and any(folder.glob("*.db3")))
    )
