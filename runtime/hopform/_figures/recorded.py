"""Figs. 4, 9 and 10 from recordings of one's own: what identification makes of them."""

# pyright: reportUnknownMemberType=false

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes

from hopform._figures import fits
from hopform._figures.picture import Picture, finished, legend, mm, named, panels, volts
from hopform._figures.plots import house_style
from hopform._identify.drop import fit_drop_test
from hopform._identify.ramp import friction_threshold
from hopform._identify.recordings import read_recording
from hopform._identify.step import fit_step_response
from hopform._robots import Robot


def drawn(number: int, robot: Robot, sources: Mapping[str, str]) -> Picture:
    """The figure of a number, its recordings fitted with what the robot file says about masses."""
    return threshold(robot, sources["ramp"]) if number == 9 else models(number, robot, sources)


def models(number: int, robot: Robot, sources: Mapping[str, str]) -> Picture:
    """Figs. 4 and 10: a step response and a drop test beside both models, each fitted to its recording."""
    of_drop = fit_drop_test(read_recording(sources["drop"]), known={"m_s": robot.m_s}, holdout=False)
    of_step = fit_step_response(read_recording(sources["step"]), known={"m_eff": robot.m_eff}, holdout=False)
    traces = (of_step.traces[0], of_drop.traces[0])
    with house_style():
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
    paper = "measured step responses (x1) and drop tests (x2) against a model"
    title = "Initial model" if number == 4 else "Improved model"
    data = {each.quantity: {"time": each.time, "measured": each.measured, "fitted": each.predicted, "viscous": each.old}
            for each in traces if each.old is not None}  # fmt: skip
    return finished(number, title, paper, ours, named(robot), figure, data)


def under(axes: Axes) -> None:
    """The legend as in the other figures, the file's name left to the caption."""
    axes.set_title("", loc="left")
    legend(axes, 2)


def threshold(robot: Robot, source: str) -> Picture:
    """Fig. 9: the current at which the actuator begins to move."""
    found = friction_threshold(read_recording(source), m_eff=robot.m_eff, gamma2=robot.gamma2)
    rise = found.rises[0]
    with house_style():
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
    paper = "a slowly rising current (bottom) until motion of the actuator is detected (top), from which (5) gives f1"
    data = {"time": rise.time, "x1": rise.x1, "fitted": rise.fitted, "u": rise.u, "u*": np.array([found.u])}
    return finished(9, "Dry friction of the actuator", paper, ours, named(robot), figure, data)
