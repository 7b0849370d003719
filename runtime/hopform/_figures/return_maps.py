"""Return maps: the next apex over the current one (Figs. 5, 11)."""

# pyright: reportUnknownMemberType=false

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from numpy.typing import NDArray

from hopform._control import Reachability, choose_current, reachability
from hopform._figures.picture import Array, Drawn, cm, legend, mm, movable, panels, rms, scale, volts
from hopform._figures.plots import BLACK, BLUE, MAGENTA, ORANGE, SKY, limits
from hopform._hopping.run import simulate
from hopform._robots import Robot
from hopform.controllers import Touchdown
from hopform.terrain import flat


def family_of_maps(robot: Robot) -> Drawn:
    """Fig. 5: a family of return maps, one per control action."""
    currents = np.array([0.0, *np.linspace(0.5, 1.0, 6) * movable(robot).u_max])
    reach = reachability(robot, scale(robot) * np.linspace(0.02, 0.36, 171), currents)
    colours = ScalarMappable(Normalize(*limits(currents)), "viridis_r")
    free = np.where(reach.admissible, 100 * reach.apex, np.nan)
    stopped = np.where(beside(reach.limited), 100 * reach.apex, np.nan)
    silent, held = np.isnan(reach.apex).any(axis=1), np.isfinite(reach.hold)
    up_to, highest = (float(reach.heights[some].max(initial=0.0)) for some in (silent, held))
    figure, (axes,) = panels(1, 4.3)
    shade(axes, reach, "reachable by some input")
    for column, colour in enumerate(map(colours.to_rgba, currents)):
        axes.plot(100 * reach.heights, free[:, column], color=colour)
        label = "" if column < currents.size - 1 else "actuator meets its stop"
        axes.plot(100 * reach.heights, stopped[:, column], color=colour, linestyle=":", label=label)
    for height, words in grouped(100 * reach.apex[-1], currents, 1.2):
        end = (100 * reach.heights[-1], height)
        label = f"{words} {volts(robot)}"
        axes.annotate(label, end, (3, 0), textcoords="offset points", va="center", fontsize=8)
    axes.figure.colorbar(colours, ax=axes, label=f"input [{volts(robot)}]", pad=0.08)
    fixed_points(axes, reach)
    diagonal(axes, reach)
    legend(axes)
    half = 0.2 * scale(robot)
    points = "; ".join(
        f"{cm(each.height)} at {each.u:g} {volts(robot)} (multiplier {each.multiplier:.2f})"
        for each in reach.fixed_points
    )
    ours = (
        f"the next apex after drops of {cm(reach.heights[0])} to {cm(reach.heights[-1])}, actuator at its origin, "
        f"under {currents.size} constant inputs. Heights that one gives back: {points}. Without actuation "
        f"{cm(half, 0)} become {cm(passive(reach, half))}; the highest that can be held is "
        f"{cm(highest)}. Up to {cm(up_to)} some inputs lead to no take-off: "
        "their curves begin above that"
    )
    return figure, ours, {"reach": reach}


