"""`hopform export --robot`: the program in the package compiles as its build system would, and makes the robot hop."""

import json
import math
import os
import re
import shlex
import shutil
import subprocess
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import hopform
from hopform._errors import HopformError
from hopform._export import DTYPES, SYSTEMS, Wanted, export, package, selftest, struct_of
from hopform._front import main
from tests import needs
from tests.derived import solver_of

CC = shlex.split(os.environ.get("CC") or "cc")
LIBRARY = ["-std=c99", "-O1", "-ffp-contract=off", "-fno-math-errno"]
STRICT = ["-O1", "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror"]
HOPS = 10
TICK = 0.002
"""[m] The loop sees touchdown and take-off up to a millisecond late, so a hop is off by some tenths of a millimetre; a
current that is wrong by a twentieth moves it by more than this."""


def run(*command: str | Path, cwd: Path) -> str:
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def exported(folder: Path, system: str, robot: str = "hopper_c", **how) -> Path:
    """A package with the program for a shipped robot; its root."""
    export(folder, Wanted(system, robot=hopform.load_robot(robot), **how))
    return folder


def program_in(root: Path) -> Path:
    """The folder of the program's C."""
    (header,) = root.rglob("robot.h")
    return header.parent


def hops_near_what_is_wanted(said: str, root: Path) -> bool:
    (wanted,) = re.findall(r"#define H_DES ([\d.]+)", (program_in(root) / "robot.h").read_text("utf-8"))
    apexes = [int(each) * 1e-4 for each in re.findall(r"apex \[0.1 mm\]: (\d+)", said)]
    print(said)
    return len(apexes) == HOPS and all(abs(apex - float(wanted)) < TICK for apex in apexes)


# ---- each build system's layout ----

CORE = """#include <stdint.h>
#include <stdio.h>
static unsigned long milliseconds;
static inline unsigned long millis(void) { return milliseconds++; }
struct Port {
  void begin(long) {}
  explicit operator bool() const { return milliseconds > 100; }
  void print(const char *text) { fputs(text, stdout); }
  void println(int32_t number) { printf("%ld\\n", (long)number); }
};
static Port Serial;
"""
"""Of the core what a program asks for, as Arduino.h: a port that is USB, and open once the monitor is."""

LOOPED = "\nint main(void) { setup(); for (long n = 0; n < 20000; n++) { loop(); } return 0; }\n"


@pytest.fixture(scope="module")
def libraries(tmp_path_factory):
    """The object of the library in a precision and with a prefix, compiled once."""
    made: dict[tuple[str, str], Path] = {}

    def library(root: Path, include: str = "include", precision: str = "f32", prefix: str = "hopform") -> Path:
        if (precision, prefix) not in made:
            made[precision, prefix] = tmp_path_factory.mktemp("library") / "library.o"
            source = root / "src" / f"{prefix}_{precision}.c"
            run(*CC, *LIBRARY, "-I", root / include, "-c", source, "-o", made[precision, prefix], cwd=root)
        return made[precision, prefix]

    return library


def hopper(root: Path, library: Path) -> Path:
    """The program of a package in C."""
    files = sorted(program_in(root).glob("*.c"))
    strict = [*STRICT, "-std=c99", "-Wpedantic", "-Wdouble-promotion"]
    run(*CC, *strict, "-I", root / "include", *files, library, "-lm", "-o", "hopper", cwd=root)
    return root / "hopper"


QUICK = {"plain"}
IN_C = [
    pytest.param(system, marks=() if system in QUICK else pytest.mark.sliced)
    for system in SYSTEMS
    if system != "arduino"
]


@needs.library
@pytest.mark.parametrize("system", IN_C)
def test_the_program_hops(tmp_path, libraries, system):
    root = exported(tmp_path / "package", system)
    assert hops_near_what_is_wanted(run(hopper(root, libraries(root)), cwd=root), root)


@needs.library
@pytest.mark.parametrize("robot", ["hopper_b", "ideal"])
def test_each_shipped_robot_hops(tmp_path, libraries, robot):
    root = exported(tmp_path / "package", "plain", robot)
    assert hops_near_what_is_wanted(run(hopper(root, libraries(root)), cwd=root), root)


@needs.library
@pytest.mark.sliced
def test_the_program_hops_in_double_precision_under_another_prefix(tmp_path, libraries):
    root = exported(tmp_path / "package", "plain", precisions=("f64",), prefix="gait")
    text = "".join(file.read_text("utf-8") for file in program_in(root).iterdir())
    assert not re.search(r"hopform_|HOPFORM_|_f32|\bfloat\b|\d\.\d+f\b", text)
    library = libraries(root, precision="f64", prefix="gait")
    assert hops_near_what_is_wanted(run(hopper(root, library), cwd=root), root)


