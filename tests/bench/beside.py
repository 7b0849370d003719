"""Beside the table of peers: the paper's sequence by hand, many stances at once, a sample of a grid, memory.

A line is a name, a number and its unit, and the ratio to hopform's C loop over the same stances where there is one.
Whatever is compared is timed in one run, interleaved, by the processor's time.
"""

import dataclasses
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import hopform
import hopform.hopping
from hopform_solver import records
from tests.bench import native, truth
from tests.bench.jobs import ROBOT, Jobs, hopper_c, random_robots
from tests.bench.verdicts import assess

MANY, FEW, SAMPLES = 100_000, 10_000, 10_000
PAPER = ["x2_reverses"]
MEMORY = """
import sys
from pathlib import Path
import numpy as np
import hopform
def peak():
    (line,) = [line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM:")]
    return int(line.split()[1]) * 1024
robot = hopform.load_robot("hopper_c")
count = int(sys.argv[1])
before = peak()
batch = hopform.solve_stances(robot, v2=np.linspace(-3.0, -0.3, count), u=np.linspace(-3.0, 3.0, count))
print(before, peak())
"""


@dataclass(frozen=True)
class Line:
    """A measured number; `ratio` to the C loop over the same stances, None where there is none."""

    name: str
    value: float
    unit: str
    ratio: float | None = None


def medians(calls: Mapping[str, Callable[[], object]], repetitions: int) -> dict[str, float]:
    """The median time of each call in s, all interleaved; the first round is not counted."""
    times: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(repetitions + 1):
        for name, call in calls.items():
            begin = time.process_time()
            call()
            times[name].append(time.process_time() - begin)
    return {name: statistics.median(each[1:]) for name, each in times.items()}


# ---- by hand ----


def paper_sequence() -> tuple[Jobs, list[dict[str, Any]]]:
    """Those stances of hopper_c in which the actuator goes up throughout and the body turns once, and their truth."""
    jobs, exact = hopper_c(), truth.load()["hopper_c"]
    chosen = [
        n
        for n in range(len(jobs))
        if exact[n]["status"] == "takeoff"
        and [kind for _, kind in exact[n]["events"]] == PAPER
        and {phase.mode_1 for phase in hopform.solve_stance(hopform.Robot(**jobs.robot(n)), **jobs.start(n)).phases}
        == {1}
    ]
    return dataclasses.replace(jobs, table=jobs.table[chosen]), [exact[n] for n in chosen]


