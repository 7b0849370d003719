"""`hopform export --robot` of a model without a contact: the program compiles as its build system would, solves what Python
solves, and runs under its control.
"""

import math
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest
import sympy as sp

import hopform
from derive.emit.examples import example_input
from derive.maths.inverse import ACCELERATION, Inverse, inverse_of, is_driven
from derive.model.quantities import side_1, u
from derive.model_file import read_model
from derive.shipped import FILES, shipped
from hopform._errors import HopformError
from hopform._export import SYSTEMS, Wanted, export, package, reference_of
from tests import needs
from tests.derived import SHIPPED, solver_of
from tests.unit.test_program import CC, LIBRARY, STRICT, run

TICKS = 4000
FREE = '''"""A mass between two springs that nothing drives."""

from hopform.model import *

m = parameter("m", "kg", "mass", "positive", 0.4)
k = parameter("k", "N/m", "stiffness of both springs", "nonnegative", 60)
F = parameter("F", "N", "friction", "nonnegative", 0.1)

z = coordinate("z", "m", m, "slider", directions=("right", "left"))

spring(z, k, "springs")
friction(z, F, name="rail")
'''


@pytest.fixture
def solver(store, tmp_path):
    """The solver of a model, by its name."""

    def of(name: str) -> hopform.Solver:
        if name == "slider":
            (tmp_path / "slider.py").write_text(FREE, "utf-8")
            return solver_of(store, tmp_path / "slider.py")
        return solver_of(store, SHIPPED / f"{name}.py" if name in FILES else name)

    return of


def program_in(root: Path) -> Path:
    (header,) = root.rglob("robot.h")
    return header.parent


def exported(
    root: Path, solver: hopform.Solver, system: str = "plain", robot: hopform.Robot | None = None, **how
) -> Path:
    own = robot or solver.Robot()
    export(root, Wanted(system, robot=own, solver=own.solver, **how))
    return root


def compiled(root: Path, precision: str = "f32", prefix: str = "hopform") -> Path:
    """The program of a package in C."""
    run(
        *CC,
        *LIBRARY,
        "-I",
        root / "include",
        "-c",
        root / "src" / f"{prefix}_{precision}.c",
        "-o",
        "library.o",
        cwd=root,
    )
    files = sorted(program_in(root).glob("*.c"))
    strict = [*STRICT, "-std=c99", "-Wpedantic", "-Wdouble-promotion"]
    run(*CC, *strict, "-I", root / "include", *files, "library.o", "-lm", "-o", "machine", cwd=root)
    return root / "machine"


def numbers(said: str) -> dict[str, list[int]]:
    """What a program has printed, by its texts."""
    print(said)
    found: dict[str, list[int]] = {}
    for text, number in re.findall(r"^(.*): (-?\d+)$", said, re.MULTILINE):
        found.setdefault(text, []).append(int(number))
    return found


def ran_to_its_end(found: dict[str, list[int]]) -> bool:
    right = found["The digest is the expected one. Selftests passed"] == found["Motions as Python solves them"] == [1]
    return right and found["Ticks"] == [TICKS]


# ---- inverse dynamics ----


@pytest.mark.parametrize("name", [name for name in FILES if is_driven(shipped(name))])
@pytest.mark.parametrize("side", [1, -1])
def test_the_input_gives_the_coordinate_the_acceleration_that_was_asked_for(name, side):
    model = shipped(name)
    of = inverse_of(model)
    friction = of.forward if side > 0 else of.backward
    asked = (of.inertia + of.smooth + friction) / of.per_unit
    moves = model.value(model.accelerations[0].subs(model.still).subs(side_1, side)).subs(u, asked)
    assert sp.simplify(moves - ACCELERATION) == 0


