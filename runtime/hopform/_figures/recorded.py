"""Figs. 4, 9 and 10 from recordings of one's own: what identification makes of them."""

# pyright: reportUnknownMemberType=false

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
from matplotlib.axes import Axes

from hopform._figures import fits
from hopform._figures.picture import Drawn, legend, mm, named, panels, volts
from hopform._identify.drop import fit_drop_test
from hopform._identify.ramp import friction_threshold
from hopform._identify.recordings import read_recording
from hopform._identify.step import fit_step_response
from hopform._robots import Robot

PAPER = dict.fromkeys((4, 10), "measured step responses (x1) and drop tests (x2) against a model")
"""What the paper shows, where it is not quite what is drawn here."""


def drawn(number: int, sources: Mapping[str, str]) -> Callable[[Robot], Drawn]:
    """What makes the figure of a number, its recordings fitted with what the robot file says about masses."""
    return partial(threshold, sources) if number == 9 else partial(models, sources)


def models(sources: Mapping[str, str], robot: Robot) -> Drawn:
    """Figs. 4 and 10: a step response and a drop test beside both models, each fitted to its recording."""
    of_drop = fit_drop_test(read_recording(sources["drop"]), known={"m_s": robot.m_s}, holdout=False)
    of_step = fit_step_response(read_recording(sources["step"]), known={"m_eff": robot.m_eff}, holdout=False)
    traces = (of_step.traces[0], of_drop.traces[0])
    figure, rows = panels(2, 4.4)
    for axes, fit in zip(rows, (of_step, of_drop), strict=True):
        fits.trace_panel(axes, fit.traces[0], fit.units)
        under(axes)
    left = "; ".join(
        f"in {each.quantity} {mm(each.tests.rms, 3)} rms, {mm(each.old_rms, 3)} with viscous friction alone"
        for each in traces
    )
    fitted = [each for fit in (of_step, of_drop) for each in fit.estimates if not each.own]
    numbers = ", ".join(f"{each.name} = {each.value:.4g} {each.unit}" for each in fitted)
    ours = f"recordings of {named(robot)}, each fitted by (3), (4) and by (1), (2): {left}. Fitted: {numbers}"
    data = {each.quantity: {"time": each.time, "measured": each.measured, "fitted": each.predicted, "viscous": each.old}
            for each in traces if each.old is not None}  # fmt: skip
    return figure, ours, data


def under(axes: Axes) -> None:
    """The legend as in the other figures, the file's name left to the caption."""
    axes.set_title("", loc="left")
    legend(axes, 2)


def threshold(sources: Mapping[str, str], robot: Robot) -> Drawn:
    """Fig. 9: the current at which the actuator begins to move."""
    found = friction_threshold(read_recording(sources["ramp"]), m_eff=robot.m_eff, gamma2=robot.gamma2)
    rise = found.rises[0]
    figure, (top, bottom) = panels(2, 3.4, sharex=True, height_ratios=[1.0, 0.8])
    fits.rise_panel(top, rise, found.units)
    under(top)
    top.set_xlabel("")
    bottom.plot(rise.time, rise.u)
    bottom.axhspan(rise.onset.u_low, rise.onset.u_high, alpha=0.3)
    bottom.set(xlabel="t [s]", ylabel=f"current $u$ [{volts(robot)}]")
    ours = (
        f"a ramp recorded from {named(robot)}: {len(found.onsets)} onsets of motion, u* = {found.u:.4g} {volts(robot)} "
        f"({found.low:.4g} to {found.high:.4g}), which (5), taken in magnitudes, makes f1 = {found.f1:.4g} m/s^2"
    )
    data = {"time": rise.time, "x1": rise.x1, "fitted": rise.fitted, "u": rise.u, "u*": np.array([found.u])}
    return figure, ours, data