@needs.cpp
@needs.library
def test_the_sketch_hops(tmp_path, libraries):
    """As C++ with src/ as the include root, over a stand-in for the core; the IDE compiles plant.c beside it as C."""
    root = exported(tmp_path / "package", "arduino")
    folder = program_in(root)
    (sketch,) = folder.glob("*.ino")
    assert sketch.stem == folder.name and folder.parent == root / "examples"
    assert not (folder / "main.c").exists()
    (folder / "Arduino.h").write_text("#pragma once\n" + CORE, "utf-8")
    (folder / "sketch.cpp").write_text("#include <Arduino.h>\n" + sketch.read_text("utf-8") + LOOPED, "utf-8")
    include = ["-DARDUINO=10819", "-I", root / "src", "-I", folder]
    run("c++", "-std=gnu++17", *STRICT, *include, "-c", folder / "sketch.cpp", "-o", "sketch.o", cwd=root)
    run(*CC, "-std=gnu11", *STRICT, *include, "-c", folder / "plant.c", "-o", "plant.o", cwd=root)
    run("c++", "sketch.o", "plant.o", libraries(root, "src"), "-lm", "-o", "hopper", cwd=root)
    assert hops_near_what_is_wanted(run(root / "hopper", cwd=root), root)


@needs.library
@pytest.mark.parametrize("system", [each for each in SYSTEMS if each != "plain"])
def test_the_readme_has_a_section_for_each_build_system_and_names_folders_that_are_there(system):
    texts = package(Wanted(system, robot=hopform.load_robot("hopper_c")))
    readme = texts[Path("README.md")]
    assert {*re.findall(r"^### .*`--for ([\w-]+)`$", readme, re.MULTILINE)} == {*SYSTEMS} - {"plain"}
    (section,) = re.findall(rf"^### .*`--for {system}`$(.*?)^##", readme, re.MULTILINE | re.DOTALL)
    named = re.findall(r"DIR/(\S+/\w+)", section)
    assert all(any(path.is_relative_to(each) for path in texts) for each in named)


@needs.library
@pytest.mark.parametrize(
    ("system", "files"),
    [
        ("platformio", {"platformio.ini", "src/main.c", "src/plant.c", "src/hardware.h", "src/robot.h", "src/print.c"}),
        ("zephyr", {"CMakeLists.txt", "prj.conf", "sample.yaml", "src/main.c", "src/robot.h"}),
        ("esp-idf", {"CMakeLists.txt", "sdkconfig.defaults", "main/CMakeLists.txt", "main/main.c", "main/robot.h"}),
    ],
)
def test_the_program_lies_where_its_build_system_looks(system, files):
    robot = hopform.load_robot("hopper_c")
    place = "samples/hopper" if system == "zephyr" else "examples/hopper"
    texts = {path.as_posix(): text for path, text in package(Wanted(system, robot=robot)).items()}
    assert {f"{place}/{name}" for name in files} <= texts.keys()
    for name in ("CMakeLists.txt", "main/CMakeLists.txt"):
        folder = Path(place, name).parent
        for source in re.findall(r"\S+\.c\b", texts.get(f"{place}/{name}", "")):
            assert (folder / source).as_posix() in texts


@pytest.mark.sliced
@needs.library
@needs.cortex_m
@pytest.mark.parametrize(
    ("system", "file"),
    [("zephyr", "samples/hopper/prj.conf"), ("esp-idf", "examples/hopper/sdkconfig.defaults")],
)
def test_the_main_task_has_the_stack_of_the_selftest(tmp_path, system, file):
    """That of each function that it calls by gcc's call graph for a Cortex-M4F, in the precision that takes more."""
    root = exported(tmp_path / "package", system, precisions=("f64",))
    (given,) = re.findall(r"^CONFIG_\w*MAIN\w*STACK_SIZE=(\d+)$", (root / file).read_text("utf-8"), re.MULTILINE)
    board = ["-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard", "-fcallgraph-info=su"]
    source = root / "src" / "hopform_f64.c"
    run("arm-none-eabi-gcc", *board, *LIBRARY, "-I", root / "include", "-c", source, "-o", "library.o", cwd=tmp_path)
    graph = (tmp_path / "library.ci").read_text("utf-8")
    frames = {name: int(size) for name, size in re.findall(r'node: \{ title: "([^"]+)" label: ".*?(\d+) bytes', graph)}
    calls = re.findall(r'edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"', graph)

    @cache
    def stack(function: str) -> int:
        deepest = max((stack(called) for caller, called in calls if caller == function), default=0)
        return frames.get(function, 0) + deepest

    assert 3584 < stack("hopform_selftest_f64") < 0.9 * int(given)


