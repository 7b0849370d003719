"""What many stances cost: `python tests/bench/batch.py`, a C compiler needed.

One run, one thread, one job: the stances of hopper_c over 1e5 touchdown velocities. Each time is the least of a few
rounds.
"""

import os
import platform
import shlex
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import hopform
from derive.emit.facts import FLAGS
from hopform._solver import library as libraries
from tools.build_library import ROOT

COUNT = 100_000
ROUNDS = 5

SOURCE = """
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include "hopform/hopform.h"

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

enum { COUNT = %(count)d, SAMPLES = 10000, ROUNDS = %(rounds)d };

#define COLUMN(p) {(p), sizeof *(p)}
#define SAME(p) {(p), 0}

static double single[ROUNDS], batch[ROUNDS], grid[ROUNDS];
static double v2[COUNT], duration[COUNT], apex[COUNT], aed[COUNT], e1[COUNT], e2[COUNT], e3[COUNT], e4[COUNT];
static int status[COUNT], events[COUNT];
static double x1s[SAMPLES], v1s[SAMPLES], v2s[SAMPLES], ys[SAMPLES];

static double least(const double *times)
{
    double t = times[0];
    for (int n = 1; n < ROUNDS; n++) t = times[n] < t ? times[n] : t;
    return t;
}

int main(void)
{
    const hopform_robot_f64 robot = {%(robot)s};
    const double zero = 0.0, u = 2.0, horizon = 2.0;
    hopform_plan_f64 plan;
    hopform_phase_f64 phases[64];
    hopform_stance_f64 stance;
    const hopform_step_f64 step = {0.0, 2.0};
    hopform_plan_init_f64(&plan, &robot);
    for (int i = 0; i < COUNT; i++) v2[i] = -3.0 + 2.0 * i / (COUNT - 1.0);
    hopform_stances_in_f64 in = {.x1 = SAME(&zero), .v1 = SAME(&zero), .v2 = COLUMN(v2), .y = SAME(&zero),
                                 .u = SAME(&u), .horizon = SAME(&horizon), .max_phases = 4096};
    for (int n = 0; n < HOPFORM_ROBOT_FIELDS; n++) {
        in.robot[n].first = (const double *)&robot + n;
        in.robot[n].stride = 0;
    }
    hopform_stances_out_f64 out = {.status = COLUMN(status), .duration = COLUMN(duration), .x1 = COLUMN(e1),
        .v1 = COLUMN(e2), .x2 = COLUMN(e3), .v2 = COLUMN(e4), .apex = COLUMN(apex), .aed = COLUMN(aed),
        .event_count = COLUMN(events)};
    double sum = 0.0;
    for (int n = 0; n < ROUNDS; n++) {
        double start = now();
        for (int i = 0; i < COUNT; i++) {
            const hopform_state_f64 state = {0.0, 0.0, v2[i], 0.0};
            hopform_solve_stance_f64(&plan, &state, &step, 1, 2.0, 4096, phases, 64, &stance);
            sum += stance.duration;
        }
        single[n] = (now() - start) / COUNT;
        start = now();
        hopform_solve_stances_f64(COUNT, &in, &out);
        batch[n] = (now() - start) / COUNT;
        start = now();
        for (int k = 0; k < 20; k++)
            hopform_stance_grid_f64(&plan, &step, phases, &stance, 0.0, stance.duration / (SAMPLES - 1), SAMPLES,
                                    (double *const[]){x1s, v1s, v2s, ys});
        grid[n] = (now() - start) / (20.0 * SAMPLES);
        sum += ys[SAMPLES / 2] + duration[COUNT / 2];
    }
    fprintf(stderr, "%%g\\n", sum);
    printf("%%.17g %%.17g %%.17g\\n", least(single), least(batch), least(grid));
    return 0;
}
"""


def in_c(robot: hopform.Robot) -> tuple[float, float, float]:
    """Seconds per stance one by one and as a batch, and per sample of a grid of 10 000, by the compiled library."""
    c = ROOT / "generated" / "c"
    numbers = ", ".join(repr(value).replace("inf", "1e999") for value in robot.parameters)
    with tempfile.TemporaryDirectory() as folder:
        source, program = Path(folder) / "batch.c", Path(folder) / "batch"
        source.write_text(SOURCE % {"count": COUNT, "rounds": ROUNDS, "robot": numbers})
        compiler = shlex.split(os.environ.get("CC") or "cc")
        flags = [flag for flag in FLAGS if flag not in ("-shared", "-fPIC") and not flag.startswith("-std")]
        command = [*compiler, "-std=gnu99", *flags, "-I", str(c / "include"), str(source), str(libraries.LIBRARY)]
        command += [f"-Wl,-rpath,{libraries.LIBRARY.parent}", "-o", str(program), "-lm"]
        subprocess.run(command, check=True)
        done = subprocess.run([str(program)], check=True, capture_output=True, text=True)
    single, batch, grid = map(float, done.stdout.split())
    return single, batch, grid


def least(call: Callable[[], object], rounds: int = ROUNDS) -> float:
    """The least time of a call in s."""
    times: list[float] = []
    for _ in range(rounds):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return min(times)


def main() -> None:
    robot = hopform.load_robot("hopper_c")
    v2 = np.linspace(-3.0, -1.0, COUNT)
    one = hopform.solve_stance(robot, v2=-1.93, u=2.0)
    single, batch, grid = in_c(robot)
    print(
        f"{platform.machine()}, {platform.python_implementation()} {platform.python_version()}, NumPy {np.__version__}"
    )
    rows: list[tuple[str, float, str]] = [("C, one stance after the other, events kept", single, "stance")]
    rows.append(("C, hopform_solve_stances", batch, "stance"))
    for label, how in (("", {}), (", events=True", {"events": True})):
        for dtype in (np.float64, np.float32):
            name = f"solve_stances{label}, {np.dtype(dtype)}"
            spent = least(lambda how=how, dtype=dtype: hopform.solve_stances(robot, v2=v2, u=2.0, dtype=dtype, **how))
            rows.append((name, spent / COUNT, "stance"))
    k = np.linspace(1000.0, 1500.0, COUNT)
    spent = least(lambda: hopform.solve_stances(robot, v2=v2, u=2.0, k=k))
    rows.append(("solve_stances, another robot each", spent / COUNT, "stance"))
    spent = least(lambda: [hopform.solve_stance(robot, v2=float(v), u=2.0) for v in v2[:2000]], 3)
    rows.append(("solve_stance from Python", spent / 2000, "stance"))
    for name, spent, unit in rows:
        print(f"{name:<44} {1e9 * spent:10.1f} ns a {unit}  {spent / single:6.2f} x C one by one")
    print(f"{'C, hopform_stance_grid, 10 000 samples':<44} {1e9 * grid:10.2f} ns a sample")
    out = hopform.State(*np.empty((4, 10_000)))
    spent = least(lambda: one.grid(10_000, out=out), 50)
    print(f"{'stance.grid, 10 000 samples, with x2 and t':<44} {1e5 * spent:10.2f} ns a sample")


if __name__ == "__main__":
    main()
