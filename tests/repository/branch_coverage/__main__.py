"""`python -m tests.repository.branch_coverage` counts which branches of the generated C the tests take;
fewer than 95 % of firmware's fail.

The library is compiled by gcc without optimisation, with counters, and the tests that call C run on it: those in C as
programs, then those of pytest, and random motions of some models, for the headers that are the same text. A branch is
one way out of a condition, `&&`, `||` and `?:` included, as gcov lists them; one of a header that several files include
is taken if it is in any of them. `--untaken` lists the rest.
"""

import argparse
import gzip
import json
import os
import shutil
import subprocess
import sys
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

from hopform._solver.build import source_of
from tests.conformance.firmware.targets import BOARDS, COMMON, HERE, ROOT, C, run, tables

OUT = ROOT / "out" / "coverage"
LEAST = 95.0
INPUTS = 20_000
"""Pseudorandom inputs for each fuzzing target."""
MANY = ("-DDIGEST_ROBOTS=2500", "-DDIGEST_COMMANDS=500", "-DDIGEST_SAMPLES=4500")
"""Random robots, commands and contact samples of the digest."""

TESTS = ("bad_input", "batch", "batch_sensitivities", "chosen_columns", "control", "cube_root", "false_root", "flight",
         "flights", "forces", "grid", "hopping", "many_hops", "motions_over_time", "plant", "properties", "reachability", "selftest", "sensitivities",
         "single_precision_control", "stance", "stance_object", "start", "tangents", "ties", "touchdown")  # fmt: skip
MODELS, MOTIONS = ("leg_damper", "pogo", "servo"), 100
"""Of what the hopper lacks: a damper in the leg, for two masses and for one, and a law of the motor; motions of each draw."""
WORKSTATION = ("batch", "columns", "flights", "hops")
"""Batches over arrays, which firmware does not get."""

COUNTERS = """
void __gcov_dump(void);
void write_counts(void) { __gcov_dump(); }
"""

Branches = dict[str, dict[tuple[int, int], int]]
"""Counts by file, by line and place in it."""


@dataclass(frozen=True)
class Program:
    """Tests in C: their sources, what is defined, and what the program is given."""

    name: str
    sources: tuple[Path, ...]
    define: tuple[str, ...] = ()
    arguments: tuple[str, ...] = ()


def programs() -> list[Program]:
    """The selftest, the golden vectors, answers and their digests, garbage, refusals, pointers, fuzzing targets on
    fixed inputs.
    """
    board, fuzz = BOARDS / "board.c", ROOT / "tests" / "fuzz"
    found = [Program(name, (HERE / f"{name}.c", board)) for name in ("selftest", "golden")]
    found += [Program("answers", (HERE / "answers.c",)), Program("digests", (HERE / "digests.c", board), MANY)]
    inputs = (str(INPUTS), *map(str, sorted((fuzz / "found").iterdir())))
    for suffix, double, single in (("f32", (), ("-DSINGLE",)), ("f64", ("-DDOUBLE",), ())):
        for name in ("garbage", "refusals", "contract"):
            found.append(Program(f"{name}_{suffix}", (HERE / f"{name}.c", board), double))
        for entry in ("entry", "flight", "control", "reading", "plant"):
            sources = (fuzz / f"fuzz_{entry}.c", fuzz / "replay.c")
            found.append(Program(f"fuzz_{entry}_{suffix}", sources, (*single, "-DENTRY=4"), inputs))
    return found


def compile_library() -> Path:
    """The instrumented library, its objects beside it, and the programs that use them."""
    shutil.rmtree(OUT, ignore_errors=True)
    OUT.mkdir(parents=True)
    (OUT / "counters.c").write_text(COUNTERS, "utf-8")
    include = ["-I", str(C / "include"), "-I", str(C / "src"), "-I", str(BOARDS), "-I", str(tables())]
    flags = ["gcc", *COMMON, "-O0", "-g", "-fPIC", "--coverage", "-fprofile-update=atomic", *include]
    flags.append(f'-DHOPFORM_SOURCE="{source_of(C.parent)}"')
    objects = []
    for source in sorted((C / "src").glob("*.c")):
        objects.append(str(OUT / f"{source.stem}.o"))
        run([*flags, "-c", str(source), "-o", objects[-1]])
    library = OUT / "library.so"
    run(["gcc", "--coverage", "-shared", "-fPIC", str(OUT / "counters.c"), *objects, "-o", str(library), "-lm"])
    for program in programs():
        own = []
        for source in program.sources:
            own.append(str(OUT / f"{program.name}-{source.stem}.o"))
            run(
                [
                    "gcc",
                    "-std=c99",
                    "-D_GNU_SOURCE",
                    "--coverage",
                    *include,
                    *program.define,
                    "-c",
                    str(source),
                    "-o",
                    own[-1],
                ]
            )
        run(["gcc", "--coverage", *own, *objects, "-o", str(OUT / program.name), "-lm"])
    return library


