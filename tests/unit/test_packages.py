"""Exported packages, as compilers and build systems take them."""

import os
import re
import shlex
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from hopform._export import Wanted, amalgamated, export, sources

CC = shlex.split(os.environ.get("CC") or "cc")
HOST = ["-Os", "-march=native"]
MAIN = """#include <stdio.h>
#include "hopform/hopform.h"
int main(void)
{
"""
PRINTED = """
    static hopform_search_real search_real;
    static hopform_phase_real phases_real[HOPFORM_SELFTEST_PHASES];
    printf("%08x\\n", (unsigned)hopform_selftest_real(&search_real, phases_real, HOPFORM_SELFTEST_PHASES));
"""
BOTH = ("f32", "f64")
DTYPES = {"f32": "float32", "f64": "float64"}


def run(*command: str | Path, cwd: Path) -> str:
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


class Package:
    """An exported package, and a folder in which a program is built with it."""

    def __init__(self, folder: Path, system: str, precisions: tuple[str, ...]) -> None:
        self.root, self.folder, self.precisions = folder / "package", folder, precisions
        export(self.root, Wanted(system, precisions=precisions))
        printed = "".join(PRINTED.replace("real", each) for each in precisions)
        (folder / "main.c").write_text(f"{MAIN}{printed}    return 0;\n}}\n", "utf-8")

    def compiled(self, flags: list[str], files: list[Path], include: Path) -> Path:
        """A program of sources that are compiled with flags."""
        where = ["-I", str(include)]
        for file in files:
            run(*CC, *HOST, *flags, *where, "-c", file, "-o", f"{file.stem}.o", cwd=self.folder)
        objects = [f"{file.stem}.o" for file in files]
        run(*CC, *where, "main.c", *objects, "-o", "app", "-lm", cwd=self.folder)
        return self.folder / "app"

    def configured(self, project: str, *settings: str, flags: Sequence[str] = HOST) -> Path:
        """A program of a CMake project; flags: of the user."""
        cmake = shutil.which("cmake")
        assert cmake is not None, "cmake is not installed"
        (self.folder / "CMakeLists.txt").write_text(project, "utf-8")
        shutil.rmtree(self.folder / "build", ignore_errors=True)
        host = [f"-DCMAKE_C_FLAGS={' '.join(flags)}", f"-DCMAKE_C_COMPILER={CC[0]}", f"-DPACKAGE={self.root}"]
        run(cmake, "-S", ".", "-B", "build", *host, *settings, cwd=self.folder)
        run(cmake, "--build", "build", cwd=self.folder)
        return self.folder / "build" / "app"


def sources_in(folder: Path) -> list[Path]:
    return sorted(folder.glob("*.c"))


# ---- a double of 4 bytes, as on AVR ----

SHORT = [f"{flag}__DBL_{name}" for name in ("MANT_DIG__", "MAX_EXP__") for flag in ("-U", "-D")]
SHORT[1], SHORT[3] = f"{SHORT[1]}=24", f"{SHORT[3]}=128"


def refused(folder: Path, *arguments: str | Path) -> list[str]:
    """The errors of a compiler whose double is a float."""
    command = [*CC, "-std=c99", *SHORT, "-fsyntax-only", *arguments]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    return re.findall(r"error: (?:#error )?(.*)", done.stderr)


def test_double_precision_is_refused_where_a_double_has_4_bytes(tmp_path):
    root = Package(tmp_path, "plain", BOTH).root
    for file in sources_in(root / "src"):
        errors = refused(tmp_path, "-I", root / "include", file)
        if "f64" in file.name:
            assert errors[0].strip('"').startswith("hopform_f64 needs a double of 64 bits"), file
        else:
            assert not errors, file
    errors = refused(tmp_path, root / "amalgamated" / "hopform.c")
    assert errors[0].strip('"').startswith("hopform_f64 needs a double of 64 bits")


def test_single_precision_alone_needs_no_double_of_8_bytes(tmp_path):
    for name, text in amalgamated(sources(Wanted(precisions=("f32",))), "hopform").items():
        (tmp_path / name).write_text(text, "utf-8")
    assert refused(tmp_path, "hopform.c") == []


def test_arduino_is_offered_the_package_for_processors_with_a_double_of_8_bytes(tmp_path):
    lines = (Package(tmp_path, "arduino", BOTH).root / "library.properties").read_text("utf-8").splitlines()
    offered = set(dict(line.split("=", 1) for line in lines)["architectures"].split(","))
    assert {"samd", "stm32", "esp32", "rp2040"} <= offered
    assert not {"*", "avr", "megaavr"} & offered
