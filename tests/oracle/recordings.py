"""Recordings of random carts and legs by time stepping in C (recordings.c), with what sensor, clock and logger do to
them. Nothing here is hopform's but the container that a fit takes.
"""

import ctypes
import os
import shlex
import subprocess
import tempfile
from dataclasses import astuple, dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

SOURCE = Path(__file__).with_name("recordings.c")


@dataclass(frozen=True)
class Rig:
    """The fields of the C struct, in SI units and A; held: stillness at first [s]."""

    mass: float
    k: float
    b: float
    f: float
    stribeck: float = 0.0
    speed: float = 1.0
    gamma: float = 0.0
    rest: float = 0.0
    drops: float = 0.0
    g: float = 0.0
    loss: float = 0.0
    start: float = 0.0
    held: float = 0.0
    delay: float = 0.0
    gain: float = 1.0
    clock: float = 1.0
    lag: float = 0.0


@cache
def _library() -> Any:
    folder = Path(tempfile.mkdtemp(prefix="recordings"))
    compiler = shlex.split(os.environ.get("CC", "cc"))
    flags = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared"]
    subprocess.run([*compiler, *flags, str(SOURCE), "-o", str(folder / "recordings.so"), "-lm"], check=True)
    return ctypes.CDLL(str(folder / "recordings.so"))


def simulate(rig: Rig, u: np.ndarray, rate: float) -> np.ndarray:
    """What is measured of a rig at a rate [Hz], a sample for each of the current [A]."""
    given, found = np.ascontiguousarray(u, dtype=float), np.empty(len(u))
    fields = (ctypes.c_double * 17)(*astuple(rig))
    address = ctypes.POINTER(ctypes.c_double)
    _library().record(
        fields, given.ctypes.data_as(address), len(given), ctypes.c_double(1.0 / rate), found.ctypes.data_as(address)
    )
    return found
