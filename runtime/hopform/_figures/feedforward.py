"""The energy-based feedforward controller on even ground (Fig. 16) and on uneven ground (Fig. 17)."""

# pyright: reportUnknownMemberType=false

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hopform._figures.first_controller import draw_heights, rms, worst
from hopform._figures.picture import BLACK, GREEN, ORANGE, Array, Picture, apexes, cm, finished, legend, mm, panels
from hopform._figures.plots import house_style
from hopform._hopping.run import Run, simulate
from hopform._robots import load_robot
from hopform.controllers import AsPrinted, FeedForward
from hopform.terrain import Heights, flat, uniform

REFERENCE = (0.14,) * 6 + (0.18,) * 6 + (0.12,) * 6
SIZE = 0.02  # [m] half width of the uneven ground
LEAST = 1e-17  # [m] what an error of 0 is drawn as


def on_even_ground() -> Picture:
    """Fig. 16."""
    return picture(
        16, flat(len(REFERENCE)), "Energy-based controller, even ground",
        "simulations of the energy-based controller on even terrain", "over flat ground",
    )  # fmt: skip


def on_uneven_ground() -> Picture:
    """Fig. 17."""
    return picture(
        17, uniform(len(REFERENCE), SIZE, seed=17), "Energy-based controller, uneven ground",
        "the same on uneven terrain, as accurate as on even",
        f"over heights drawn from {cm(-SIZE, 0)} to {cm(SIZE, 0)}, known at touchdown only",
    )  # fmt: skip


def picture(number: int, ground: Heights, title: str, paper: str, where: str) -> Picture:
    """Heights, currents and errors of the exact controller, and of the one as printed."""
    robot = load_robot("hopper_c")
    run, printed = (simulate(robot, ground, kind(REFERENCE), height=REFERENCE[0]) for kind in (FeedForward, AsPrinted))
    miss, miss_printed = (each.table["apex"] - np.array(REFERENCE[: len(each.hops)]) for each in (run, printed))
    with house_style():
        figure = drawn(run, np.abs(miss), np.abs(miss_printed))
    ours = (
        f"{len(run.hops)} hops {where}, wanted {', '.join(cm(each, 0) for each in dict.fromkeys(REFERENCE))}. With "
        f"apex(u) = h_des solved exactly every apex is within {worst(miss):.0e} m of the set point (an error of 0 is "
        "drawn as "
        f"{LEAST:.0e} m), at {np.abs(run.table['u']).max():.2f} A of {robot.u_max:g} A at most. (26), (27) as "
        "printed, J "
        f"minimised on a grid of 0.01 A: {mm(rms(miss_printed))} rms, {mm(worst(miss_printed))} at most"
    )
    data = {"run": run, "printed": printed, "wanted": REFERENCE, "miss": miss, "miss printed": miss_printed}
    return finished(number, title, paper, ours, robot.name, figure, data)


def drawn(run: Run, miss: Array, miss_printed: Array) -> Figure:
    figure, (top, middle, bottom) = panels(3, 5.0, sharex=True, height_ratios=[1.6, 0.8, 0.9])
    draw_heights(top, run, REFERENCE)
    legend(top, 4)
    t = np.linspace(0.0, run.duration, 4000)
    middle.plot(t, np.asarray(run.current(t)), color=ORANGE, linewidth=0.9)
    middle.set_ylabel("current $u$ [A]")
    times, _ = apexes(run)
    looks: dict[str, Any] = {"markersize": 3.5, "clip_on": False}
    shown = times[: miss_printed.size]
    bottom.semilogy(shown, miss_printed, "s", color=BLACK, markerfacecolor="none", label="as printed", **looks)
    bottom.semilogy(times, np.maximum(miss, LEAST), "o", color=GREEN, label="exact", **looks)
    bottom.set_ylim(LEAST / 3.0, 1.0)
    bottom.set_ylabel("apex error [m]")
    bottom.set_xlabel("time [s]")
    legend(bottom)
    return figure
