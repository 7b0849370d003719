"""The cube root of the C library against whole numbers, in every octave; and that no libm is left."""

import ctypes
import os
import random
import shutil
import subprocess
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from derive.emit.facts import FLAGS
from tests.needs import the_first

C = Path(__file__).resolve().parents[2] / "generated" / "c"
SOURCE = """
#include "kernels_f32.h"
#include "kernels_f64.h"

void roots_f32(const float *x, float *y, int32_t count)
{
    for (int32_t i = 0; i < count; i++) {
        y[i] = cube_root_f32(x[i]);
    }
}

void roots_f64(const double *x, double *y, int32_t count)
{
    for (int32_t i = 0; i < count; i++) {
        y[i] = cube_root_f64(x[i]);
    }
}

/* Largest error in units of the last digit over the floats with these bits, times 1e6; cbrt in double is the judge. */
double worst_f32(uint32_t first, uint32_t last)
{
    double worst = 0.0;
    for (uint32_t bits = first; bits <= last; bits++) {
        const float x = real_of_bits_f32(bits);
        const float y = cube_root_f32(x);
        const double unit = ldexp(1.0, ilogb(y) - 23);
        const double error = fabs((double)y - cbrt((double)x)) / unit;
        worst = error > worst ? error : worst;
    }
    return worst;
}
"""
COMPILERS = [name for name in ("gcc", "clang") if shutil.which(name)] or [os.environ.get("CC", "cc")]


@cache
def compiled(compiler: str, level: str, folder: Path) -> Any:
    source, target = folder / "roots.c", folder / f"roots_{Path(compiler).name}{level}.so"
    source.write_text(SOURCE, "utf-8")
    flags = [level if flag == "-O2" else flag for flag in FLAGS]
    command = [compiler, *flags, "-I", C / "include", "-I", C / "src", source, "-o", target, "-lm"]
    subprocess.run(command, check=True)
    library = ctypes.CDLL(str(target))
    library.worst_f32.restype = ctypes.c_double
    return library


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("roots")


def roots(library: Any, x: np.ndarray) -> np.ndarray:
    y = np.empty_like(x)
    call = library.roots_f32 if x.dtype == np.float32 else library.roots_f64
    call(ctypes.c_void_p(x.ctypes.data), ctypes.c_void_p(y.ctypes.data), ctypes.c_int32(x.size))
    return y


def worst_of_octaves(library: Any, first: int, last: int) -> float:
    return float(library.worst_f32(ctypes.c_uint32(first), ctypes.c_uint32(last)))


