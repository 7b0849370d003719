"""The model against measurements: without dry friction on hopper_b (Fig. 4), with it on hopper_c (Fig. 10).

The measurements are synthetic: the robot itself, simulated, with noise. The initial model (1), (2) has viscous friction
alone; its two coefficients are fitted, each to its recording, so that it is not blamed for a bad guess.
"""
# pyright: reportUnknownMemberType=false

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from docs.gallery.picture import Array, Drawn, cm, legend, mm, named, panels, rms, standing, stream, volts
from hopform import Robot, solve_stance
from hopform._figures.plots import BLACK, BLUE, ORANGE
from hopform.hopping import simulate
from hopform.hopping.terrain import flat

NOISE = 2e-4  # [m]
DROP = 0.12  # [m]
PULSE = 0.3  # [s]
DROP_TIMES = np.arange(0.0, 3.0, 0.005)
STEP_TIMES = np.arange(0.0, 1.0, 0.005)


class Recordings(NamedTuple):
    """A drop test, x2 over `DROP_TIMES`, and a step response, x1 over `STEP_TIMES` [m]."""

    x2: Array
    x1: Array


def initial_model(robot: Robot) -> Drawn:
    """Fig. 4: (1), (2) cannot be fitted to a robot with dry friction."""
    u, measured, fitted, said = tested(robot, 0.4, 4)
    model = recordings(fitted, u)
    figure = drawn(measured, {"model (1), (2), fitted": (model, ORANGE, "-")}, f"{u:g} {volts(robot)} for {PULSE:g} s")
    off_1, off_2 = measured.x1 - model.x1, measured.x2 - model.x2
    ours = (
        f"{said} Model (1), (2) with the best viscous coefficients, b1 = {fitted.b1:.0f} and b2 = {fitted.b2:.1f} "
        f"N s/m (the robot: {robot.b1:g} and {robot.b2:g}), leaves {mm(rms(off_1))} rms in x1 and {mm(rms(off_2))} in "
        "x2; over the last 0.5 s, where the recording rests, its body still oscillates over "
        f"{mm(float(np.ptp(model.x2[-100:])))}"
    )
    data = {"robot": robot, "fitted": fitted, "measured": measured, "model": model,
            "rms x1": rms(off_1), "rms x2": rms(off_2)}  # fmt: skip
    return figure, ours, data


def improved_model(robot: Robot) -> Drawn:
    """Fig. 10: (3), (4) with dry friction."""
    u, measured, fitted, said = tested(robot, 0.5, 10)
    old, new = recordings(fitted, u), recordings(robot, u)
    looks = {"model (3), (4)": (new, BLUE, "-"), "model (1), (2), fitted": (old, ORANGE, "--")}
    figure = drawn(measured, looks, f"{u:g} {volts(robot)} for {PULSE:g} s")
    left = {name: (rms(measured.x1 - one.x1), rms(measured.x2 - one.x2)) for name, one in (("old", old), ("new", new))}
    ours = (
        f"{said} With dry friction {mm(left['new'][0], 2)} rms remain in x1 and {mm(left['new'][1], 2)} in x2: the "
        "noise, as the recordings are this model's own. Without it, viscous friction fitted (b1 = "
        f"{fitted.b1:.0f}, b2 = {fitted.b2:.1f} N s/m), {mm(left['old'][0], 2)} and {mm(left['old'][1], 2)}"
    )
    return figure, ours, {"robot": robot, "fitted": fitted, "measured": measured, "old": old, "new": new, "rms": left}


def recordings(robot: Robot, u: float) -> Recordings:
    """The motions of a robot in both tests."""
    return Recordings(drop(robot), step(robot, u))


def drop(robot: Robot) -> Array:
    """x2 [m] at `DROP_TIMES` after a drop without current; where the robot has come to rest it stays."""
    run = simulate(robot, flat(60), 0.0, height=DROP, horizon=5.0)
    return np.asarray(run.at(np.minimum(DROP_TIMES, run.duration)).x2)


def step(robot: Robot, u: float) -> Array:
    """x1 [m] at `STEP_TIMES` of the standing robot under a current for a time; NaN behind a take-off."""
    stance = solve_stance(robot, v2=0.0, x2=standing(robot), u=[(0.0, u), (PULSE, 0.0)], horizon=STEP_TIMES[-1] + 0.01)
    x1 = np.asarray(stance.at(np.minimum(STEP_TIMES, stance.duration)).x1)
    return np.where((stance.duration >= STEP_TIMES) | (stance.status == "rest"), x1, np.nan)


def tested(robot: Robot, share: float, seed: int) -> tuple[float, Recordings, Robot, str]:
    """The current of the step, a share of u_max; recordings with noise; the robot without dry friction, b1 and b2
    fitted each to the recording that shows it; and how it was tested, in words.
    """
    u = share * robot.u_max
    draw, clean = stream(seed), recordings(robot, u)
    measured = Recordings(*(each + NOISE * draw.standard_normal(each.size) for each in (clean.x2, clean.x1)))
    smooth = replace(robot, f1=0.0, f2=0.0, f1_excess=0.0, f2_excess=0.0)
    some = 1e-3 * np.sqrt(robot.k * robot.m_s)  # where there is hardly any to begin with
    b1, b2 = max(robot.b1, some), max(robot.b2, some)
    b2 = least(lambda b: misfit(measured.x2, drop(replace(smooth, b2=b))), b2, 8.0 * b2)
    b1 = least(lambda b: misfit(measured.x1, step(replace(smooth, b1=b, b2=b2), u)), b1, 8.0 * b1)
    said = (
        f"synthetic recordings of {named(robot)} with noise of {mm(NOISE)}: a step of {u:g} {volts(robot)} for "
        f"{PULSE:g} s while standing, and a drop of {cm(DROP, 0)} with no input."
    )
    return u, measured, replace(smooth, b1=b1, b2=b2), said


def misfit(measured: Array, model: Array) -> float:
    """rms [m], infinite where the model has no value."""
    return rms(measured - model) if np.isfinite(model).all() else np.inf


def least(cost: Callable[[float], float], low: float, high: float) -> float:
    """Minimiser of a cost within an interval, by three grids, each around the best of the one before."""
    for _ in range(3):
        grid = np.geomspace(low, high, 15)
        best = int(np.argmin([cost(float(value)) for value in grid]))
        low, high = float(grid[max(best - 1, 0)]), float(grid[min(best + 1, grid.size - 1)])
    return float(np.sqrt(low * high))


def drawn(measured: Recordings, models: dict[str, tuple[Recordings, str, str]], pulse: str) -> Figure:
    figure, (top, bottom) = panels(2, 5.2)
    top.plot(STEP_TIMES[::2], 1e3 * measured.x1[::2], "o", color=BLACK, markersize=1.8, label="recorded (synthetic)")
    bottom.plot(DROP_TIMES[::2], 1e2 * measured.x2[::2], "o", color=BLACK, markersize=1.8)
    for name, (model, colour, line) in models.items():
        top.plot(STEP_TIMES, 1e3 * model.x1, color=colour, linestyle=line, label=name)
        bottom.plot(DROP_TIMES, 1e2 * model.x2, color=colour, linestyle=line)
    top.set(xlabel=f"time since the step [s], {pulse}", ylabel="actuator $x_1$ [mm]")
    bottom.set(xlabel="time since the drop [s]", ylabel="body $x_2$ [cm]")
    for axes in (top, bottom):
        axes.margins(x=0.02)
    legend(top)
    return figure