@needs.library
@pytest.mark.sliced
@pytest.mark.parametrize("system", ["plain", "cmake"])
def test_the_line_of_the_readme_for_any_compiler_makes_the_program(tmp_path, system):
    root = exported(tmp_path / "package", system, precisions=("f32",))
    (line,) = re.findall(r"^cc (.* -o hopper)$", (root / "README.md").read_text("utf-8"), re.MULTILINE)
    run("sh", "-c", f"{shlex.join(CC)} {line}", cwd=root)
    assert hops_near_what_is_wanted(run(root / "hopper", cwd=root), root)


# ---- CMake: build systems that stand on it, over stand-ins for their commands, and the presets ----

ESP_IDF = """macro(idf_component_register)
  cmake_parse_arguments(GIVEN "" "" "SRCS;INCLUDE_DIRS" ${ARGN})
  get_filename_component(COMPONENT_LIB ${CMAKE_CURRENT_SOURCE_DIR} NAME)
  add_library(${COMPONENT_LIB} STATIC ${GIVEN_SRCS})
  target_include_directories(${COMPONENT_LIB} PUBLIC ${GIVEN_INCLUDE_DIRS})
  target_compile_definitions(${COMPONENT_LIB} PRIVATE ESP_PLATFORM)
endmacro()
macro(project name)
  _project(${name} LANGUAGES C)
  add_subdirectory(${EXTRA_COMPONENT_DIRS} component)
  add_subdirectory(main)
  file(WRITE ${CMAKE_BINARY_DIR}/starts.c "void app_main(void); int main(void) { app_main(); return 0; }")
  target_link_libraries(main PUBLIC package m)
  add_executable(app ${CMAKE_BINARY_DIR}/starts.c)
  target_link_libraries(app PRIVATE main)
endmacro()
"""
ZEPHYR = """enable_language(C)
get_filename_component(PACKAGE ${CMAKE_CURRENT_SOURCE_DIR}/../.. ABSOLUTE)
file(GLOB LIBRARY ${PACKAGE}/src/*.c)
file(WRITE ${CMAKE_BINARY_DIR}/empty.c "")
add_executable(app ${CMAKE_BINARY_DIR}/empty.c ${LIBRARY})
target_include_directories(app PRIVATE ${PACKAGE}/include)
target_link_libraries(app PRIVATE m)
"""
STAND_INS = {
    "esp-idf": ("IDF_PATH", "tools/cmake/project.cmake", ESP_IDF),
    "zephyr": ("ZEPHYR_BASE", "share/zephyr-package/cmake/ZephyrConfig.cmake", ZEPHYR),
}
"""The variable that says where a build system is, the file that is read there, and what stands in for it."""


@needs.library
@pytest.mark.sliced
@pytest.mark.parametrize("system", STAND_INS)
def test_the_program_hops_by_the_build_files_of(tmp_path, monkeypatch, system):
    root, (variable, name, text) = exported(tmp_path / "package", system, precisions=("f32",)), STAND_INS[system]
    (tmp_path / name).parent.mkdir(parents=True)
    (tmp_path / name).write_text(text, "utf-8")
    monkeypatch.setenv(variable, str(tmp_path))
    cmake = shutil.which("cmake")
    assert cmake is not None, "cmake is not installed"
    (project,) = (root / "samples" if system == "zephyr" else root / "examples").glob("hopper")
    run(cmake, "-S", project, "-B", "build", f"-DZephyr_DIR={(tmp_path / name).parent}", cwd=tmp_path)
    run(cmake, "--build", "build", cwd=tmp_path)
    assert hops_near_what_is_wanted(run(tmp_path / "build" / "app", cwd=tmp_path), root)


@needs.library
@pytest.mark.parametrize("precision", ["f32", "f64"])
@pytest.mark.parametrize(
    "preset",
    [
        pytest.param("pc", marks=pytest.mark.sliced),
        pytest.param("cortex-m4f", marks=[pytest.mark.sliced, needs.cortex_m]),
    ],
)
def test_the_program_hops_by_its_preset(tmp_path, preset, precision):
    """On the emulated board, too: `ctest` runs the program there."""
    root = exported(tmp_path / "package", "cmake", precisions=(precision,))
    cmake, ctest = shutil.which("cmake"), shutil.which("ctest")
    assert cmake is not None and ctest is not None, "cmake is not installed"
    folder = program_in(root)
    run(cmake, "--preset", preset, cwd=folder)
    run(cmake, "--build", "--preset", preset, cwd=folder)
    assert hops_near_what_is_wanted(run(ctest, "--preset", preset, cwd=folder), root)


