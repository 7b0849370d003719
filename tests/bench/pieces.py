"""hopform alone: what a plan, a stance, a state, an energy ledger and a flight cost, in instructions and in time."""

import re
import shutil
import statistics
import subprocess
import time
from dataclasses import dataclass

import numpy as np

from tests.bench import native
from tests.bench.jobs import Jobs

SAMPLES = 100
# Function, entry of the driver, its number there, calls per job when instructions are counted, calls per job when
# timed.
PIECES = (
    ("plan_init", "only_plan", 0, 2, 1),
    ("solve_stance", "planned", 1, 2, 1),
    ("stance_at", "only_at", 2, SAMPLES, SAMPLES),
    ("stance_energy", "only_energy", 3, 1, 1),
    ("solve_flight", "only_flight", 4, 1, 1),
)


@dataclass(frozen=True)
class Piece:
    """A function of the C library on one set: instructions per call, None without valgrind, and nanoseconds."""

    function: str
    instructions: float | None
    nanoseconds: float


def _instructions(precision: str, jobs: Jobs, function: str, number: int, calls: int) -> float | None:
    """Instructions per call within a function, counted by callgrind; the same on a busy machine."""
    if not shutil.which("valgrind"):
        return None
    program = native.hopform_driver(precision, count_instructions=True)
    command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null"]
    command += [f"--toggle-collect=hopform_{function}_{precision}", str(program), str(number)]
    done = subprocess.run(command, input=np.ascontiguousarray(jobs.table).tobytes(), capture_output=True, check=False)
    found = re.search(rb"Collected : (\d+)", done.stderr)
    return int(found[1]) / (calls * len(jobs)) if found else None


def _nanoseconds(precision: str, jobs: Jobs, entry: str, calls: int, repetitions: int) -> float:
    library = native.hopform(precision)
    call = library.function(entry, jobs)
    library.prepare(jobs)
    loops, taken = 20, []
    for _ in range(repetitions):
        begin = time.process_time()
        call(loops)
        taken.append((time.process_time() - begin) / (loops * calls * len(jobs)) * 1e9)
    return statistics.median(taken)


def pieces(precision: str, jobs: Jobs, repetitions: int) -> tuple[Piece, ...]:
    """Every piece on a set of jobs; native.NotBuilt without a compiler."""
    return tuple(
        Piece(
            function,
            _instructions(precision, jobs, function, number, counted),
            _nanoseconds(precision, jobs, entry, timed, repetitions),
        )
        for function, entry, number, counted, timed in PIECES
    )
