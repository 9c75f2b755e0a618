"""Names of recordings on disk."""

from pathlib import Path

BAGS = (".bag", ".bag.active")
"""How bags of ROS 1 end; the latter while rosbag writes them, and after a kill."""


def is_recording(path: str) -> bool:
    """Whether a name is that of a recording, by its suffix or by what is in the folder."""
    folder = Path(path)
    return (
        path.endswith((".mcap", *BAGS))
        or (folder / "metadata.yaml").is_file()
        or (folder.is_dir() and any(folder.glob("*.db3")))
    )