@pytest.mark.sliced
def test_every_float_of_three_octaves_and_every_subnormal_is_within_two_thirds_of_the_last_digit(folder):
    """Three octaves hold every fraction with every remainder of the exponent; a factor of 8 only moves the exponent."""
    library = compiled(COMPILERS[0], "-O2", folder)
    assert 0.5 < worst_of_octaves(library, 127 << 23, (130 << 23) - 1) < 0.67
    assert worst_of_octaves(library, 1, (1 << 23) - 1) < 0.67


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_factor_of_8_moves_the_exponent_alone(folder, dtype):
    library, draw = compiled(COMPILERS[0], "-O2", folder), random.Random(3)
    near = np.array([draw.uniform(1.0, 8.0) for _ in range(200)], dtype)
    low, high = (-126, 127) if dtype == np.float32 else (-1022, 1023)
    for power in range(-(-low // 3), high // 3 - 1):
        scaled = roots(library, near * dtype(2.0) ** dtype(3 * power))
        np.testing.assert_array_equal(scaled, roots(library, near) * dtype(2.0) ** dtype(power))


def error_in_last_digits(x: float, y: float) -> float:
    """|y - x^(1/3)| over the distance of doubles at y, from y^3 - x in whole numbers."""
    root = Fraction(y)
    return float(abs(root**3 - Fraction(x)) / (3 * root**2 * Fraction(float(np.spacing(y)))))


def test_doubles_of_any_size_are_within_two_thirds_of_the_last_digit(folder):
    library, draw = compiled(COMPILERS[0], "-O2", folder), random.Random()
    seed = draw.randrange(2**32)
    draw.seed(seed)
    exact = [float(n**3) for n in range(1, 300)]
    edges = [5e-324, 2.0**-1022, np.nextafter(2.0**-1022, 0.0), np.finfo(float).max, 1.0, np.nextafter(1.0, 0.0)]
    drawn = [draw.uniform(1.0, 2.0) * 2.0 ** draw.randint(-1022, 1023) for _ in range(10_000)]
    close = [draw.uniform(1.0, 8.0) for _ in range(10_000)]
    small = [draw.randrange(1, 2**52) * 5e-324 for _ in range(2_000)]
    x = np.array([*exact, *edges, *drawn, *close, *small])
    errors = [error_in_last_digits(*each) for each in zip(x.tolist(), roots(library, x).tolist(), strict=True)]
    assert 0.5 < max(errors) < 0.67, f"seed {seed}"
    assert errors[: len(exact)] == [0.0] * len(exact)


def test_what_has_no_positive_root_has_the_root_zero(folder):
    library = compiled(COMPILERS[0], "-O2", folder)
    for dtype in (np.float32, np.float64):
        x = np.array([0.0, -0.0, -1.0, np.nan, -np.inf], dtype)
        np.testing.assert_array_equal(roots(library, x), np.zeros(5))


def test_every_compiler_and_level_gives_the_same_bits(folder):
    draw = np.random.default_rng(7)
    for dtype in (np.float32, np.float64):
        x = np.exp(draw.uniform(-80.0, 80.0, 100_000)).astype(dtype)
        seen = {
            roots(compiled(name, level, folder), x).tobytes() for name in COMPILERS for level in ("-O0", "-O2", "-O3")
        }
        assert len(seen) == 1


def test_the_error_is_measured(folder):
    """The measure itself: a root that is one digit off counts as about one."""
    y = roots(compiled(COMPILERS[0], "-O2", folder), np.array([2.0]))[0]
    assert 0.33 < error_in_last_digits(2.0, float(np.nextafter(y, 2.0))) < 1.67
    assert error_in_last_digits(8.0, float(np.nextafter(2.0, 3.0))) == pytest.approx(1.0, rel=1e-15)


# ---- what is left of libm ----


def needed(compiler: str, source: Path, target: Path, *flags: str) -> set[str]:
    """What an object of the library wants from elsewhere, memory functions, the linker's table and the library itself
    left out.
    """
    command = [compiler, "-std=c99", "-ffp-contract=off", *flags, "-I", C / "include", "-c", source, "-o", target]
    subprocess.run(command, check=True)
    listing = subprocess.run(["nm", "-u", target], capture_output=True, text=True, check=True).stdout
    names = {line.split()[-1] for line in listing.splitlines()}
    own = {"memcpy", "memset", "memmove", "_GLOBAL_OFFSET_TABLE_"}
    return {name for name in names - own if not name.startswith("hopform_")}


def asks(source: Path) -> set[str]:
    """What a compiler makes of asking the processor what it has."""
    return {"__cpu_model", "__cpu_indicator_init"} if source.name.startswith("hopform_") else set()


@pytest.mark.sliced
@pytest.mark.parametrize("compiler", the_first(COMPILERS))
def test_the_library_needs_no_libm(tmp_path, compiler):
    """As the README says: optimised, with -fno-math-errno, a square root is an instruction;
    else it is the one function left.

    Batches, which are for workstations, keep the processor's flags; a grid asks what it has, where it may.
    """
    of_many = {path for name in ("batch", "flights", "hops") for path in (C / "src").glob(f"{name}_*")}
    for source in sorted(set((C / "src").glob("*.c")) - of_many):
        portable = "-DHOPFORM_PORTABLE"
        assert needed(compiler, source, tmp_path / "one.o", "-Os", "-fno-math-errno", portable) == set(), source.name
        assert needed(compiler, source, tmp_path / "one.o", "-O0") <= {"sqrt", "sqrtf"} | asks(source), source.name
