# SPDX-License-Identifier: MIT-0
"""Real numbers of single precision, those of NumPy. Whoever calls the engine silences their warnings, by np.errstate.

What looks at bits is written here as in the engine's kernels_real.h.
"""

import struct
from typing import Any, TypeAlias

import numpy as np

Real: TypeAlias = Any
REAL_SIZE = 4
real: Any = np.float32
sqrt: Any = np.sqrt
ZERO: Any = real(0.0)

_BITS, _REAL = struct.Struct("<I"), struct.Struct("<f")


def whole(x: Any) -> int:
    """A number without its fraction; the least of 32 bits for what is none."""
    return int(x) if abs(x) < 2147483648.0 else -2147483648


def real_of_bits(bits: int) -> Any:
    """The number whose bits are these."""
    return real(_REAL.unpack(_BITS.pack(bits))[0])


def bits_of_real(x: Any) -> int:
    bits: int = _BITS.unpack(x.tobytes())[0]
    return bits