# ---- a model of one's own ----


@pytest.fixture
def damped(store, tmp_path):
    """A package, under another prefix, with the program of a robot that has a damper in its leg; its root."""
    solver = solver_of(store, "leg_damper")
    robot = replace(solver.load_robot("hopper_c"), b12=5.0)

    def root(system: str) -> Path:
        wanted = Wanted(system, "gait", ("f32",), robot, robot.solver)
        export(tmp_path / "package", wanted)
        return tmp_path / "package"

    return root


@needs.library
@pytest.mark.sliced
def test_the_program_of_a_damped_leg_hops(damped, tmp_path):
    """The plant integrates the model's own equations: without the damper it would hop 3 cm higher than is wanted."""
    root = damped("plain")
    run(*CC, *LIBRARY, "-I", root / "include", "-c", root / "src" / "gait_f32.c", "-o", tmp_path / "gait.o", cwd=root)
    said = run(hopper(root, tmp_path / "gait.o"), cwd=root)
    assert "The digest is the expected one. Selftests passed: 1\n" in said and hops_near_what_is_wanted(said, root)


@needs.library
@needs.cortex_m
@pytest.mark.sliced
def test_the_program_of_a_damped_leg_hops_on_an_emulated_board(damped):
    """Its digest there is that of this computer."""
    root = damped("cmake")
    folder = program_in(root)
    for command in (["cmake", "--preset"], ["cmake", "--build", "--preset"]):
        run(*command, "cortex-m4f", cwd=folder)
    said = run("ctest", "--preset", "cortex-m4f", cwd=folder)
    assert "The digest is the expected one. Selftests passed: 1\n" in said and hops_near_what_is_wanted(said, root)


# ---- the three steps ----


