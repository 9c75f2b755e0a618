"""The type of a message's field that is an array: `Array[np.float32]`."""

from __future__ import annotations

from typing import Any, TypeAlias, TypeVar

import numpy as np

_Item = TypeVar("_Item", bound=np.generic)

Array: TypeAlias = np.ndarray[Any, np.dtype[_Item]]
"""Like numpy's `NDArray`. From numpy 2.5 on, `NDArray` is a `TypeAliasType`, which hides the class and the
type of the items from KBot's readers of type hints."""