@pytest.mark.parametrize(("side", "least"), [(1, "forward_at_rest"), (-1, "backward_at_rest")])
def test_what_friction_takes_at_rest_is_where_a_start_begins(side, least):
    """A file that has four levels of friction, with values of their own."""
    of = inverse_of(shipped("joint"))
    levels = dict(zip(("F_p", "F_m", "F_sp", "F_sm"), (2.0, 3.0, 0.5, 0.25), strict=True))
    own = {symbol: levels[symbol.name] for symbol in getattr(of, least).free_symbols}
    assert getattr(of, least).subs(own) == (2.5 if side > 0 else -3.25)
    assert isinstance(of, Inverse)


# ---- the program of each kind ----

DRIVEN = [
    "joint",
    "relay",
    *needs.sliced(("door",), ("geared_sea",), ("cart",), ("pendulum",), ("relief_valve",), ("sea",)),
]


@needs.library
@pytest.mark.sliced
@pytest.mark.parametrize("name", DRIVEN)
def test_what_an_input_drives_follows_its_reference_better_with_its_compensation(tmp_path, solver, name):
    """What is left is what a tick holds the input for: less than a 300th. Of two coordinates a 40th, because the other one
    moves within the tick. Half the friction would leave a tenth.
    """
    found = numbers(run(compiled(exported(tmp_path / "package", solver(name))), cwd=tmp_path))
    assert ran_to_its_end(found)
    (alone,) = (error for text, error in found.items() if "under feedback alone" in text)
    (compensated,) = (error for text, error in found.items() if "with compensation" in text)
    least = 40 if name in ("geared_sea", "sea") else 300
    assert 0 <= least * compensated[0] < alone[0]
    assert found["Ticks at the limit of the input"] == [0, 0]


@needs.library
@pytest.mark.sliced
def test_a_reference_that_rests_asks_for_no_friction(tmp_path, solver):
    """Of a joint without a load it asks for no input. Else a joint that waits would be pushed to where it slips."""
    root = exported(tmp_path / "package", solver("joint"))
    folder = program_in(root)
    header = (folder / "robot.h").read_text("utf-8")
    (folder / "robot.h").write_text(re.sub(r"(#define STROKE) \S+", r"\1 0.0f", header), "utf-8")
    (folder / "waits.c").write_text(
        '#include "control.c"\n#include <stdio.h>\n'
        "void hardware_print(const char *text, int32_t number) { (void)text; (void)number; }\n"
        'void hardware_input(float input) { printf("asked: %d\\n", (int)millionths(input)); }\n'
        "int main(void) { control(RUN, &start); return 0; }\n",
        "utf-8",
    )
    run(*CC, *STRICT, "-std=c99", "-I", root / "include", folder / "waits.c", "-lm", "-o", "waits", cwd=tmp_path)
    assert numbers(run(tmp_path / "waits", cwd=tmp_path)) == {"asked": [0]}


@needs.library
@pytest.mark.sliced
def test_a_servo_ends_each_step_short_of_its_target_by_what_friction_holds(tmp_path, solver):
    """Within the band F/K_p, at the place that Python's motion under the same steps ends at."""
    servo = solver("servo")
    robot = servo.Robot()
    found = numbers(run(compiled(exported(tmp_path / "package", servo)), cwd=tmp_path))
    assert ran_to_its_end(found)
    stroke = reference_of(robot).stroke
    steps = [(1.0 * n, stroke * (1 - n % 2)) for n in range(4)]
    motion = servo.solve_motion(robot, u=steps, horizon=4.0, dtype="float32")
    ends = [round(1e6 * float(motion.at(n - 1e-3).q)) for n in (1, 2, 3, 4)]
    printed = found["q at the end of a step [1e-6 rad]"]
    assert all(abs(end - number) <= 2 for end, number in zip(ends, printed, strict=True))
    assert all(abs(each) <= 1e6 * robot.F_p / robot.K_p for each in found["short of the target by [1e-6 rad]"])


@needs.library
@pytest.mark.sliced
def test_without_an_input_each_reading_is_that_of_the_motion_that_was_solved(tmp_path, solver):
    found = numbers(run(compiled(exported(tmp_path / "package", solver("slider"))), cwd=tmp_path))
    assert ran_to_its_end(found)
    (off,) = found["Largest difference of reading and motion, in millionths of the largest value"]
    assert off <= 20