@needs.library
def test_a_library_of_another_digest_is_refused_before_anything_moves(tmp_path, libraries):
    root = exported(tmp_path / "package", "plain")
    header = program_in(root) / "robot.h"
    right = f"0x{selftest('float32'):08x}u"
    assert right in header.read_text("utf-8")
    header.write_text(header.read_text("utf-8").replace(right, "0x12345678u"), "utf-8")
    done = subprocess.run([hopper(root, libraries(root))], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stdout == ("The digest is not the expected one: other flags, or another version. Selftests passed: 0\n")


@needs.library
def test_the_first_command_is_that_of_python(tmp_path, libraries):
    root, robot = exported(tmp_path / "package", "plain"), hopform.load_robot("hopper_c")
    said = run(hopper(root, libraries(root)), cwd=root)
    (height,) = re.findall(r"#define H_DES ([\d.]+)", (program_in(root) / "robot.h").read_text("utf-8"))
    drop = hopform.touchdown_velocity(robot, float(height))
    u = hopform.choose_current(robot, v2=drop, h_des=float(height)).u
    (milliamperes,) = re.findall(r"^The first current reaches H_DES. Current \[mA\]: (-?\d+)$", said, re.MULTILINE)
    assert abs(int(milliamperes) - 1000.0 * u) < 1.0 + 2e-6 * 1000.0 * robot.u_max  # whole ones; and single precision


# ---- robot.h ----

HALFWAY = 1.0 + 2.0**-24
"""Halfway between two numbers of single precision: its shortest decimal lies above, which rounds up, and it itself to
even, down."""


@pytest.mark.parametrize("precision", DTYPES)
def test_a_compiler_reads_the_robot_to_the_last_bit(tmp_path, precision):
    shipped = [hopform.load_robot(name) for name in hopform.ROBOTS]
    odd = replace(shipped[0], m_eff=HALFWAY, k=1234.56789012345, c=1e-30, x1_min=-math.inf, x1_max=math.inf)
    robots, names = [*shipped, odd], [field.name for field in hopform.Robot.fields()]
    structs = "".join(struct_of(each, precision).replace(" robot =", f" r{n} =") for n, each in enumerate(robots))
    prints = "".join(f'printf("%a\\n", (double)r{n}.{name});' for n in range(len(robots)) for name in names)
    text = f'#include <stdio.h>\n#include "hopform/hopform.h"\n{structs}int main(void) {{ {prints} return 0; }}\n'
    (tmp_path / "main.c").write_text(text, "utf-8")
    include = Path(__file__).resolve().parents[2] / "generated" / "c" / "include"
    run(*CC, "-std=c99", "-I", include, "main.c", "-o", "main", cwd=tmp_path)
    read = [float.fromhex(line) for line in run(tmp_path / "main", cwd=tmp_path).split()]
    assert read == [float(DTYPES[precision](getattr(each, name))) for each in robots for name in names]


def test_a_parameter_beyond_single_precision_is_refused_by_name():
    robot = replace(hopform.load_robot("hopper_c"), k=1e39)
    assert "1e+39" in struct_of(robot, "f64")
    with pytest.raises(HopformError, match=r"k = 1e\+39 N/m has no f32"):
        struct_of(robot, "f32")


# ---- the command ----


@needs.library
@pytest.mark.parametrize("system", SYSTEMS)
def test_a_robot_adds_its_program_and_changes_nothing_else(system):
    bare = package(Wanted(system))
    full = package(Wanted(system, robot=hopform.load_robot("hopper_c")))
    assert {path: full.get(path) for path in bare} == bare
    folders = {path.parts[:2] for path in full.keys() - bare.keys()}
    assert len(folders) == 1 and folders.pop()[1].lower() == "hopper"
    for path in full.keys() - bare.keys():
        assert "Do not edit" not in full[path] and not re.search(r"@\w+@", full[path]), path


@needs.library
def test_the_command_takes_a_robot_file(tmp_path, capsys):
    mine = tmp_path / "mine.toml"
    mine.write_text(replace(hopform.load_robot("hopper_c"), k=1300.0).to_toml(), "utf-8")
    assert main(["export", str(tmp_path / "new"), "--robot", str(mine), "--json"]) == 0
    assert "examples/hopper/main.c" in json.loads(capsys.readouterr().out)["files"]
    assert ".k = 1300.0f," in (program_in(tmp_path / "new") / "robot.h").read_text("utf-8")


@needs.library
def test_a_robot_that_cannot_hop_is_refused_in_one_line(tmp_path, capsys):
    mine = tmp_path / "mine.toml"
    mine.write_text(replace(hopform.load_robot("hopper_c"), u_max=0.0).to_toml(), "utf-8")
    assert main(["export", str(tmp_path / "new"), "--robot", str(mine)]) == 2
    error = capsys.readouterr().err
    assert "--robot" in error and "no hop height" in error and len(error.splitlines()) == 1
    assert not (tmp_path / "new").exists()


@needs.library
def test_a_robot_that_is_too_stiff_for_the_precision_is_refused_in_it(tmp_path, capsys):
    mine = tmp_path / "mine.toml"
    stiff = replace(hopform.load_robot("hopper_c"), m_eff=0.1, b1=3000.0, gamma2=-600.0, u_max=6.0)
    mine.write_text(stiff.to_toml(), "utf-8")
    assert main(["export", str(tmp_path / "new"), "--robot", str(mine)]) == 2
    error = capsys.readouterr().err
    assert "ill_conditioned" in error and "--f64" in error and len(error.splitlines()) == 1
    assert main(["export", str(tmp_path / "new"), "--robot", str(mine), "--f64"]) == 0


@needs.library
def test_the_program_says_which_status_stopped_it(tmp_path, libraries):
    root = exported(tmp_path / "package", "plain")
    header = program_in(root) / "robot.h"
    header.write_text(header.read_text("utf-8").replace(".m_s = 3.0f", ".m_s = 0.0f"), "utf-8")
    done = subprocess.run([hopper(root, libraries(root))], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stdout.endswith("\nhopform_plan_init refuses the robot, or warns of it. Status: -2\n")


def test_no_height_is_kept_at_which_the_spring_binds():
    from hopform._export import heights_kept

    robot = hopform.load_robot("hopper_c")
    short = heights_kept(replace(robot, travel=0.12))
    assert short == heights_kept(robot)[: len(short)] and 0.1 < max(short) < 0.2


def test_the_heights_that_a_robot_keeps_are_those_that_its_motor_pays_for():
    """A lossless robot keeps every height, one with a weaker motor fewer."""
    from hopform._export import HEIGHTS, heights_kept

    strong = hopform.load_robot("hopper_c")
    assert heights_kept(hopform.load_robot("ideal")) == list(HEIGHTS)
    assert max(heights_kept(replace(strong, u_max=2.0))) < max(heights_kept(strong))
    assert np.all(np.diff(HEIGHTS) > 0.0)
