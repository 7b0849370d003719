"""One fit of a free decay, three ways: `python -m tests.bench.identification`.

The same least squares of scipy from the same start, on the residuals of hopform with their exact Jacobian, on those of
a chain of matrix exponentials with bracketed reversals, and on those of `solve_ivp` restarted at every reversal, both
with a Jacobian by differences. All must come to the same parameters. Then what whole fits take, with all that they say.
"""

import math
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq, least_squares

import hopform
from hopform.identify._drop import fit_drop_test
from hopform.identify._held import HELD
from hopform.identify._joint import fit_robot
from hopform.identify._kinds import Cut
from hopform.identify._motion import Array
from hopform.identify._synthetic import record

LETTERS = ("k", "b2", "f2", "rest", "x", "v")
MASS = 3.0
START = np.array([1100.0, 4.0, 0.5, 0.0, -0.038, 0.0])
SCALE = np.array([1000.0, 5.0, 1.0, 0.01, 0.01, 0.1])
Predict = Callable[[NDArray[np.float64]], Array]


def chain(
    p: Array, times: Array, advance: Callable[[Array, float, float, Array, Array], tuple[Array, float, Array]]
) -> Array:
    """x over time: slip one way after the other until the spring no longer overcomes friction."""
    k, _, f, rest = p[:4]
    z, begin, out, done = np.array([p[4] - rest, p[5]]), 0.0, np.empty(times.size), 0
    side = math.copysign(1.0, z[1] if z[1] != 0.0 else -z[0])
    while done < times.size:
        if z[1] == 0.0:
            if abs(k / MASS * z[0]) <= f:
                out[done:] = z[0]
                break
            side = -math.copysign(1.0, z[0])
        z, end, found = advance(z, begin, side, times[done:], p)
        out[done : done + found.size] = found
        done, begin = done + found.size, end
    return out + rest


def by_expm(p: Array, times: Array) -> Array:
    """Each half swing as exp(M t), its end bracketed on the samples."""

    def advance(z: Array, begin: float, side: float, left: Array, p: Array) -> tuple[Array, float, Array]:
        shift = -side * p[2] * MASS / p[0]
        m = np.array([[0.0, 1.0], [-p[0] / MASS, -p[1] / MASS]])
        start = np.array([z[0] - shift, z[1]])
        found = list[float]()
        last = 0.0
        for t in left - begin:
            at = expm(m * t) @ start
            if side * at[1] < 0.0:
                end = brentq(lambda s: float((expm(m * s) @ start)[1]), max(last, 1e-9), t, xtol=1e-13)
                stop = expm(m * end) @ start
                return np.array([stop[0] + shift, 0.0]), begin + end, np.array(found)
            found.append(float(at[0]) + shift)
            last = t
        return z, begin, np.array(found)

    return chain(p, times, advance)


def by_solve_ivp(p: Array, times: Array) -> Array:
    """Each half swing by DOP853, rtol 1e-9, up to the event v = 0."""

    def advance(z: Array, begin: float, side: float, left: Array, p: Array) -> tuple[Array, float, Array]:
        def rate(_: float, y: Array) -> list[float]:
            return [y[1], (-p[0] * y[0] - p[1] * y[1]) / MASS - side * p[2]]

        def stops(_: float, y: Array) -> float:
            return side * y[1]

        stops.terminal, stops.direction = True, -1.0  # type: ignore[attr-defined]
        made = solve_ivp(
            rate, (begin, left[-1]), z, "DOP853", t_eval=left, events=stops, rtol=1e-9, atol=1e-12, first_step=1e-4
        )  # fmt: skip
        if made.status == 1:
            return np.array([made.y_events[0][0][0], 0.0]), float(made.t_events[0][0]), made.y[0]
        return z, begin, made.y[0]

    return chain(p, times, advance)


def whole_fits() -> None:
    """What whole fits take, with intervals, the old model and the hold-out, of recordings of 2 s."""
    hopper = hopform.load_robot("hopper_c")
    jobs: dict[str, Callable[[float], object]] = {
        "drop": lambda f: fit_drop_test(record(hopper, "drop", rate=f, seed=1), known={"m_s": MASS}),
        "decay": lambda f: fit_robot(decays=record(hopper, "decay", rate=f, height=0.04, seed=5), known={"m_s": MASS}),
        "step": lambda f: fit_robot(steps=record(hopper, "step", rate=f, seed=2), known={"m_eff": 25.0}),
        "free drop": lambda f: fit_drop_test(
            record(hopper, "free", rate=f, seed=4), free=True, known={"m_s": MASS, "x1_min": 0.0, "x1_max": 0.08}
        ),
        "drop, decay, step together": lambda f: fit_robot(
            drops=[record(hopper, "drop", rate=f, seed=1)],
            decays=[record(hopper, "decay", rate=f, height=0.04, seed=5)],
            steps=[record(hopper, "step", rate=f, seed=2)],
            known={"m_s": MASS},
        ),
    }
    for name, job in jobs.items():
        taken = dict[float, float]()
        for rate in (500.0, 1000.0):
            began = time.process_time()
            job(rate)
            taken[rate] = time.process_time() - began
        print(f"{name:32} {taken[500.0]:6.2f} s of processor time at 500 Hz, {taken[1000.0]:6.2f} s at 1 kHz")


def main() -> int:
    recording = record(hopform.load_robot("hopper_c"), "decay", height=0.04, rate=200.0, duration=1.5, seed=1)
    times, x = recording.time, recording.position("x2")
    whole = Cut(recording, 0, "", times, x, 0.0, ((0.0, 0.0),))
    rig = HELD["decay"].experiment(whole, {each: each for each in LETTERS}, {"m_s": MASS, "g": 0.0})

    def ours(p: Array) -> tuple[Array, Array]:
        predicted, by = rig.predict(dict(zip(LETTERS, p.tolist(), strict=True)))
        return predicted, np.stack([by[each] for each in LETTERS], axis=1)

    how = {"x_scale": SCALE, "ftol": 1e-10, "xtol": 1e-10}
    fits: dict[str, Callable[[], Array]] = {
        "hopform, exact Jacobian": lambda: least_squares(
            lambda p: ours(p)[0] - x, START, lambda p: ours(p)[1], **how
        ).x,
        "expm + brentq, differences": lambda: least_squares(lambda p: by_expm(p, times) - x, START, **how).x,
        "solve_ivp DOP853, differences": lambda: least_squares(lambda p: by_solve_ivp(p, times) - x, START, **how).x,
    }  # fmt: skip
    taken, first = dict[str, float](), np.zeros(len(LETTERS))
    for name, fit in fits.items():
        began = time.process_time()
        found = fit()
        taken[name] = time.process_time() - began
        first = found if not first.any() else first
        off = float(np.abs((found - first) / SCALE).max())
        ratio = taken[name] / taken["hopform, exact Jacobian"]
        print(
            f"{name:32} {1e3 * taken[name]:9.1f} ms  {ratio:8.1f} x  "
            f"k {found[0]:.3f}  f2 {found[2]:.5f}  off by {off:.1e}"
        )
    whole_fits()
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
