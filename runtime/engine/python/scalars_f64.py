# SPDX-License-Identifier: MIT-0
"""Real numbers of double precision as C has them: no error is raised, the answer is an infinity or NaN.

What looks at bits is written here as in the engine's kernels_real.h.
"""

import math
import struct
from typing import TypeAlias

Real: TypeAlias = float
REAL_SIZE = 8

_BITS, _REAL = struct.Struct("<Q"), struct.Struct("<d")


def div(a: float, b: float) -> float:
    """a/b."""
    if b:
        return a / b
    if math.isnan(a) or a == 0.0 or math.isnan(b):
        return math.nan
    return math.copysign(math.inf, a) * math.copysign(1.0, b)


def sqrt(x: float) -> float:
    return math.sqrt(x) if x >= 0.0 else math.nan


def whole(x: float) -> int:
    """A number without its fraction; the least of 32 bits for what is none."""
    return int(x) if abs(x) < 2147483648.0 else -2147483648


def real_of_bits(bits: int) -> float:
    """The number whose bits are these."""
    number: float = _REAL.unpack(_BITS.pack(bits))[0]
    return number


def bits_of_real(x: float) -> int:
    bits: int = _BITS.unpack(_REAL.pack(x))[0]
    return bits
