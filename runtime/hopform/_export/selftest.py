"""The digest that the C library's selftest returns: per precision the same on every board, compiler and computer."""

import ctypes

import numpy as np
from numpy.typing import DTypeLike

from hopform._checks import shown
from hopform._errors import HopformError
from hopform._solver import c as native

PHASES = 32


def selftest(dtype: DTypeLike = np.float32) -> int:
    """The 32-bit digest of all that `hopform_selftest` solves, by the library that Python loads: that of a board must
    be the same.

    dtype: float32 or float64. Raises BackendError without a library.

    >>> selftest("float32") == selftest("float64")
    False
    """
    wanted = np.dtype(dtype)
    if wanted not in (np.dtype(np.float32), np.dtype(np.float64)):
        raise HopformError(f"dtype must be float32 or float64, got {shown(dtype)}")
    library = native.library()
    types = library.types(wanted)
    search, phases = types.Search(), (types.Phase * PHASES)()
    prototype = ctypes.CFUNCTYPE(ctypes.c_uint32, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int32)
    digest: int = prototype(library.address(f"selftest_{types.suffix}"))(
        ctypes.addressof(search), ctypes.addressof(phases), PHASES
    )
    return digest
