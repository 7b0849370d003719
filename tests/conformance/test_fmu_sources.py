"""The sources of an FMU: compilers find nothing to warn of, the sanitizers nothing in random calls, and zig makes libraries of
them for other platforms.
"""

import io
import shutil
import subprocess
import zipfile
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

import hopform
from hopform import _fmu
from tests import needs
from tests.conformance.firmware.targets import ROOT
from tests.conformance.test_c_programs import CHECKS
from tests.conformance.test_selftest import CC, COMPILERS
from tests.derived import SHIPPED, solver_of
from tests.objects import run_compiler
from tests.seeds import SEED

pytestmark = [needs.library, pytest.mark.sliced]
MODELS = ("joint", "servo", "hopper", "leg_damper")
WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Wpedantic", "-Wundef", "-Wvla", "-Werror")
DRIVER = ROOT / "tests" / "conformance" / "fmu_calls.c"
CALLS = 50_000
OWN = _fmu.this_platform()
zig = pytest.mark.skipif(find_spec("ziglang") is None, reason="ziglang is absent (`make venv-zig` installs it)")
FUNCTIONS = {
    "fmi3InstantiateCoSimulation", "fmi3DoStep", "fmi3UpdateDiscreteStates", "fmi3GetFloat64", "fmi3SetFloat64",
    "fmi3GetFMUState", "fmi3SerializeFMUState", "fmi3FreeInstance", "fmi3GetVersion", "fmi3InstantiateModelExchange",
}  # fmt: skip


@pytest.fixture
def sources(store, tmp_path) -> Callable[[str], Path]:
    """A folder with the sources of the FMU of a model."""

    def write(name: str) -> Path:
        made: Any = hopform.load_solver(name) if name == "hopper" else solver_of(store, SHIPPED / f"{name}.py")
        robot = made.load_robot("hopper_c") if "stance" in made.can else made.Robot()
        if name == "joint":
            robot = robot.with_parameters({"q_min": -0.5, "q_max": 0.8, "k": 2.0})
        if name == "leg_damper":
            robot = robot.with_parameters({"b12": 20.0})
        for path, text in _fmu.sources_of(robot, _fmu.variables_of(robot, frozenset())).items():
            file = tmp_path / name / path
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(f'#define TOKEN "{name}"\n{text}' if path == "model.h" else text, "utf-8")
        return tmp_path / name

    return write


@pytest.mark.parametrize("compiler", COMPILERS, ids=" ".join)
@pytest.mark.parametrize("name", needs.at_night(MODELS, "servo", "hopper"))
def test_compilers_find_nothing_to_warn_of(sources, compiler, name):
    folder = sources(name)
    include = ("-I", folder, "-I", folder / "include")
    run_compiler(*compiler, "-std=c99", "-O1", *WARNINGS, *include, "-c", folder / "fmi3.c", "-o", folder / "fmi3.o")


@pytest.mark.parametrize("name", needs.at_night(MODELS, "servo", "hopper"))
def test_random_calls_leave_nothing_for_the_sanitizers(sources, name):
    """Calls in any order with any numbers: two instances, states that are kept, set, packed and unpacked."""
    folder = sources(name)
    image, unit = folder / "calls", folder / "fmi3.c"
    text, cap = unit.read_text("utf-8"), "MOST_PHASES = 100000,"
    assert text.count(cap) == 1
    unit.write_text(
        text.replace(cap, "MOST_PHASES = 1000,"), "utf-8"
    )  # steps that meet it are of seconds, not of hours
    include = ("-I", folder, "-I", folder / "include")
    run_compiler(*CC, "-std=c99", "-ffp-contract=off", *CHECKS, *include, DRIVER, "-o", image, "-lm")
    for seed in range(SEED, SEED + 3):
        done = subprocess.run([image, str(CALLS), str(seed)], capture_output=True, text=True, check=False, timeout=300)
        assert done.returncode == 0, done.stdout + done.stderr
        words = done.stdout.split()
        counts = dict(zip(words[::2], map(int, words[1::2]), strict=True))
        assert counts["wrong"] == 0 and counts["refused"] > CALLS // 10 < counts["steps"], counts


def library_of(robot: Any, platform: str) -> bytes:
    with zipfile.ZipFile(io.BytesIO(_fmu.archive(robot, binaries=[platform]))) as file:
        return file.read(f"binaries/{platform}/{robot.solver.name}{_fmu.BINARIES[platform][1]}")


def names_of(library: bytes, at: Path, table: str) -> set[str]:
    """Names of a library that llvm-readobj lists."""
    at.write_bytes(library)
    said = subprocess.run(["llvm-readobj", table, at], capture_output=True, text=True, check=True).stdout
    return {
        word
        for line in said.splitlines()
        if line.strip().startswith("Name: ") and "Undefined" not in line
        for word in line.split()[1:2]
    }


reader = pytest.mark.skipif(
    not shutil.which("llvm-readobj"), reason="llvm-readobj is absent (on Debian: apt install llvm)"
)


@zig
@reader
@pytest.mark.parametrize(
    "platform", needs.at_night([*_fmu.BINARIES], "x86_64-linux", "x86_64-darwin", "aarch64-darwin")
)
def test_zig_makes_a_library_of_another_platform_that_exports_fmi_alone(hopper_c, tmp_path, platform):
    library = library_of(hopper_c, platform)
    begins = {"linux": b"\x7fELF", "windows": b"MZ", "darwin": b"\xcf\xfa\xed\xfe"}[platform.rpartition("-")[2]]
    assert library.startswith(begins)
    if begins == b"\x7fELF":
        assert int.from_bytes(library[18:20], "little") == {"x86_64": 62, "aarch64": 183}[platform.partition("-")[0]]
    table = "--coff-exports" if begins == b"MZ" else "--dyn-syms" if begins == b"\x7fELF" else "--symbols"
    names = {name.removeprefix("_") for name in names_of(library, tmp_path / "library", table)}
    assert names >= FUNCTIONS
    if begins != b"\xcf\xfa\xed\xfe":  # whose list has the private ones, too
        assert not [name for name in names if name.startswith("hopform")]


@pytest.mark.skipif(
    OWN not in ("x86_64-linux", "aarch64-linux") or not shutil.which("nm"),
    reason="nm lists what a library exports on Linux alone (on Debian: apt install binutils)",
)
def test_a_library_of_this_machine_exports_fmi_alone(hopper_c, tmp_path):
    (tmp_path / "library").write_bytes(library_of(hopper_c, str(OWN)))
    said = subprocess.run(
        ["nm", "-D", "--defined-only", tmp_path / "library"], capture_output=True, text=True, check=True
    )
    names = {line.split()[-1] for line in said.stdout.splitlines()}
    assert names >= FUNCTIONS and all(name.startswith("fmi3") for name in names)
