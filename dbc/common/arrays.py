"""Arrays by the type of their elements; shapes and units stand in docstrings.

F64, F32     floating-point numbers; C128 complex ones
I64, I32, I8     integers; U64, U32, U16, U8 unsigned: words, identifiers, payload bytes
Bool         masks
Index        positions in other arrays, as `np.flatnonzero` gives them
Floats, Ints    scalars or arrays of them, where a function takes both
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

F64: TypeAlias = NDArray[np.float64]
F32: TypeAlias = NDArray[np.float32]
C128: TypeAlias = NDArray[np.complex128]
I64: TypeAlias = NDArray[np.int64]
I32: TypeAlias = NDArray[np.int32]
I8: TypeAlias = NDArray[np.int8]
U64: TypeAlias = NDArray[np.uint64]
U32: TypeAlias = NDArray[np.uint32]
U16: TypeAlias = NDArray[np.uint16]
U8: TypeAlias = NDArray[np.uint8]
Bool: TypeAlias = NDArray[np.bool_]
Index: TypeAlias = NDArray[np.intp]
Floats: TypeAlias = float | np.floating[Any] | F64
Ints: TypeAlias = int | np.integer[Any] | I64