def run_programs() -> None:
    for program in programs():
        run([str(OUT / program.name), *program.arguments], timeout=600)


def run_pytest(library: Path, jobs: str) -> None:
    environment = os.environ | {"HOPFORM_OTHER_LIBRARY": str(library)}
    files = [str(next(ROOT.glob(f"tests/*/test_{name}.py"))) for name in TESTS]
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-n",
        jobs,
        "--dist",
        "loadfile",
        "-p",
        "tests.other_library",
        *files,
    ]
    done = subprocess.run(command, cwd=ROOT, env=environment, check=False)
    if done.returncode:
        sys.exit("hopform: the tests are red on the instrumented library")


def run_motions() -> None:
    models = (text for name in MODELS for text in ("--model", name))
    command = [
        sys.executable,
        "-m",
        "tests.conformance.judge",
        str(MOTIONS),
        *models,
        "--most",
        "0",
        "--store",
        str(OUT),
    ]
    run([*command, "--cflags=-O0 -g --coverage"], cwd=ROOT, timeout=600)


def count() -> Branches:
    """Counts of all branches of the library's files; a condition that another model's facts change is the hopper's."""
    counts: Branches = defaultdict(lambda: defaultdict(int))
    sizes: dict[tuple[str, int], int] = {}
    for notes in sorted(OUT.glob("*.gcda")):
        run(["gcov", "--branch-probabilities", "--json-format", "--object-directory", str(OUT), str(notes)], cwd=OUT)
    library, others = (sorted(OUT.glob(f"{begins}*.gcov.json.gz")) for begins in ("[!j]", "judge_"))
    for path in (*library, *others):
        for file in json.loads(gzip.decompress(path.read_bytes()))["files"]:
            name = Path(file["file"])
            ours = C / "src" / name.name
            if name.parent.name != "src" or not ours.exists() or name.read_text("utf-8") != ours.read_text("utf-8"):
                continue
            for line in file["lines"]:
                number, branches = line["line_number"], line["branches"]
                if sizes.setdefault((name.name, number), len(branches)) == len(branches):
                    for place, branch in enumerate(branches):
                        counts[name.name][number, place] += branch["count"]
    return counts


def unit_of(name: str) -> tuple[str, str]:
    """`stance_f32.c`: `stance`, `f32`."""
    unit, _, precision = name.split(".", maxsplit=1)[0].rpartition("_")
    return unit, precision


def is_firmware(name: str) -> bool:
    return not unit_of(name)[0].startswith(WORKSTATION)


def table(counts: Branches) -> float:
    """Print a line per file; the least percentage of firmware's files together, over the two precisions."""
    totals: dict[str, list[int]] = defaultdict(lambda: [0, 0])
    print(f"{'file':34}{'branches':>9}{'taken':>8}{'%':>8}")
    for name, branches in sorted(counts.items(), key=lambda item: (not is_firmware(item[0]), item[0])):
        taken, all_of = sum(map(bool, branches.values())), len(branches)
        if not all_of:
            continue
        group = f"firmware, {unit_of(name)[1]}" if is_firmware(name) else "workstation"
        for key in {group, group.split(",", maxsplit=1)[0]}:
            totals[key][0] += taken
            totals[key][1] += all_of
        print(f"{name:34}{all_of:9}{taken:8}{100 * taken / all_of:8.1f}")
    for name, (taken, all_of) in sorted(totals.items()):
        print(f"{name:34}{all_of:9}{taken:8}{100 * taken / all_of:8.1f}")
    return min(100 * taken / all_of for name, (taken, all_of) in totals.items() if name.startswith("firmware"))


def untaken(counts: Branches) -> None:
    for name, branches in sorted(counts.items()):
        lines = (C / "src" / name).read_text("utf-8").splitlines()
        for number in sorted({line for (line, _), times in branches.items() if not times}):
            here = [bool(times) for (line, _), times in sorted(branches.items()) if line == number]
            print(f"{name}:{number}: {''.join('.x'[not taken] for taken in here)} {lines[number - 1].strip()}")


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.repository.branch_coverage", description=__doc__)
    parser.add_argument("--untaken", action="store_true", help="list the lines with branches that are not taken")
    parser.add_argument("--again", action="store_true", help="the counts of the run before")
    parser.add_argument("--jobs", default="auto")
    chosen = parser.parse_args()
    if not chosen.again:
        library = compile_library()
        run_programs()
        run_pytest(library, chosen.jobs)
        run_motions()
    counts = count()
    if chosen.untaken:
        untaken({name: branches for name, branches in counts.items() if is_firmware(name)})
    least = table(counts)
    print(f"{least:.1f} % of the branches, in the precision with fewer; {LEAST} asked for")
    return int(least < LEAST)


if __name__ == "__main__":
    raise SystemExit(main())