@needs.library
@pytest.mark.sliced
def test_the_program_runs_in_double_precision_under_another_prefix(tmp_path, solver):
    root = exported(tmp_path / "package", solver("joint"), precisions=("f64",), prefix="arm")
    text = "".join(file.read_text("utf-8") for file in program_in(root).iterdir())
    assert not re.search(r"hopform_|HOPFORM_|_f32|\bfloat\b|\d\.\d+f\b", text)
    found = numbers(run(compiled(root, "f64", "arm"), cwd=tmp_path))
    assert ran_to_its_end(found)


def closed_loop(solver: hopform.Solver, robot: hopform.Robot, compensates: bool) -> float:
    """The largest error [rad] of a joint under the program's control, in double precision, its equation written by
    hand.
    """
    reference, natural, tick, omega = reference_of(robot), 40.0, 1e-3, 4.0 * math.pi
    q, q_dot, largest = 0.0, 0.0, 0.0
    half = 0.5 * reference.stroke
    for n in range(2000):
        wanted, rate = half * (1 - math.cos(omega * tick * n)), half * omega * math.sin(omega * tick * n)
        then = omega * tick * (n + 0.5)
        feedback = natural * (natural * (wanted - q) + 2.0 * (rate - q_dot))
        torque = robot.J * feedback
        if compensates:
            level = robot.F_p + (robot.F_sp if abs(q_dot) <= 1e-3 * reference.stroke / 0.5 else 0.0)
            torque += robot.J * half * omega**2 * math.cos(then) + robot.b * half * omega * math.sin(then)
            torque += robot.k * (half * (1 - math.cos(then)) - robot.q_0) + math.copysign(level, math.sin(then))
        largest = max(largest, abs(wanted - q)) if n >= 1000 else 0.0
        end = solver.solve_motion(robot, start={"q": q, "q_dot": q_dot}, u=torque / robot.k_t, horizon=tick).end
        q, q_dot = end.q, end.q_dot
    return largest


@needs.library
@pytest.mark.sliced
def test_the_errors_of_a_joint_are_those_of_the_same_loop_in_python(tmp_path, solver):
    """Under feedback alone, and with a compensation whose friction at rest is a third higher than in motion."""
    joint = solver("joint")
    robot = replace(joint.Robot(), J=0.3, k=2.0, b=0.2, F_p=1.2, F_m=1.2, F_sp=0.4, F_sm=0.4, k_t=1.5)
    found = numbers(run(compiled(exported(tmp_path / "package", joint, robot=robot)), cwd=tmp_path))
    assert ran_to_its_end(found)
    alone, compensated = closed_loop(joint, robot, False), closed_loop(joint, robot, True)
    assert found["Largest error under feedback alone [1e-9 rad]"][0] == pytest.approx(1e9 * alone, rel=1e-3)
    assert found["Largest error with compensation [1e-9 rad]"][0] == pytest.approx(1e9 * compensated, rel=0.05)


# ---- it notices what is wrong ----


@needs.library
@pytest.mark.sliced
@pytest.mark.parametrize(
    ("pattern", "text"),
    [
        (
            r"EXPECTED_DIGEST \w+",
            "The digest is not the expected one: other flags, or another version. Selftests passed: 0",
        ),
        (r"EXPECTED_DURATION \S+", "Motions as Python solves them: 0"),
        (r"EXPECTED_PHASES \d+", "Motions as Python solves them: 0"),
        (r"\.k = \S+", "Motions as Python solves them: 0"),
    ],
)
def test_a_number_of_the_header_that_is_not_the_machines_stops_the_program(tmp_path, solver, pattern, text):
    root = exported(tmp_path / "package", solver("joint"))
    header = program_in(root) / "robot.h"
    right = header.read_text("utf-8")
    wrong, count = re.subn(
        pattern, lambda match: match[0].rpartition(" ")[0] + (" 1.5f," if "." in pattern[:2] else " 7"), right
    )
    assert count == 1
    header.write_text(wrong, "utf-8")
    done = subprocess.run([compiled(root)], capture_output=True, text=True, check=False)
    assert done.returncode == 1 and done.stdout.splitlines()[-1] == text