def bounds_of_map(robot: Robot) -> Drawn:
    """Fig. 11: what a current can reach, bounds from the closed form, markers from simulated hops with errors."""
    margin, noise = 0.015 * scale(movable(robot)), 0.003 * scale(robot)
    heights = scale(robot) * np.linspace(0.02, 0.40, 77)
    reach = reachability(robot, heights, np.array([0.0, robot.u_max]), stop_margin=margin)
    draw = np.random.default_rng(11)
    drops = np.repeat(scale(robot) * np.linspace(0.04, 0.38, 12), 2)
    least, most = (
        np.array([measured(robot, height, highest, margin) for height in drops]) for highest in (False, True)
    )
    seen = drops + noise * draw.standard_normal(drops.size)
    least, most = (values + noise * draw.standard_normal(drops.size) for values in (least, most))
    misses = np.concatenate([
        least - np.interp(seen, reach.heights, reach.apex[:, 0]), most - np.interp(seen, reach.heights, reach.highest)
    ])  # fmt: skip
    figure, (axes,) = panels(1, 4.3)
    shade(axes, reach, "reachable")
    axes.plot(100 * reach.heights, 100 * reach.highest, color=BLUE, label="highest, within the stroke's margin")
    axes.plot(100 * reach.heights, 100 * reach.apex[:, 0], color=MAGENTA, linestyle="--", label="no actuation")
    hollow: dict[str, Any] = {"markersize": 4.5, "markerfacecolor": "none"}
    axes.plot(100 * seen, 100 * most, "^", color=BLUE, label="hops, most current", **hollow)
    axes.plot(100 * seen, 100 * least, "v", color=MAGENTA, label="hops, no current", **hollow)
    fixed_points(axes, reach)
    diagonal(axes, reach)
    legend(axes)
    top = next((point for point in reach.fixed_points if point.u == robot.u_max), None)
    back = top and f"{cm(top.height)} is given back (multiplier {top.multiplier:.2f})"
    holds = f"at {robot.u_max:g} {volts(robot)} {back}" if back else "none is held"
    half = 0.2 * scale(robot)
    row, below = int(np.abs(reach.heights - half).argmin()), reach.apex[:, 0] - reach.lowest
    ours = (
        f"the dashed curve is a drop at 0 {volts(robot)} ({cm(half, 0)} become {cm(passive(reach, half))}); the "
        f"lowest apex of all currents lies below it, by up to {mm(float(below.max()))}: {cm(reach.heights[row], 0)} "
        f"become {cm(reach.lowest[row])} at {reach.u_lowest[row]:.2f} {volts(robot)}. The upper curve is the highest "
        f"apex of all currents up to {robot.u_max:g} {volts(robot)} that keep x1 {cm(margin)} off its stop; {holds}. "
        f"The stroke limits {int(reach.limited.any(axis=1).sum())} of {reach.heights.size} heights. Markers: "
        f"simulated hops, {mm(noise)} noise on each height; rms distance to the curves {mm(rms(misses))}"
    )
    return figure, ours, {"reach": reach, "seen": seen, "least": least, "most": most, "misses": misses, "noise": noise}


def beside(which: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Where it holds (H, U), and at the heights next to that, so that a curve goes on from its neighbour."""
    wider = which.copy()
    wider[1:] |= which[:-1]
    wider[:-1] |= which[1:]
    return wider


def measured(robot: Robot, height: float, highest: bool, margin: float) -> float:
    """The apex [m] of one simulated hop from a height [m]: without actuation, or with what leads highest."""

    def controller(touchdown: Touchdown) -> float:
        return choose_current(robot, v2=touchdown.v2, h_des=10.0, stop_margin=margin).u if highest else 0.0

    return simulate(robot, flat(1), controller, height=height).hops[0].apex


def grouped(ends: Array, currents: Array, least: float) -> list[tuple[float, str]]:
    """Ends of curves with their labels; those that end closer than `least` share one."""
    groups: list[list[int]] = []
    for column in np.argsort(ends).tolist():
        if groups and ends[column] - ends[groups[-1][-1]] < least:
            groups[-1].append(column)
        else:
            groups.append([column])
    return [(float(ends[group].mean()), ", ".join(f"{currents[n]:g}" for n in sorted(group))) for group in groups]


def passive(reach: Reachability, height: float) -> float:
    """The next apex [m] without actuation, the first current of the map, from a height [m]."""
    return float(np.interp(height, reach.heights, reach.apex[:, 0]))


def shade(axes: Axes, reach: Reachability, words: str) -> None:
    """Shade the apexes that admissible currents reach."""
    ends = (100 * reach.heights, 100 * reach.lowest, 100 * reach.highest)
    axes.fill_between(*ends, color=SKY, alpha=0.18, linewidth=0.0, label=words)


def fixed_points(axes: Axes, reach: Reachability) -> None:
    """A dot where a current gives its height back."""
    heights = [100 * point.height for point in reach.fixed_points]
    axes.plot(heights, heights, "o", color=ORANGE, markersize=5.0, zorder=4, label="fixed point")


def diagonal(axes: Axes, reach: Reachability) -> None:
    """The line of fixed points, and the axes' names."""
    ends = 100 * reach.heights[[0, -1]]
    axes.plot(ends, ends, color=BLACK, linestyle=":", linewidth=1.0, label="next = current")
    axes.set(xlabel="current apex [cm]", ylabel="next apex [cm]")
