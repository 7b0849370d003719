"""What MSVC is given: C11 without an extension of GNU C, and the loops that stand in where one is used elsewhere.

There is no MSVC here. clang compiles for its targets, with its extensions and without those of GNU C; the headers of C
that it lacks there are declared in the test.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from hopform._solver.build import source_of
from tests import needs
from tests.conformance.firmware.targets import ROOT, C

clang = pytest.mark.skipif(not shutil.which("clang"), reason="clang is absent (on Debian: apt install clang)")
pytestmark = clang

PLAIN = ("clang", "-fgnuc-version=0", "-std=c11", "-pedantic-errors", "-ffp-contract=off", f"-I{C / 'include'}")
STRICT = ("-Werror", "-Wall", "-Wvla", "-Wgnu", "-Wmicrosoft", "-Wno-bitwise-instead-of-logical")
MSVC = ("-fms-extensions", "-fms-compatibility", "-fms-compatibility-version=19.30", "-ffreestanding", "-fsyntax-only")
TARGETS = {"x64": ("x86_64",), "arm64": ("aarch64",), "x86": ("i686", "-msse2")}

SELFTEST = "tests/conformance/test_selftest.py"
DIGEST = "test_the_library_of_python_returns_the_digest_of_every_compiler"

UNARY = ["sqrt", "fabs", "exp", "expm1", "sin", "cos", "log", "cbrt"]
HEADERS = {
    "math.h": "\n".join(
        [*(f"double {name}(double);\nfloat {name}f(float);" for name in UNARY)]
        + ["double atan2(double, double);\nfloat atan2f(float, float);"]
        + ["#define INFINITY ((float)(1e300 * 1e300))", "#define NAN (-(float)(INFINITY * 0.0F))", ""]
    ),
    "fenv.h": "typedef struct { unsigned int flags; } fenv_t;\n"
    "int fegetenv(fenv_t *);\nint fesetenv(const fenv_t *);\n",
    "string.h": "#include <stddef.h>\nvoid *memcpy(void *, const void *, size_t);\nvoid *memset(void *, int, size_t);\n"
    "void *memmove(void *, const void *, size_t);\nint memcmp(const void *, const void *, size_t);\n",
}


def compiled_for(target: str, folder: Path, *what: str | Path) -> subprocess.CompletedProcess[str]:
    for name, text in HEADERS.items():
        (folder / name).write_text(text, "utf-8")
    processor, *flags = TARGETS[target]
    command = [*PLAIN, *STRICT, *MSVC, f"--target={processor}-pc-windows-msvc", *flags, "-isystem", folder, *what]
    return subprocess.run([*map(str, command)], capture_output=True, text=True, check=False)


@pytest.mark.parametrize("target", TARGETS)
def test_the_library_is_c11_for_the_targets_of_msvc(tmp_path, target):
    done = compiled_for(target, tmp_path, *sorted((C / "src").glob("*.c")))
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(
    ("flags", "why"), [(("-D_M_FP_FAST=1",), "NaN"), (("-U__FLT_EVAL_METHOD__", "-mno-sse2"), "FLT_EVAL_METHOD")]
)
def test_flags_of_msvc_that_change_results_are_refused(tmp_path, flags, why):
    done = compiled_for("x86", tmp_path, *flags, C / "src" / "version.c")
    assert done.returncode != 0
    assert 'error: "hopform' in done.stderr and why in done.stderr


@needs.library
@pytest.mark.nightly
def test_without_extensions_batches_and_grids_have_the_same_bits(tmp_path):
    library = tmp_path / "plain.so"
    source = f'-DHOPFORM_SOURCE="{source_of(C.parent)}"'
    sources = (C / "src").glob("*.c")
    subprocess.run([*PLAIN, "-O1", "-fPIC", "-shared", source, *sources, "-lm", "-o", library], check=True)
    tests = ["tests/unit/test_batch.py", "tests/unit/test_grid.py", f"{SELFTEST}::{DIGEST}"]
    command = [sys.executable, "-m", "pytest", "-q", "-p", "tests.other_library", "-p", "no:cacheprovider", *tests]
    environment = os.environ | {"HOPFORM_OTHER_LIBRARY": str(library)}
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT, env=environment)
    assert done.returncode == 0, done.stdout
