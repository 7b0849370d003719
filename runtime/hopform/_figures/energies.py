"""Energy over time: an ideal drop (Fig. 12), a real one (Fig. 13), and hopping at 3 A (Fig. 14)."""

# pyright: reportUnknownMemberType=false

from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hopform._control import home_of
from hopform._errors import HopformError
from hopform._figures import plots
from hopform._figures.picture import Array, Drawn, cm, completed, legend, panels, scale, volts
from hopform._hopping.run import Run, simulate
from hopform._robots import Robot
from hopform.terrain import flat


def ideal_drop(robot: Robot) -> Drawn:
    """Fig. 12: without losses the energy stays; the robot without friction, its actuator locked."""
    height, kept = 0.2 * scale(robot), home_of(robot)
    still = replace(robot, b1=0.0, b2=0.0, f1=0.0, f2=0.0, impact_loss=0.0, x1_min=kept, x1_max=kept)
    run = simulate(still, flat(5), 0.0, height=height)
    data, figure = drawn(run)
    energy = data["energy"]
    span = float(np.ptp(energy)) / float(energy[0])
    ours = (
        f"a drop of {cm(height, 0)}, {len(run.hops)} hops. Kinetic, gravitational and spring energy add up to "
        f"{energy[0]:.4f} J throughout; the sum varies by {span:.0e} of that"
    )
    return figure, ours, data


def real_drop(robot: Robot) -> Drawn:
    """Fig. 13: a passive drop, the energy as predicted by (24)."""
    height = 0.2 * scale(robot)
    run = simulate(robot, flat(7), 0.0, height=height)
    if not run.hops:
        raise HopformError("the robot does not reach the ground")
    data, figure = drawn(run)
    first = run.hops[0]
    loss = data["energy"][0] - data["energy"][-1]
    ours = (
        f"a drop of {cm(height, 0)} at 0 A, {len(run.hops)} hops ({run.status}), {loss:.2f} J lost. At the first "
        f"impact {first.energy_lost_at_impact:.3f} J go at once, {-float(first.stance.aed):.3f} J over the stance. "
        "The AED of (24), predicted at each touchdown, and the energy after the fact differ by at most "
        f"{data['predicted off']:.0e} J"
    )
    return figure, ours, data


def actuated(robot: Robot) -> Drawn:
    """Fig. 14: the same at 3 A, up to a steady height."""
    height, u = 0.2 * scale(robot), robot.u_max
    run, long = (simulate(robot, flat(hops), u, height=height) for hops in (12, 60))
    completed(long)
    steady = long.hops[-1].apex
    data, figure = drawn(run)
    heights = run.table["apex"]
    ours = (
        f"the same drop at {u:g} {volts(robot)}, {len(run.hops)} hops: apexes go from {cm(heights[0])} to "
        f"{cm(heights[-1], 2)} and settle at {cm(steady, 2)}. The minima in stance are the actuator's work on the "
        "body; the drop at take-off is k x1^2/2, the spring's share at x1 > 0, which (27) leaves out. AED predicted "
        f"and energy after the fact differ by at most {data['predicted off']:.0e} J"
    )
    data["steady"] = steady
    return figure, ours, data


def drawn(run: Run) -> tuple[dict[str, Any], Figure]:
    """Parts and sum of the body's energy over a run, with the sum as (24) predicts it; and these numbers."""
    t = np.asarray(plots.run_times(run), dtype=float)
    kinetic, weight, spring = parts(run, t)
    energy, predicted = np.asarray(run.energy(t).body), np.asarray(run.aed(t))
    figure, (top, bottom) = panels(2, 4.2, sharex=True, height_ratios=[1.4, 1.0])
    for axes in (top, bottom):
        plots.shade_stances(axes, run, "stance")
        lifts = [hop.takeoff_time for hop in run.hops if hop.stance.takeoff is not None]
        height = np.zeros(len(lifts))
        frame = axes.get_xaxis_transform()
        axes.plot(lifts, height, "^", color=plots.BLACK, markersize=3.5, transform=frame, label="take-off")
    top.plot(t, energy, color=plots.SKY, linewidth=4.0, label="kinetic + potential")
    top.plot(t, predicted, color=plots.MAGENTA, linewidth=1.1, label="start + AED (24) and impacts, predicted")
    plots.name_axis(top, "body energy [J]")
    legend(top)
    bottom.plot(t, kinetic, color=plots.BLUE, linewidth=1.0, label="kinetic")
    bottom.plot(t, weight, color=plots.GREEN, linewidth=1.0, linestyle="--", label="gravitational")
    bottom.plot(t, spring, color=plots.ORANGE, linewidth=1.0, linestyle="-.", label="spring")
    bottom.set(xlabel="time [s]", ylabel="its parts [J]")
    legend(bottom, handles=bottom.get_lines()[1:])
    off = float(np.abs(energy - predicted).max())
    data = {"run": run, "t": t, "energy": energy, "predicted": predicted, "kinetic": kinetic, "weight": weight,
            "spring": spring, "predicted off": off}  # fmt: skip
    return data, figure


def parts(run: Run, t: Array) -> tuple[Array, Array, Array]:
    """Kinetic energy of the body, that of its weight, and what is left of its energy: the spring's share [J]."""
    state, robot = run.at(t), run.robot
    kinetic = 0.5 * robot.m_s * np.asarray(state.v2) ** 2
    weight = robot.m_s * robot.g * np.asarray(state.x2)
    return kinetic, weight, np.asarray(run.energy(t).body) - kinetic - weight
