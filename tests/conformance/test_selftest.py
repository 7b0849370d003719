"""hopform_selftest: one digest of all bits of all results, the same wherever IEEE 754 is kept to."""

import ctypes
import math
import os
import re
import shlex
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hopform
from derive.emit.facts import ROUNDING
from derive.model.precisions import FAR, PRECISIONS
from derive.model.selftest import EVERY_CASE, ROBOTS, Case
from hopform._export import selftest
from hopform._solver import c as native
from tests.conformance.firmware import cases, golden, headers
from tests.conformance.firmware.targets import BOARDS, COMMON, HERE, C, sources, tables
from tests.needs import the_first
from tests.objects import compiled

CC = shlex.split(os.environ.get("CC") or "cc")
MODES, EVENTS = 9, 7


@pytest.fixture(scope="module")
def library(store):
    """The library by a compiler with some flags: its objects, made once."""

    def objects(*command: str) -> list[Path]:
        return [compiled(store, (*command, *COMMON), source) for source in sources()]

    return objects


def built(folder: Path, library: Callable[..., list[Path]], program: str, *command: str) -> Path:
    """tests/conformance/firmware/`program`.c for this computer."""
    image = folder / program
    files = [HERE / f"{program}.c", BOARDS / "board.c", *library(*command)]
    include = ["-I", str(C / "include"), "-I", str(BOARDS), "-I", str(tables())]
    done = subprocess.run(
        [*command, *COMMON, *include, *map(str, files), "-o", str(image), "-lm"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return image


def output_of(image: Path) -> str:
    done = subprocess.run([image], capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stderr
    return done.stderr


COMPILERS = [CC, *([["clang"]] if shutil.which("clang") else [])]


@pytest.mark.sliced
@pytest.mark.parametrize("level", the_first(["-O2", "-O0"]))
@pytest.mark.parametrize("compiler", COMPILERS, ids=" ".join)
def test_the_library_of_python_returns_the_digest_of_every_compiler(tmp_path, library, compiler, level):
    output = output_of(built(tmp_path, library, "selftest", *compiler, level))
    found = re.fullmatch(r"f32 ([0-9a-f]{8}) f64 ([0-9a-f]{8})\n", output)
    assert found is not None
    assert found.groups() == (f"{selftest('float32'):08x}", f"{selftest('float64'):08x}")


OTHERS = {
    "clang": ("-O2", "-march=native"),  # the flags of somebody else's project, by which it may multiply and add at once
    "gcc": ("-O3", "-flto=auto", "-Wall", "-Wextra", "-Werror", *ROUNDING),
    "tcc": (),
}
"""Compilers with flags that builds of this project do not give them."""


@pytest.mark.sliced
@pytest.mark.parametrize("compiler", [name for name in OTHERS if shutil.which(name)])
def test_a_compiler_with_other_flags_than_ours_gives_the_digest(tmp_path, compiler):
    """With -march=native clang contracted where the processor can, until a pragma kept it from that; gcc warned of the
    selftest when it linked; tcc refused arrays without a size.
    """
    files = [HERE / "selftest.c", BOARDS / "board.c", *sources()]
    command = [compiler, "-std=c99", *OTHERS[compiler], "-I", C / "include", "-I", BOARDS, *files, "-lm"]
    done = subprocess.run([*command, "-o", tmp_path / "it"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    expected = f"f32 {selftest('float32'):08x} f64 {selftest('float64'):08x}\n"
    assert output_of(tmp_path / "it") == expected


@pytest.mark.sliced
def test_random_stances_flights_and_commands_have_the_same_bits_with_every_compiler(tmp_path, library):
    digests = {
        output_of(built(tmp_path, library, "digests", *compiler, level))
        for compiler in COMPILERS
        for level in ("-O0", "-O2")
    }
    assert len(digests) == 1
    assert re.fullmatch(r"f32 [0-9a-f]{8} f64 [0-9a-f]{8}\n", digests.pop())


def test_a_coefficient_that_is_off_in_its_last_digit_gives_another_digest(tmp_path):
    """The selftest can fail."""
    shutil.copytree(C, tmp_path / "c")
    series = tmp_path / "c" / "src" / "series_f32.h"
    text = series.read_text("utf-8")
    assert "(0.041666668f)" in text
    series.write_text(text.replace("(0.041666668f)", "(0.041666672f)"), "utf-8")
    files = [tmp_path / "c" / "src" / path.name for path in sources(("f32",))]
    include = ["-I", tmp_path / "c" / "include", "-I", BOARDS]
    command = [*CC, *COMMON, "-DSINGLE", *include, HERE / "selftest.c", BOARDS / "board.c", *files]
    subprocess.run([*command, "-o", tmp_path / "image", "-lm"], check=True)
    assert re.fullmatch(r"f32 [0-9a-f]{8}\n", output := output_of(tmp_path / "image"))
    assert f"{selftest('float32'):08x}" not in output


def test_other_types_are_refused():
    with pytest.raises(hopform.HopformError, match="float32 or float64"):
        selftest(np.float16)


def test_the_cases_visit_every_mode_event_and_ending():
    modes, events, endings = set(), set(), set()
    for case in EVERY_CASE:
        stance = solved(case)
        modes |= {(phase.mode_1, phase.mode_2) for phase in stance.phases}
        events |= {event.kind for event in stance.events}
        endings.add(stance.status)
    assert len(modes) == MODES
    assert len(events) == EVENTS
    assert endings == {"takeoff", "rest", "horizon", "too_many_phases"}


@pytest.mark.parametrize("precision", PRECISIONS, ids=lambda precision: precision.name)
def test_the_cases_visit_every_regime_of_the_poles_and_of_friction(precision):
    """Short series and E and Phi over a node, and states late in a phase counted from its start and its end next to
    where that changes; some with a flight after it.
    """
    found, far = set(), FAR.of(precision)
    for case in EVERY_CASE:
        plan = planned(ROBOTS[case.robot], precision.type)
        poles, node = plan.poles[0], plan.transition
        stiffness, rings = poles.a**2 / poles.q, poles.p**2 < 4.0 * poles.q
        fades = node.fastest * node.h > 0.8
        assert fades == (not rings or stiffness > (0.8 / (0.25 * math.pi)) ** 2)
        assert node.apart == (rings and node.fastest * node.h > 1.0 and stiffness > 4.0)
        stance = solved(case)
        is_late = any(
            phase.mode_1 != 0 and phase.mode_2 != 0 and poles.a * (phase.end - phase.start) >= 1.0
            for phase in stance.phases
        )
        of = {
            "a short series over a node": poles.a > 0.0 and not fades,
            "E and Phi, beside a pair that rings": rings and fades and not node.apart,
            "a pole far beyond the pair": node.apart and stiffness < 0.1 * far,
            "late, counted from the start": node.apart and is_late and 0.8 * far < stiffness < far,
            "late, counted from the end": is_late and far < stiffness < 1.25 * far,
            "three real poles": poles.a > 0.0 and not rings,
            "near-equal poles": abs(poles.a**2 - poles.p * poles.a + poles.q) < 0.05 * poles.q,
            "friction at rest": ROBOTS[case.robot]["f1_excess"] > 0.0,
        }
        found |= {(name, stance.status == "takeoff") for name, holds in of.items() if holds}
    flown = {name for name, took_off in found if took_off}
    assert flown >= {*of} - {"E and Phi, beside a pair that rings", "three real poles", "near-equal poles"}
    assert {name for name, _ in found} == {*of}


FIELDS = {field.name for field in hopform.Robot.fields()}


def planned(robot: dict[str, float], type_: str) -> Any:
    """The plan of a robot in one precision."""
    library = native.library()
    types = library.types(np.dtype(np.float32 if type_ == "float" else np.float64))
    plan, known = types.Plan(), cases.fields(robot)
    made = types.Robot(*(known[name] for name, *_ in types.Robot._fields_))
    library.call("plan_init", types, ctypes.byref(plan), ctypes.byref(made))
    return plan


def solved(case: Case) -> hopform.Stance:
    fields = {name: value for name, value in cases.fields(ROBOTS[case.robot]).items() if name in FIELDS}
    robot = hopform.Robot(**fields)
    return hopform.solve_stance(
        robot, x1=case.x1, v1=case.v1, v2=case.v2, x2=case.x1 + robot.L0 + robot.c - case.y,
        u=[(0.0, case.u), (case.later, case.then)], horizon=case.horizon, max_phases=32,
    )  # fmt: skip


@pytest.mark.sliced
@pytest.mark.parametrize("flags", the_first(["-O2", "-O2 -DHOPFORM_LIBM"]))
def test_the_golden_vectors_hold_on_this_computer(tmp_path, library, flags):
    assert ", wrong 0" in output_of(built(tmp_path, library, "golden", *CC, *flags.split()))


@pytest.mark.sliced
def test_with_the_functions_of_the_c_library_the_digest_is_another_and_the_numbers_are_not(tmp_path, library):
    """The option does something: both digests differ from those of the library's own exp, sin, cos, ln and roots."""
    found = re.fullmatch(
        r"f32 ([0-9a-f]{8}) f64 ([0-9a-f]{8})\n",
        output_of(built(tmp_path, library, "selftest", *CC, "-O2", "-DHOPFORM_LIBM")),
    )
    assert found is not None
    assert found.group(1) != f"{selftest('float32'):08x}"
    assert found.group(2) != f"{selftest('float64'):08x}"


def test_the_golden_vectors_are_those_of_the_reference():
    """The first rows anew, to the last digit; `python -m tests.conformance.firmware.golden` writes them all."""
    assert headers.read("golden")[:1] == [golden.row(robot, start) for robot, start in cases.inputs()[:1]]


def test_every_number_of_a_table_is_in_its_header_to_the_last_bit():
    """Read back from the C: digits that were lost would show here alone, as programs allow for rounding."""
    for table, header in {"golden": headers.golden_h(), **dict.fromkeys(headers.VECTORS, headers.vectors_h())}.items():
        constants = {float(text) for text in re.findall(r"-?\b\d[\d.]*(?:e[-+]?\d+)?", header)}
        cells = " ".join(cell for row in headers.read(table) for cell in row.values()).replace(";", " ").split()
        numbers = {float(text) for text in cells if text not in headers.WORDS and "inf" not in text}
        assert len(numbers) > 50 and numbers <= constants, table


@pytest.mark.parametrize(
    ("flags", "why"), [(["-ffast-math"], "NaN"), (["-m32", "-mfpmath=387", "-mno-sse"], "FLT_EVAL_METHOD")]
)
def test_flags_that_would_break_it_are_refused_by_the_header(tmp_path, flags, why):
    """Preprocessed only: no libraries of that kind of processor are needed."""
    source = tmp_path / "one.c"
    source.write_text('#include "hopform/hopform.h"\n', "utf-8")
    command = [*CC, *flags, "-std=c99", "-ffreestanding", "-E", "-I", str(C / "include"), str(source)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert "#error" in done.stderr and why in done.stderr


@pytest.mark.parametrize("precision", ["f32", "f64"])
def test_every_public_function_and_struct_is_documented(precision):
    """A Doxygen comment stands right above; members say their unit or meaning behind."""
    text = (C / "include" / "hopform" / f"hopform_{precision}.h").read_text("utf-8")
    declared = list(re.finditer(r"^(?:u?int32_t|void) hopform_\w+\(|^typedef struct \{", text, re.MULTILINE))
    assert len(declared) > 30
    for match in declared:
        above = text[: match.start()].rstrip().rpartition("/**")[2]
        assert above.endswith("*/") and above.count("*/") == 1, match.group()
