"""Programs in C on the library: refusals, pointers, garbage, reference vectors,
arbitrary inputs under the sanitizers.
"""

import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from tests import needs
from tests.conformance.firmware import headers, vectors
from tests.conformance.firmware.targets import BOARDS, COMMON, HERE, ROOT, C, sources, tables
from tests.conformance.test_selftest import CC, COMPILERS
from tests.objects import compiled, run_compiler

FUZZ = ROOT / "tests" / "fuzz"
CHECKS = (
    "-O1",
    "-g1",
    "-fsanitize=address,undefined,float-cast-overflow,float-divide-by-zero",
    "-fno-sanitize-recover=all",
)
DEFINE = {"f32": "-DSINGLE", "f64": "-DDOUBLE"}


INCLUDE = ["-I", str(C / "include"), "-I", str(C / "src"), "-I", str(BOARDS)]


@pytest.fixture
def built(store, tmp_path) -> Callable[..., Path]:
    """A program under the sanitizers, with the library in a precision, which is compiled once for all of them."""

    def program(precision: str, own: list[Path], *flags: str, more: tuple[str, ...] = ()) -> Path:
        image, command = tmp_path / f"{own[0].stem}_{precision}", (*CC, *COMMON, *CHECKS)
        library = [*sources((precision,)), *(C / "src" / f"{unit}_{precision}.c" for unit in more)]
        objects = [compiled(store, command, source) for source in library]
        run_compiler(*command, "-D_GNU_SOURCE", DEFINE[precision], *flags, *INCLUDE, *own, *objects, "-o", image, "-lm")
        return image

    return program


def output_of(image: Path, *arguments: str) -> str:
    done = subprocess.run([image, *arguments], capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


@pytest.mark.parametrize("precision", needs.the_first([*DEFINE]))
@pytest.mark.parametrize("program", needs.the_first(["contract", "garbage", "refusals"], 0))
def test_bad_input_is_refused_by_name_and_leaves_safe_outputs(built, program, precision):
    image = built(precision, [HERE / f"{program}.c", BOARDS / "board.c"])
    assert output_of(image).endswith("wrong 0\n")


@pytest.mark.sliced
@pytest.mark.parametrize("precision", DEFINE)
def test_batches_keep_their_contract_and_give_the_bits_of_stances_one_by_one(built, precision):
    for program in ("contract_batches", "batches"):
        own = [ROOT / "tests" / "conformance" / f"{program}.c"]
        assert output_of(built(precision, own, more=("batch", "flights"))).endswith("wrong 0\n")


@pytest.mark.sliced
@pytest.mark.parametrize("precision", DEFINE)
def test_runs_of_hops_keep_their_contract_and_give_the_bits_of_flights_and_stances_in_turn(built, precision):
    own = [ROOT / "tests" / "conformance" / "hops.c"]
    assert output_of(built(precision, own, more=("hops",))).endswith("wrong 0\n")


VALGRIND = pytest.mark.skipif(
    not shutil.which("valgrind"), reason="valgrind is absent (on Debian: apt install valgrind)"
)


@pytest.mark.nightly
@VALGRIND
@pytest.mark.parametrize("robots", ["one", "random"])
def test_a_hop_of_a_run_takes_at_most_two_and_a_half_times_the_instructions_of_its_stance(tmp_path, robots):
    image, own = tmp_path / "cost", ROOT / "tests" / "conformance" / "cost_of_hops.c"
    library = [*sources(("f64",)), *(C / "src" / f"{unit}_f64.c" for unit in ("batch", "hops"))]
    run_compiler(*CC, *COMMON, "-O2", *INCLUDE, own, *library, "-o", image, "-lm")

    def instructions(function: str) -> int:
        count = ("--tool=callgrind", "--callgrind-out-file=/dev/null", f"--toggle-collect=hopform_{function}_f64")
        whole = ["valgrind", *count, str(image), str(int(robots == "random"))]
        done = subprocess.run(whole, capture_output=True, text=True, check=True, timeout=600)
        assert int(done.stdout) > 10_000
        return int(re.search(r"Collected : (\d+)", done.stderr)[1])

    assert 1.2 * (stances := instructions("solve_stances")) < instructions("solve_hops") <= 2.5 * stances


def test_the_programs_about_pointers_call_every_public_function():
    header = (C / "include" / "hopform" / "hopform_f64.h").read_text("utf-8")
    functions = set(re.findall(r"^\w+ \*?hopform_(\w+)_f64\(", header, re.MULTILINE))
    assert {"plan_init", "stance_grid", "solve_stances", "selftest"} <= functions
    here = ROOT / "tests" / "conformance"
    programs = (HERE / "contract.c", here / "contract_batches.c", here / "hops.c")
    called = {name for program in programs for name in re.findall(r"OF\((\w+)\)[(,]", program.read_text("utf-8"))}
    assert not functions - called


@pytest.mark.sliced
@pytest.mark.parametrize("compiler", COMPILERS, ids=" ".join)
def test_answers_are_those_of_the_reference_and_obey_what_any_must(store, tmp_path, compiler):
    command = (*compiler, "-O2", *COMMON)
    library = [compiled(store, command, path) for path in sources(("f64",))]
    run_compiler(
        *command,
        "-D_GNU_SOURCE",
        *INCLUDE,
        "-I",
        tables(),
        HERE / "answers.c",
        *library,
        "-o",
        tmp_path / "answers",
        "-lm",
    )
    assert output_of(tmp_path / "answers", "aloud").endswith("wrong 0\n")


@pytest.mark.sliced
def test_answers_notice_a_constant_that_is_off(tmp_path):
    """It can fail: the Coulomb friction of the body counts a hundred-thousandth more."""
    shutil.copytree(C / "src", tmp_path / "src")
    formulas = tmp_path / "src" / "formulas_f64.h"
    text = formulas.read_text("utf-8")
    assert text.count("- f2*side_2") > 0
    formulas.write_text(text.replace("- f2*side_2", "- 1.00001*f2*side_2"), "utf-8")
    files = [str(tmp_path / "src" / path.name) for path in sources(("f64",))]
    include = ["-I", str(C / "include"), "-I", str(tmp_path / "src"), "-I", str(tables())]
    image = tmp_path / "answers"
    subprocess.run(
        [*CC, *COMMON, "-O1", *include, str(HERE / "answers.c"), *files, "-o", str(image), "-lm"], check=True
    )
    assert subprocess.run([image], check=False, timeout=60).returncode == 1


@pytest.mark.sliced
@pytest.mark.parametrize("precision", [*DEFINE])
@pytest.mark.parametrize("entry", ["3", "4", "flight", "control", "reading", "plant"])
def test_arbitrary_inputs_get_answers_within_bounds(built, entry, precision):
    """What `make fuzz` looks for, on what it found before and on a fixed draw: nothing undefined, no endless search."""
    target = FUZZ / f"fuzz_{entry}.c" if entry.isalpha() else FUZZ / "fuzz_entry.c"
    image = built(precision, [target, FUZZ / "replay.c"], f"-DENTRY={entry}")
    found = sorted((FUZZ / "found").iterdir())
    assert len(found) >= 10
    output_of(image, "4000", *map(str, found))


def test_the_vectors_are_those_of_the_reference():
    """The first rows anew, to the last digit; `python -m tests.conformance.firmware.vectors` writes them all."""
    anew = [vectors.stance_row(robot, start) for robot, start in vectors.stance_inputs()[:1]]
    assert headers.read("stances")[:1] == anew
    assert headers.read("flights")[:1] == [vectors.flight_row(0)]
    assert headers.read("commands")[:1] == [next(vectors.command_rows())]
