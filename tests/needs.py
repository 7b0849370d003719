"""What some tests need and a bare machine may lack. A skipped test prints why; in CI it fails."""

import shutil
from collections.abc import Sequence
from importlib.util import find_spec
from sysconfig import get_platform

import pytest

import hopform

MESSAGE = hopform.library_message()
library = pytest.mark.skipif(
    MESSAGE is not None,
    reason=f"there is no library: {MESSAGE} (`make test` builds it)",
)
jax = pytest.mark.skipif(find_spec("jax") is None, reason="JAX is absent (`make venv-jax` installs it)")
cpp = pytest.mark.skipif(
    shutil.which("c++") is None,
    reason="a C++ compiler is absent, and headers cannot be tried in C++ (on Debian: apt install g++)",
)
cortex_m = pytest.mark.skipif(
    not (shutil.which("arm-none-eabi-gcc") and shutil.which("qemu-system-arm")),
    reason="no Cortex-M can be emulated (on Debian: apt install gcc-arm-none-eabi libnewlib-arm-none-eabi "
    "qemu-system-arm)",
)


fmus = pytest.mark.skipif(
    find_spec("fmpy") is None or find_spec("pythonfmu3") is None or get_platform() not in ("linux-x86_64", "win-amd64"),
    reason="FMPy or PythonFMU3 is absent, or has no library for this machine",
)


mujoco = pytest.mark.skipif(find_spec("mujoco") is None, reason="mujoco is absent, which is another simulator")


def sliced(*parameters: tuple[object, ...]) -> list:
    """Parameters that are tried with `make test-slices`, a tuple for each call."""
    return [pytest.param(*each, marks=pytest.mark.sliced) for each in parameters]


def at_night(values: Sequence[str], *others: str) -> list:
    """Parameters of a slow test of which these others are tried at night alone."""
    return [pytest.param(each, marks=pytest.mark.nightly) if each in others else each for each in values]


def the_first(values: Sequence[object], count: int = 1) -> list:
    """Parameters of a slow test: the first always, the others with `make test-slices`."""
    return [*values[:count], *sliced(*((value,) for value in values[count:]))]