@needs.library
@pytest.mark.sliced
def test_a_robot_that_its_input_cannot_move_is_refused(tmp_path, solver):
    joint = solver("joint")
    for robot, words in (
        (replace(joint.Robot(), k_t=0.0), "its input i has no force"),
        (replace(joint.Robot(), i_max=0.5), r"limit of i must be more than 0\.84 A, .* got 0\.5"),
    ):
        with pytest.raises(HopformError, match=words):
            export(tmp_path / "package", Wanted(robot=robot, solver=robot.solver))
        assert not (tmp_path / "package").exists()


@needs.library
@pytest.mark.sliced
def test_a_reference_keeps_within_stops_and_half_the_limit(solver):
    joint = solver("joint")
    weak = replace(joint.Robot(), i_max=2.0)
    assert reference_of(weak).stroke < reference_of(joint.Robot()).stroke
    near = reference_of(replace(joint.Robot(), q_min=-0.3, q_max=0.1, k=1.0, q_0=0.5))
    assert near.begin == 0.1 and near.stroke == pytest.approx(-0.04)


# ---- packages ----

WORDS = re.compile(r"\b(stances?|hoppers?|hops?|touchdown|take-?off|legs?|choose_current|apex)\b", re.IGNORECASE)


@needs.library
@pytest.mark.sliced
@pytest.mark.parametrize("system", SYSTEMS)
def test_the_package_of_a_joint_has_no_word_of_a_hopper(solver, system):
    robot = solver("joint").Robot()
    for path, text in package(Wanted(system, robot=robot, solver=robot.solver)).items():
        assert not WORDS.findall(path.as_posix()), path
        if path.parts[0] not in ("src", "include", "amalgamated"):  # the library's
            assert not WORDS.findall(text), path


@needs.library
@pytest.mark.sliced
@pytest.mark.parametrize("system", SYSTEMS)
def test_a_robot_adds_its_program_and_changes_nothing_else(solver, system):
    robot = solver("joint").Robot()
    bare = package(Wanted(system, solver=robot.solver))
    full = package(Wanted(system, robot=robot, solver=robot.solver))
    assert {path: full.get(path) for path in bare} == bare
    (folder,) = {path.parts[:2] for path in full.keys() - bare.keys()}
    assert folder[1].lower() == "machine" and not any(path.parts[:2] == folder for path in bare)
    for path in full.keys() - bare.keys():
        assert "Do not edit" not in full[path] and not re.search(r"@\w+@", full[path]), path
        if path.name == "CMakeLists.txt":
            listed = re.findall(r"[\w/-]+\.c\b", full[path])
            assert all(path.parent / name in full for name in listed), path


@needs.library
@pytest.mark.sliced
@pytest.mark.parametrize("name", ["joint", "relief_valve", "rope_drum", "slider"])
def test_the_first_example_runs(tmp_path, solver, name):
    root = exported(tmp_path / "package", solver(name), "platformio")
    (example,) = (root / "examples" / "motion").glob("main.c")
    strict = [*STRICT, "-std=c99", "-Wpedantic", "-I", root / "include"]
    run(*CC, *strict, example, root / "src" / "hopform_f32.c", "-lm", "-o", "example", cwd=tmp_path)
    run(tmp_path / "example", cwd=tmp_path)


FLAP = '''"""A flap between two stops."""

from hopform.model import *

J = parameter("J", "kg m^2", "inertia", "positive", 0.02)
tau_max = parameter("tau_max", "N m", "limit of the torque", "bound", 0.2)

theta = coordinate("theta", "rad", J, "flap")
tau = current("tau", "N m", limit=tau_max)

friction(theta, 0.4)
torque(theta, -50 * tau)
stop(theta, {})
'''


