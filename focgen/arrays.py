"""What arrays of numbers are called in signatures; their shapes stand in the docstrings.

``Array`` holds float64, as all physical quantities do. ``Numbers`` are those of a plan's arithmetic: floating
numbers of one or the other size, or counts; a ``Kind`` is the type of one of them.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.floating[Any]]
Complex: TypeAlias = NDArray[np.complexfloating[Any, Any]]
Ints: TypeAlias = NDArray[np.integer[Any]]
Bools: TypeAlias = NDArray[np.bool_]
Bytes: TypeAlias = NDArray[np.uint8]
Numbers: TypeAlias = NDArray[Any]
Kind: TypeAlias = type[Any]
