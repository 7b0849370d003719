"""Pictures of runs and hops over time."""

# pyright: reportUnknownMemberType=false
# matplotlib's own annotations leave the type of **kwargs open.

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from hopform.extend import PALETTE, framed, name_axis
from hopform.hopping._run import Hop, Run

BLUE, GREY, BLACK = PALETTE["blue"], PALETTE["grey"], PALETTE["black"]
TAKEOFF: dict[str, Any] = {"color": BLACK, "markersize": 4.0, "linestyle": "none"}
"""The mark of a take-off."""
STANCE: dict[str, Any] = {"facecolor": "#EDEDED", "edgecolor": "none"}
BODY_ENERGY, WITH_SPRING = "kinetic + gravitational", "with the spring as in (23) in stance"

Curve = NDArray[np.floating]


def draw_energies(axes: Axes, run: Run | Hop, t: Curve) -> None:
    """The energy of the body, and that with the spring as in (23)."""
    axes.plot(t, sum(energies_of_body(run, t)), color=BLACK, linewidth=0.8, linestyle=(0, (3, 1)), label=BODY_ENERGY)
    axes.plot(t, np.asarray(run.energy(t).body), color=BLUE, label=WITH_SPRING)
    name_axis(axes, "energy [J]")


def energies_of_body(run: Run | Hop, t: Curve) -> tuple[Curve, Curve]:
    """Kinetic and gravitational energy [J] of the body, from level 0 on; an impact alone makes their sum jump."""
    state, robot = run.at(t), run.robot
    return 0.5 * robot.letters.m_s * np.asarray(state.v2) ** 2, robot.letters.m_s * robot.letters.g * np.asarray(
        state.x2
    )


def plot_run(figure: Figure, run: Run | Hop) -> None:
    """A run over time: hop height, actuator, energies (Figs. 12 to 14), current; without an actuator or an input not
    these.
    """
    t, facts = run_times(run), run.robot.solver.facts
    of_actuator, of_input = ([0.9] if "x1" in facts.axes else []), ([0.75] if facts.inputs else [])
    shares = [1.0, *of_actuator, 1.3, *of_input]
    with framed(figure, 6.4, 1.3 * sum(shares) + 1.665, run.robot.name or "robot", title_of_run(run)):
        rows: list[Axes] = list(figure.subplots(len(shares), 1, sharex=True, height_ratios=shares, squeeze=False)[:, 0])
        energies = rows[1 + len(of_actuator)]
        draw_heights(rows[0], run, t)
        if of_actuator:
            rows[1].plot(t, 1000.0 * np.asarray(run.at(t).x1), color=BLUE)
            name_axis(rows[1], "actuator $x_1$ [mm]")
        draw_energies(energies, run, t)
        if of_input:
            rows[-1].plot(t, run.current(t), color=PALETTE["orange"], linewidth=0.9)
            name_axis(rows[-1], "current $u$ [A]")
        for axes in rows:
            shade_stances(axes, run)
        lines = [line for axes in (rows[0], energies) for line in axes.get_legend_handles_labels()[0]]
        figure.legend(handles=[Patch(label="stance", **STANCE), *lines], loc="outside lower center", ncols=3)
        rows[-1].set_xlabel(since(run))
        figure.align_ylabels(rows)


def run_panel(axes: Axes, run: Run | Hop) -> None:
    """The hop height over the ground."""
    draw_heights(axes, run, run_times(run))
    shade_stances(axes, run)
    axes.set_xlabel(since(run))


def stances_of(run: Run | Hop) -> list[tuple[float, float]]:
    """Touchdown and end of each stance [s]."""
    if isinstance(run, Hop):
        return [(run.flight.duration, run.duration)]
    return [(hop.touchdown_time, hop.takeoff_time) for hop in run.hops]


def shade_stances(axes: Axes, run: Run | Hop, label: str = "") -> None:
    """The stances behind the curves; the first one has the label."""
    for n, (begin, end) in enumerate(stances_of(run)):
        axes.axvspan(begin, end, zorder=0, label="" if n else label, **STANCE)


def since(run: Run | Hop) -> str:
    return f"time since the {'flight began' if isinstance(run, Hop) else 'start'} [s]"


def title_of_run(run: Run | Hop) -> str:
    if isinstance(run, Hop):
        about = (run.stance.input_in_words, run.stance.outcome)
        return f", hop {run.index}: {', '.join(each for each in about if each)}"
    start = f"from {100.0 * (float(run.at(0.0).x2) - run.robot.standing_height):.4g} cm"
    inputs = {hop.stance.u: hop.stance.input_in_words for hop in run.hops}
    words = next(iter(inputs.values())) if len(inputs) == 1 else ""
    return f" {start}, {words or f'{len(run.hops)} hops'}"


def draw_heights(axes: Axes, run: Run | Hop, t: Curve) -> None:
    """The body over the level at which the leg stands unloaded; of a run apexes, take-offs, ground and set points
    too.
    """
    base = run.robot.standing_height
    axes.plot(t, 100.0 * (np.asarray(run.at(t).x2) - base), color=BLUE, linewidth=1.0, label="body")
    axes.set_ylabel("hop height [cm]")
    if isinstance(run, Hop):
        return
    lifts = [hop for hop in run.hops if hop.stance.takeoff is not None]
    marks: dict[str, Any] = {"color": BLUE, "markersize": 3.5, "clip_on": False}
    times, heights = apexes(run)
    if lifts:  # a line of no points that is not clipped has no extent, which the layout does not survive
        axes.plot(times, 100.0 * heights, "o", label="apex", **marks)
        x2 = [100.0 * (float(hop.stance.end.x2) + hop.ground - base) for hop in lifts]
        axes.plot([hop.takeoff_time for hop in lifts], x2, "^", clip_on=False, label="take-off", **TAKEOFF)
    if run.h_des:
        draw_desired(axes, run)
    if any(run.terrain):
        axes.plot(t, 100.0 * np.asarray(run.ground(t)), color=GREY, linewidth=1.6, label="ground")


def draw_desired(axes: Axes, run: Run) -> None:
    """The set point of each hop, from one touchdown to the next."""
    edges = [0.0, *(hop.touchdown_time for hop in run.hops[1:]), run.duration]
    if run.hops:
        values = 100.0 * np.array(run.h_des[: len(run.hops)])
        axes.stairs(values, edges, baseline=None, color=BLACK, linestyle="--", linewidth=1.0, label="desired")


def apexes(run: Run) -> tuple[Curve, Curve]:
    """Times [s] and heights [m] of a run's apexes, up to its end; hops without take-off are left out."""
    lifts = [hop for hop in run.hops if hop.stance.takeoff is not None]
    points = [(hop.takeoff_time + max(float(hop.stance.end.v2), 0.0) / run.robot.fall, hop.apex) for hop in lifts]
    times, heights = np.array(points).reshape(-1, 2).T
    return times[times <= run.duration], heights[times <= run.duration]


def run_times(run: Run | Hop) -> Curve:
    """Uniform times, and both sides of every touchdown and take-off, where the energy jumps."""
    corners = np.array(stances_of(run)).reshape(-1)
    both = np.concatenate([np.nextafter(corners, -np.inf), corners, np.nextafter(corners, np.inf)])
    uniform = np.linspace(0.0, run.duration, min(200 * (1 + corners.size // 2), 6000))
    return np.asarray(np.minimum(np.union1d(uniform, both), run.duration))


OF_RESULTS: Mapping[type, Any] = {Run: (plot_run, run_panel), Hop: (plot_run, run_panel)}
"""The whole picture of each type of result, and its main panel."""
