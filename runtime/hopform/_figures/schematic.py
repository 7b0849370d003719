"""The schematic (Fig. 1c): actuator, spring and body, with their coordinates, forces and signs."""

# pyright: reportUnknownMemberType=false

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from hopform._figures.picture import Drawn, cm, panels
from hopform._figures.plots import BLACK, BLUE, GREEN, GREY, MAGENTA, ORANGE
from hopform._robots import Robot

LIFT, DOWN, PLATE, BODY = 0.10, 0.06, 0.045, 0.14
"""[m] of the drawing: x1, the spring's compression, thickness of plate and body."""


def schematic(robot: Robot) -> Drawn:
    """Fig. 1: what x1, x2, L0, c, the spring force and the signs are."""
    figure, axes = panels(1, 3.4, 2, width_ratios=[1.0, 1.0])
    hopper(axes[0], 0.0, 0.0, "unloaded:\n$F = 0$, $x_1 = 0$, $x_2 = L_0 + c$")
    hopper(axes[1], LIFT, DOWN, "in stance:\n$F = k\\,(x_1 - x_2 + L_0 + c) > 0$")
    sign = "a positive input lifts the body" if robot.gamma2 < 0.0 else "a positive input lowers the body"
    ours = (
        f"the foot stands on the ground and carries the spring, k = {robot.k:g} N/m; between spring and body the "
        f"actuator, m_eff = {robot.m_eff:g} kg, moves the spring's upper end away from the body by x1, "
        f"{cm(robot.x1_min)} to {cm(robot.x1_max)}. x2 is the height of the body, m_s = {robot.m_s:g} kg, over the "
        f"ground, L0 + c = {cm(robot.L0 + robot.c)} unloaded. The motor pushes the actuator by -gamma2 u along x1: "
        f"with gamma2 = {robot.gamma2:g} {sign}. The spring pushes body and actuator by F; the leg takes off where F "
        "= 0"
    )
    lengths = {"x1": LIFT, "compression": DOWN}
    return figure, ours, {"drawn": lengths, "robot": robot}


def hopper(axes: Axes, x1: float, compression: float, title: str) -> None:
    """The hopper on the ground, displaced: x1 more between plate and body, a shorter spring."""
    free = 0.40
    top = free + x1 - compression
    plate = top - 0.12 - x1
    turns = 0.045 * np.array([0.0, 0.0, *(1.0 if n % 2 else -1.0 for n in range(12)), 0.0, 0.0])
    axes.plot(turns, np.linspace(0.0, plate, turns.size), color=BLACK, linewidth=1.3)
    axes.plot([-0.05, 0.05], [0.0, 0.0], color=BLACK, linewidth=3.5, solid_capstyle="butt")
    axes.plot([0.0, 0.0], [plate, top], color=GREEN, linewidth=3.0)
    axes.add_patch(Rectangle((-0.09, plate), 0.18, PLATE, facecolor=ORANGE, edgecolor=BLACK, zorder=3))
    axes.add_patch(Rectangle((-0.15, top), 0.30, BODY, facecolor=BLUE, edgecolor=BLACK, zorder=3))
    axes.text(0.0, plate + PLATE / 2.0, "$m_{eff}$", ha="center", va="center", zorder=4)
    axes.text(0.0, top + BODY / 2.0, "$m_s$", ha="center", va="center", color="white", zorder=4)
    axes.text(0.07, plate / 2.0, "$k$", va="center")
    axes.fill_between([-0.45, 0.45], -0.03, 0.0, facecolor="#DDDDDD", edgecolor=GREY, hatch="////", linewidth=0.0)
    arrow(axes, -0.24, 0.0, top, "$x_2$", BLACK)
    if x1:
        axes.plot([-0.13, 0.24], [plate + x1, plate + x1], color=GREY, linestyle=":", linewidth=1.0)
        arrow(axes, 0.21, plate + x1, plate, "$x_1$", GREEN)
        arrow(axes, 0.21, top, top + BODY, "F", MAGENTA)
        arrow(axes, -0.14, plate - 0.10, plate, "F", MAGENTA)
        arrow(axes, 0.13, plate, plate - 0.10, "$-\\gamma_2 u$", ORANGE)
    else:
        arrow(axes, 0.24, 0.0, free, "$L_0 + c$", GREY)
    axes.set(xlim=(-0.45, 0.55), ylim=(-0.03, 0.66), aspect="equal", xticks=[], yticks=[])
    axes.spines[:].set_visible(False)
    axes.set_title(title, fontsize="small")


def arrow(axes: Axes, x: float, low: float, high: float, words: str, colour: str) -> None:
    """An arrow upwards, or downwards, with a word beside it."""
    how = {"arrowstyle": "-|>", "color": colour, "shrinkA": 0.0, "shrinkB": 0.0, "linewidth": 1.2}
    axes.annotate("", (x, high), (x, low), arrowprops=how)
    axes.text(x + 0.015, (low + high) / 2.0, words, color=colour, va="center")
