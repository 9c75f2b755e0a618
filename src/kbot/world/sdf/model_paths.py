"""The folders of models: KBot's, Gazebo's, and Gazebo's downloads."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

LIBRARY = Path(__file__).parents[1] / "models"
"""The models that ship with KBot."""

PATH_VARIABLES = ("GAZEBO_MODEL_PATH", "GZ_SIM_RESOURCE_PATH", "IGN_GAZEBO_RESOURCE_PATH", "SDF_PATH")
FUEL_STORES = (".gz/fuel/fuel.gazebosim.org", ".ignition/fuel/fuel.ignitionrobotics.org")
CLASSIC_STORE = ".gazebo/models"


def model_paths() -> Iterator[Path]:
    """The folders in Gazebo's environment variables, and the one of Gazebo Classic's downloads."""
    for variable in PATH_VARIABLES:
        yield from (Path(entry) for entry in os.environ.get(variable, "").split(os.pathsep) if entry)
    yield Path.home() / CLASSIC_STORE


def fuel_stores() -> Iterator[Path]:
    """The folders in which Gazebo keeps downloads from Fuel."""
    return (Path.home() / store for store in FUEL_STORES)