@pytest.mark.parametrize(("stops", "expected"), [("0.5, 1.5", -0.1), ("-1.5, -0.5", 0.1), ("-1, 1", -0.1)])
def test_the_input_of_the_first_example_is_half_its_limit_and_away_from_a_stop(tmp_path, stops, expected):
    (tmp_path / "flap.py").write_text(FLAP.format(stops), "utf-8")
    assert example_input(read_model(tmp_path / "flap.py")) == expected


def run_over_arduino(root, folder, headers, program, *macros):
    """What a program in C++ and the C beside it print over a stand-in for Arduino's core."""
    from tests.unit.test_program import CORE, LOOPED

    (folder / "Arduino.h").write_text("#pragma once\n" + CORE, "utf-8")
    (folder / "core.cpp").write_text(program + LOOPED, "utf-8")
    include = [*macros, "-I", headers, "-I", folder]
    run("c++", "-std=gnu++17", *STRICT, *include, "-c", folder / "core.cpp", "-o", "core.o", cwd=root)
    for name in ("plant", "control"):
        run(*CC, "-std=gnu11", *STRICT, *include, "-c", folder / f"{name}.c", "-o", f"{name}.o", cwd=root)
    run(*CC, *LIBRARY, "-I", headers, "-c", root / "src" / "hopform_f32.c", "-o", "library.o", cwd=root)
    run("c++", "core.o", "plant.o", "control.o", "library.o", "-lm", "-o", "machine", cwd=root)
    return numbers(run(root / "machine", cwd=root))


@needs.cpp
@needs.library
@pytest.mark.sliced
def test_the_sketch_runs(tmp_path, solver):
    """As C++ with src/ as the include root; the IDE puts Arduino.h before it, and compiles the other files as C."""
    root = exported(tmp_path / "package", solver("joint"), "arduino")
    folder = program_in(root)
    (sketch,) = folder.glob("*.ino")
    assert sketch.stem == folder.name == "Machine"
    program = "#include <Arduino.h>\n" + sketch.read_text("utf-8")
    assert ran_to_its_end(run_over_arduino(root, folder, root / "src", program, "-DARDUINO=10819"))


@needs.cpp
@needs.library
@pytest.mark.sliced
def test_the_program_runs_with_the_framework_arduino_of_platformio(tmp_path, solver):
    """As the README says, main.c as main.cpp and without print.c; PlatformIO puts Arduino.h into no file."""
    root = exported(tmp_path / "package", solver("joint"), "platformio")
    folder = program_in(root)
    (folder / "print.c").unlink()
    (folder / "main.c").rename(folder / "main.cpp")
    macros = ("-DARDUINO=10808", "-DPLATFORMIO=60118")
    assert ran_to_its_end(run_over_arduino(root, folder, root / "include", '#include "main.cpp"\n', *macros))


@needs.library
@needs.cortex_m
@pytest.mark.sliced
@pytest.mark.parametrize("name", ["joint", "servo", "relay"])
def test_an_emulated_board_prints_what_this_computer_prints(tmp_path, solver, name):
    """By its presets; but for what sin and cos of the two C libraries leave of an error of some nanometres."""
    root = exported(tmp_path / "package", solver(name), "cmake", precisions=("f32",))
    cmake, ctest = shutil.which("cmake"), shutil.which("ctest")
    assert cmake is not None and ctest is not None, "cmake is not installed"
    folder = program_in(root)
    said = []
    for preset in ("pc", "cortex-m4f"):
        run(cmake, "--preset", preset, cwd=folder)
        run(cmake, "--build", "--preset", preset, cwd=folder)
        printed = run(ctest, "--preset", preset, cwd=folder)
        said.append(numbers(re.sub(r"^\d+: ", "", printed, flags=re.MULTILINE)))
    here, there = said
    assert ran_to_its_end(here) and ran_to_its_end(there) and here.keys() == there.keys()
    for text, expected in here.items():
        if "Test" not in text:
            assert there[text] == pytest.approx(expected, rel=1e-3, abs=200 if "1e-9" in text else 1), text
