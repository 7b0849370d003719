"""What a stance costs in a batch, against one C call per stance: `python -m tests.bench.lanes [--instructions]`.

For each variant and precision: 1024 currents on one robot, and random robots of all orders of magnitude, as ratios of
processor times in one run. With valgrind also instructions a stance, but for AVX-512, which valgrind does not know.
"""

import argparse
import os
import re
import shlex
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import hopform
from hopform._solver import library as libraries
from hopform_solver.records import ROBOT_FIELDS
from tests.conformance.random_stances import draw_stances
from tools.build_library import FLAGS, ROOT

COUNT = 1024
MANY = 8192
ROUNDS = 25
NAMES = [field.name for field in ROBOT_FIELDS]
STATES = ("x1", "v1", "v2", "y", "u", "horizon")
VARIANTS = {"one C call each": 0, "one by one": 1, "baseline": 2, "AVX2": 3, "AVX-512": 4}
REALS = {"f64": ("double", np.float64), "f32": ("float", np.float32)}


@dataclass(frozen=True)
class Job:
    """Stances and whether they have one robot."""

    name: str
    problems: Any
    same: bool


def jobs() -> list[Job]:
    currents = draw_stances(0, COUNT)
    robot = hopform.load_robot("hopper_c")
    for name in NAMES:
        currents[name] = getattr(robot, name)
    for name, value in {"x1": 0.0, "v1": 0.0, "v2": -1.93, "y": 0.0, "horizon": 2.0}.items():
        currents[name] = value
    currents["u"] = np.linspace(0.0, 3.0, COUNT)
    return [
        Job(f"{COUNT} currents on hopper_c", currents, True),
        Job(f"{MANY} random robots", draw_stances(1, MANY), False),
    ]


def driver(folder: Path, precision: str) -> Path:
    """The program around the compiled library."""
    program = folder / f"lanes_{precision}"
    compiler = shlex.split(os.environ.get("CC") or "cc")
    flags = [flag for flag in FLAGS if flag not in ("-shared", "-fPIC") and not flag.startswith("-std")]
    macros = [f"-DREAL={REALS[precision][0]}", f"-DSUFFIX=_{precision}"]
    source = Path(__file__).with_name("lanes.c")
    command = [*compiler, "-std=gnu99", *flags, *macros, "-I", str(ROOT / "generated" / "c" / "include"), str(source)]
    library = libraries.LIBRARY
    command += [str(library), f"-Wl,-rpath,{library.parent}", "-o", str(program), "-lm"]
    subprocess.run(command, check=True)
    return program


def write(folder: Path, job: Job, precision: str) -> Path:
    path = folder / f"{len(job.problems)}_{precision}.bin"
    with path.open("wb") as file:
        for name in (*NAMES, *STATES):
            file.write(job.problems[name].astype(REALS[precision][1]).tobytes())
    return path


def arguments(path: Path, job: Job, rounds: int, variant: int) -> list[str]:
    return [str(path), str(len(job.problems)), str(rounds), str(int(job.same)), str(variant)]


def nanoseconds(program: Path, path: Path, job: Job, variant: int) -> float | None:
    """Least time a stance, None if the processor lacks the variant."""
    done = subprocess.run(
        [program, *arguments(path, job, ROUNDS, variant)], capture_output=True, text=True, check=False
    )
    return float(done.stdout) if done.returncode == 0 else None


def instructions(program: Path, path: Path, job: Job, variant: int) -> float | None:
    """Instructions a stance: those of a run with one round less those of a run with none; None without valgrind."""
    if shutil.which("valgrind") is None or variant == VARIANTS["AVX-512"]:
        return None
    counts = []
    for rounds in (1, 0):
        command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", str(program)]
        done = subprocess.run(
            [*command, *arguments(path, job, rounds, variant)], capture_output=True, text=True, check=False
        )
        found = re.search(r"Collected : (\d+)", done.stderr)
        if done.returncode != 0 or found is None:
            return None
        counts.append(int(found.group(1)))
    return (counts[0] - counts[1]) / len(job.problems)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--instructions", action="store_true", help="count instructions with valgrind, too")
    counts = parser.parse_args().instructions
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for precision in REALS:
            program = driver(folder, precision)
            for job in jobs():
                report(program, write(folder, job, precision), job, precision, counts)


def report(program: Path, path: Path, job: Job, precision: str, counts: bool) -> None:
    print(f"{job.name}, {precision}")
    single = nanoseconds(program, path, job, 0)
    assert single is not None
    for variant, number in VARIANTS.items():
        spent = single if number == 0 else nanoseconds(program, path, job, number)
        if spent is None:
            print(f"  {variant:<16} not on this processor")
            continue
        count = instructions(program, path, job, number) if counts else None
        shown = "" if count is None else f"{count:10.0f} instructions"
        print(f"  {variant:<16} {spent:8.0f} ns a stance {spent / single:7.3f} of one C call{shown}")


if __name__ == "__main__":
    main()