def by_hand(repetitions: int) -> list[Line]:
    """The paper's closed form written by hand, and hopform on the same stances; native.NotBuilt without a compiler."""
    jobs, exact = paper_sequence()
    hand, ours = native.by_hand(), native.hopform("f64")
    calls = {"hand": hand.function("by_hand", jobs), "hopform": ours.function("planned", jobs)}
    hand.prepare(jobs)
    ours.prepare(jobs)
    verdicts = {name: assess(jobs, call(1), exact) for name, call in calls.items()}
    loops = max(1, 20_000 // len(jobs))
    spent = medians({name: lambda call=call: call(loops) for name, call in calls.items()}, repetitions)
    of = f"paper's sequence, {len(jobs)} stances of hopper_c"
    words = {"hand": "closed form by hand, C++, no event but these", "hopform": "hopform C, f64"}
    return [
        Line(
            f"{words[name]}: {of}, error {verdicts[name].error:.0e}, wrong {verdicts[name].wrong}",
            each / (loops * len(jobs)) * 1e6,
            "us/stance",
            each / spent["hopform"],
        )
        for name, each in spent.items()
    ]


# ---- many ----


def _inputs(jobs: Jobs, count: int) -> tuple[hopform.Robot, dict[str, Any]]:
    """The stances over and over, as columns; one robot for all of them where they have one."""
    table = np.resize(jobs.table, (count, jobs.table.shape[1]))
    inputs = dict(zip((*ROBOT, "x1", "v1", "v2", "u"), table.T.copy(), strict=True))
    robot = hopform.Robot(**jobs.robot(0))
    if (jobs.table[:, : len(ROBOT)] == jobs.table[0, : len(ROBOT)]).all():
        inputs = {name: values for name, values in inputs.items() if name not in ROBOT}
    return robot, inputs


def many(jobs: Jobs, repetitions: int) -> list[Line]:
    """`solve_stances` in both precisions, beside the C loop over the same stances."""
    library = native.hopform("f64")
    loop = library.function("planned", jobs)
    library.prepare(jobs)
    robot, inputs = _inputs(jobs, MANY)
    _, fewer = _inputs(jobs, FEW)
    one_robot = ROBOT[0] not in inputs
    variants: dict[str, tuple[int, Callable[[], object]]] = {
        "the C loop, f64": (10 * len(jobs), lambda: loop(10)),
    }
    for dtype in (np.float64, np.float32):
        short = {np.float64: "f64", np.float32: "f32"}[dtype]
        variants[f"solve_stances, C {short}, {MANY} at once"] = (
            MANY, lambda dtype=dtype: hopform.solve_stances(robot, **inputs, dtype=dtype),
        )  # fmt: skip
        variants[f"solve_stances, C {short}, {FEW}, events"] = (
            FEW, lambda dtype=dtype: hopform.solve_stances(robot, **fewer, dtype=dtype, events=True),
        )  # fmt: skip
        variants[f"solve_stances, C {short}, {FEW}, sensitivities"] = (
            FEW,
            lambda dtype=dtype: hopform.solve_stances(robot, **fewer, dtype=dtype, sensitivities=True),
        )  # fmt: skip
    spent = medians({name: call for name, (_, call) in variants.items()}, repetitions)
    each = {name: spent[name] / count for name, (count, _) in variants.items()}
    first = each["the C loop, f64"]
    note = "" if one_robot else ", plans included but for the loop"
    return [
        Line(f"{jobs.name}: {name}{note}", seconds * 1e6, "us/stance", seconds / first)
        for name, seconds in each.items()
    ]


# ---- a grid, memory ----


def grid(repetitions: int) -> list[Line]:
    """States of one stance on a uniform grid, per sample of four."""
    stance = hopform.solve_stance(hopform.load_robot("hopper_c"), v2=-1.93, u=3.0)
    out = hopform.State(*np.empty((4, SAMPLES)))
    solver_out = records.LegState(*np.empty((4, SAMPLES)))
    step = stance.duration / (SAMPLES - 1)
    t = np.linspace(0.0, stance.duration, SAMPLES)

    def often(call: Callable[[], object]) -> Callable[[], None]:
        return lambda: [call() for _ in range(50)] and None

    spent = medians(
        {
            "hopform_stance_grid": often(lambda: stance._solved.grid(step, solver_out)),
            "stance.grid, with t and x2": often(lambda: stance.grid(SAMPLES, out=out)),
            "stance.at of as many times": often(lambda: stance.at(t)),
        },
        repetitions,
    )
    return [
        Line(f"{name}, {SAMPLES} samples", seconds / (50 * SAMPLES) * 1e9, "ns/sample")
        for name, seconds in spent.items()
    ]


def memory(count: int = 1_000_000) -> list[Line]:
    """The peak of a process that solves a batch without event lists, measured in a child of its own;
    needs Linux's /proc.
    """
    if not Path("/proc/self/status").exists():
        raise native.NotBuilt("the memory of a batch: there is no /proc here")
    done = subprocess.run(
        [sys.executable, "-c", MEMORY, str(count)], capture_output=True, text=True, check=True, cwd=native.ROOT
    )
    before, after = map(int, done.stdout.split())
    return [
        Line(f"memory of a process that solves {count} stances, peak", after / 2**20, "MiB"),
        Line("of which Python, NumPy and the library before", before / 2**20, "MiB"),
    ]


def hopping(repetitions: int) -> list[Line]:
    """Flights, control solves, runs of 1000 hops on rough ground and a map of 200 x 200, interleaved;
    ratios to a stance in C.
    """
    jobs, library = hopper_c(), native.hopform("f64")
    stances, flights = (library.function(name, jobs) for name in ("planned", "only_flight"))
    library.prepare(jobs)
    robot, ground = hopform.load_robot("hopper_c"), hopform.hopping.terrain.uniform(1000, 0.02, seed=3)
    exact, axis = hopform.hopping.controllers.FeedForward(0.2), np.linspace(0.02, 0.35, 200)
    takeoff = hopform.solve_stance(robot, v2=hopform.touchdown_velocity(robot, 0.2), u=3.0).end._asdict()
    speeds = np.linspace(-2.2, -1.6, 100).tolist()
    calls: dict[str, tuple[int, Callable[[], object]]] = {
        "a stance, C loop": (10 * len(jobs), lambda: stances(10)),
        "a flight, C loop": (10 * len(jobs), lambda: flights(10)),
        "a flight, solve_flight from Python": (
            100, lambda: [hopform.solve_flight(robot, **takeoff) for _ in range(100)],
        ),
        "a current, choose_current from Python": (
            len(speeds), lambda: [hopform.choose_current(robot, v2=v2, h_des=0.2) for v2 in speeds],
        ),
        "a hop under the exact controller, of 1000 on rough ground": (
            len(ground), lambda: hopform.hopping.simulate(robot, ground, exact, height=0.2),
        ),
        "a hop at a constant current, of 1000 on rough ground": (
            len(ground), lambda: hopform.hopping.simulate(robot, ground, 3.0, height=0.2),
        ),
        "a cell of a map, reachability of 200 x 200": (
            axis.size**2, lambda: hopform.reachability(robot, axis, np.linspace(-3.0, 3.0, axis.size)),
        ),
    }  # fmt: skip
    spent = medians({name: call for name, (_, call) in calls.items()}, repetitions)
    each = {name: spent[name] / count for name, (count, _) in calls.items()}
    first = each["a stance, C loop"]
    return [Line(f"hopping: {name}", seconds * 1e6, "us", seconds / first) for name, seconds in each.items()]


def measure(repetitions: int) -> list[Line]:
    """Every line; what cannot be built is left out."""
    lines: list[Line] = []
    for part in (
        lambda: by_hand(repetitions), lambda: many(hopper_c(), repetitions), lambda: many(random_robots(), repetitions),
        lambda: grid(repetitions), memory, lambda: hopping(repetitions),
    ):  # fmt: skip
        try:
            lines += part()
        except native.NotBuilt as error:
            lines.append(Line(f"left out: {error}", float("nan"), ""))
    return lines
