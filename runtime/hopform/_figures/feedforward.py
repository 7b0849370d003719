"""The energy-based feedforward controller on even ground (Fig. 16) and on uneven ground (Fig. 17)."""

# pyright: reportUnknownMemberType=false

from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hopform._figures.first_controller import draw_run, rms, worst
from hopform._figures.picture import Array, Drawn, cm, completed, legend, mm, movable, panels, scale, volts
from hopform._figures.plots import BLACK, GREEN, MAGENTA, ORANGE, SKY, apexes, shade_stances
from hopform._hopping.run import NONE, Errors, Run, simulate
from hopform._robots import Robot
from hopform.controllers import AsPrinted, FeedForward
from hopform.terrain import Heights, flat, uniform

REFERENCE = (0.14,) * 6 + (0.18,) * 6 + (0.12,) * 6
SIZE = 0.02  # [m] half width of the uneven ground
WRONG = 1.05  # what the model has too much of, of every parameter that is identified
IDENTIFIED = ("m_eff", "k", "b1", "b2", "f1", "f2", "gamma2")
NOISE = Errors(x1=5e-4, v1=0.02, v2=0.02, ground=2e-3)
LATE = Errors(quantum=1e-3, delay=2e-3)
LEAST = 1e-3  # [mm] below which the scale of errors is linear
MARKS = (("o", GREEN), ("s", BLACK), ("^", MAGENTA), ("D", SKY), ("v", ORANGE))


def on_even_ground(robot: Robot) -> Drawn:
    """Fig. 16."""
    return compared(16, robot, flat(len(REFERENCE)), "over flat ground")


def on_uneven_ground(robot: Robot) -> Drawn:
    """Fig. 17."""
    size = SIZE * scale(robot)
    where = f"over heights drawn from {cm(-size, 0)} to {cm(size, 0)}, known at touchdown only"
    return compared(17, robot, uniform(len(REFERENCE), size, seed=17), where)


def compared(seed: int, robot: Robot, ground: Heights, where: str) -> Drawn:
    """Heights, currents and errors of the exact controller, of the one as printed, and of the exact one that errs."""
    wanted = tuple(scale(movable(robot)) * each for each in REFERENCE)
    wrong = replace(robot, **{name: WRONG * getattr(robot, name) for name in IDENTIFIED})
    asked: dict[str, tuple[Any, Errors]] = {
        "exact": (FeedForward, NONE), "printed": (AsPrinted, NONE), "5 % wrong": (FeedForward, Errors(model=wrong)),
        "noise": (FeedForward, NOISE), "late": (FeedForward, LATE),
    }  # fmt: skip
    runs = {
        name: simulate(robot, ground, kind(wanted), height=wanted[0], errors=errors, seed=seed)
        for name, (kind, errors) in asked.items()
    }
    run = completed(runs["exact"])
    miss = {name: each.table["apex"] - np.array(wanted[: len(each.hops)]) for name, each in runs.items()}
    off = {name: f"{mm(rms(each))} rms, {mm(worst(each))} at most" for name, each in miss.items()}
    ours = (
        f"{len(run.hops)} hops {where}, wanted {', '.join(cm(each, 0) for each in dict.fromkeys(wanted))}. With "
        f"apex(u) = h_des solved exactly every apex is within {worst(miss['exact']):.0e} m of the set point, at "
        f"{np.abs(run.table['u']).max():.2f} {volts(robot)} of {robot.u_max:g} {volts(robot)} at most. (26), (27) as "
        f"printed, J minimised on a grid of 0.01 {volts(robot)}: {off['printed']}. The exact controller whose model "
        f"has 5 % too much of {', '.join(IDENTIFIED)}: {off['5 % wrong']}; with noise of {mm(NOISE.x1)} and "
        f"{NOISE.v1:g} m/s on x1, {NOISE.v2:g} m/s on v2, {mm(NOISE.ground)} on the ground: {off['noise']}; with "
        f"touchdown seen at a tick of 1 kHz and {1e3 * LATE.delay:.0f} ms late: {off['late']}. The scale of the "
        "errors is linear below 1 um"
    )
    return drawn(run, miss), ours, {"run": run, "runs": runs, "wanted": wanted, "miss": miss}


def drawn(run: Run, miss: dict[str, Array]) -> Figure:
    figure, (top, middle, bottom) = panels(3, 5.4, sharex=True, height_ratios=[1.6, 0.8, 1.3])
    draw_run(top, middle, run)
    times, _ = apexes(run)
    for (name, off), (marker, colour) in zip(miss.items(), MARKS, strict=True):
        shown = 1e3 * np.abs(off[: times.size])
        bottom.plot(times[: shown.size], shown, marker, color=colour, markersize=3.5, clip_on=False, label=name)
    bottom.set_yscale("symlog", linthresh=LEAST)
    shade_stances(bottom, run)
    bottom.set(xlabel="time [s]", ylabel="apex error [mm]")
    legend(bottom, 5)
    return figure
