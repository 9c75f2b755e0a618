"""What every test may ask for: the shared reference data, when it is there."""

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of reference data: `KBOT_SHARED`, or `shared` beside the repository."""
    folder = Path(os.environ.get("KBOT_SHARED") or Path(__file__).parents[2] / "shared")
    if not folder.is_dir():
        pytest.skip(f"the reference data is not at {folder} (set KBOT_SHARED)")
    return folder
