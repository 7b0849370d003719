"""Exported packages, each built with the flags of its own build system, compute the bits that the manuals promise.

CMake reads its own file, and those of Zephyr and ESP-IDF over stand-ins for their commands. The processor is this one
with all it has: where it multiplies and adds in one rounding, a library whose flags allow that has another digest.
"""

import json
import os
import re
import shlex
import shutil
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path
from xml.etree import ElementTree

import pytest

from hopform._export import SYSTEMS, Wanted, amalgamated, export, selftest, sources
from tests import needs

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


# ---- what each build system does with a package ----

APP = "add_executable(app main.c)\ntarget_link_libraries(app PRIVATE hopform m)\n"
CMAKE = 'cmake_minimum_required(VERSION 3.16)\nproject(app LANGUAGES C)\nadd_subdirectory("${PACKAGE}" hopform)\n' + APP
ZEPHYR = """cmake_minimum_required(VERSION 3.16)
project(app LANGUAGES C)
macro(zephyr_include_directories)
  include_directories(${ARGN})
  set_property(GLOBAL PROPERTY INCLUDED ${CMAKE_CURRENT_SOURCE_DIR}/${ARGN})
endmacro()
macro(zephyr_library_named name)
  add_library(${name} STATIC)
  set(LIBRARY ${name})
endmacro()
macro(zephyr_library_compile_options)
  target_compile_options(${LIBRARY} PRIVATE ${ARGN})
endmacro()
macro(zephyr_library_compile_definitions_ifdef feature)
  if(${feature})
    target_compile_definitions(${LIBRARY} PRIVATE ${ARGN})
  endif()
endmacro()
macro(zephyr_library_sources)
  target_sources(${LIBRARY} PRIVATE ${ARGN})
endmacro()
add_subdirectory("${PACKAGE}/zephyr" hopform)
get_property(INCLUDED GLOBAL PROPERTY INCLUDED)
include_directories(${INCLUDED})
""" + APP  # fmt: skip
ESP_IDF = """cmake_minimum_required(VERSION 3.16)
project(app LANGUAGES C)
macro(idf_component_register)
  cmake_parse_arguments(GIVEN "" "" "SRCS;INCLUDE_DIRS" ${ARGN})
  add_library(hopform STATIC ${GIVEN_SRCS})
  target_include_directories(hopform PUBLIC ${GIVEN_INCLUDE_DIRS})
  set(COMPONENT_LIB hopform)
endmacro()
add_subdirectory("${PACKAGE}" hopform)
""" + APP  # fmt: skip


def by_hand(package: Package) -> Path:
    """With the line of the README."""
    readme = (package.root / "README.md").read_text("utf-8")
    (flags,) = re.findall(r"Compile `src/\*\.c` with `([^`]+)`", readme)
    return package.compiled(flags.split(), sources_in(package.root / "src"), package.root / "include")


def by_cmake(package: Package, *settings: str, flags: Sequence[str] = HOST) -> Path:
    return package.configured(CMAKE, *settings, flags=flags)


def by_arduino(package: Package) -> Path:
    """With what a core gives every library; library.properties has no word for flags."""
    flags = ["-std=gnu11", "-DARDUINO=10819"]
    return package.compiled(flags, sources_in(package.root / "src"), package.root / "src")


def by_platformio(package: Package) -> Path:
    build = json.loads((package.root / "library.json").read_text("utf-8"))["build"]
    return package.compiled(
        build["flags"], sources_in(package.root / build["srcDir"]), package.root / build["includeDir"]
    )


def by_zephyr(package: Package, *options: str, flags: Sequence[str] = HOST) -> Path:
    """With the settings of the sample and these options of Kconfig, which must be some of the module's."""
    kconfig = re.findall(r"^config (\w+)$", (package.root / "zephyr" / "Kconfig").read_text("utf-8"), re.MULTILINE)
    sample = (package.root / "samples" / "stance" / "prj.conf").read_text("utf-8")
    given = [*re.findall(r"^CONFIG_(\w+)=y$", sample, re.MULTILINE), *options]
    settings = (f"-DCONFIG_{name}=y" for name in given if name in kconfig)
    return package.configured(ZEPHYR, *settings, flags=flags)


def by_esp_idf(package: Package) -> Path:
    return package.configured(ESP_IDF)


def by_cmsis_pack(package: Package) -> Path:
    """With what CMSIS tools define for every pack; a description has no word for flags."""
    (description,) = package.root.glob("*.pdsc")
    files = [(each.get("category"), str(each.get("name"))) for each in ElementTree.parse(description).iter("file")]
    (include,) = [package.root / name for category, name in files if category == "include"]
    written = [package.root / name for category, name in files if category == "source"]
    return package.compiled(["-D_RTE_"], written, include)


BUILDS: dict[str, Callable[[Package], Path]] = {
    "plain": by_hand, "cmake": by_cmake, "arduino": by_arduino, "platformio": by_platformio, "zephyr": by_zephyr,
    "esp-idf": by_esp_idf, "cmsis-pack": by_cmsis_pack,
}  # fmt: skip


def digests(precisions: tuple[str, ...]) -> list[str]:
    return [f"{selftest(DTYPES[each]):08x}" for each in precisions]


QUICK = {"cmake", "arduino"}
CASES = [
    pytest.param(system, precisions, marks=() if quick else pytest.mark.sliced, id=f"{system}-{'+'.join(precisions)}")
    for system in SYSTEMS
    for precisions, quick in ((("f32",), system in QUICK), (BOTH, False))
]


@pytest.mark.sliced
@pytest.mark.parametrize(("system", "precisions"), CASES)
def test_a_package_that_is_built_with_its_own_flags_has_the_digests(tmp_path, system, precisions):
    package = Package(tmp_path, system, precisions)
    assert run(BUILDS[system](package), cwd=tmp_path).split() == digests(precisions)


@pytest.mark.sliced
def test_here_contraction_would_be_noticed(tmp_path):
    package = Package(tmp_path, "plain", ("f32",))
    contracted = package.compiled(["-ffp-contract=fast"], sources_in(package.root / "src"), package.root / "include")
    assert run(contracted, cwd=tmp_path).split() != digests(("f32",))


# ---- options ----

OPTIONS: dict[str, Callable[[Package, str], Path]] = {
    "CMake: the option of that name": lambda package, _: by_cmake(package, "-DHOPFORM_LIBM=ON", flags=["-O0"]),
    "Zephyr: `CONFIG_HOPFORM_LIBM`": lambda package, words: by_zephyr(
        package, words.partition("CONFIG_")[2][:-1], flags=["-O0"]
    ),
}
"""How the README says that the functions of the C library are chosen."""


@pytest.mark.parametrize("words", needs.the_first(list(OPTIONS)))
def test_the_functions_of_the_c_library_are_an_option(tmp_path, words):
    package = Package(tmp_path, words.partition(":")[0].lower(), ("f32",))
    assert words in " ".join((package.root / "README.md").read_text("utf-8").split())
    OPTIONS[words](package, words)
    (library,) = (tmp_path / "build").rglob("libhopform.a")
    asked = {line.split()[-1] for line in run("nm", library, cwd=tmp_path).splitlines() if " U " in line}
    assert {"expf", "expm1f", "logf", "cbrtf"} <= asked


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


def test_arduino_is_offered_single_precision_for_every_processor(tmp_path):
    text = (Package(tmp_path, "arduino", ("f32",)).root / "library.properties").read_text("utf-8")
    assert "architectures=*\n" in text and "double" not in text and "AVR" not in text
