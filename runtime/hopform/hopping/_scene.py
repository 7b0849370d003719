"""A hopper on its ground, moving: foot, spring, actuator, body, with time and current."""

# pyright: reportUnknownMemberType=false

import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from hopform.extend import PALETTE, framed
from hopform.hopping._run import Run

BLUE, GREEN, ORANGE, GREY, BLACK = (PALETTE[name] for name in ("blue", "green", "orange", "grey", "black"))
Curve = NDArray[np.floating]
STRIDE = 0.45  # [m] between two footholds, for the eye alone: the robot is constrained to its vertical
BODY, ACTUATOR = (0.22, 0.10), (0.12, 0.045)  # [m] width, height
SHANK = 0.08  # [m] from the body's middle to the actuator's at x1 = 0
COILS = 7


def gif_of(run: Run, set_point: float | None, rate: int, times: Sequence[float]) -> bytes:
    """A run at times [s], `rate` pictures a second; set_point [m]: the apex that a line shows."""
    figure = Figure(dpi=100)
    with framed(figure, 5.4, 3.6, ""), tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "animation.gif"
        place = scene(figure.subplots(), run, set_point)
        figure.draw_without_rendering()
        figure.set_layout_engine("none")  # laid out once
        writer = PillowWriter(fps=rate, metadata={"Software": "hopform"})
        FuncAnimation(figure, place, times).save(path, writer, dpi=100)
        return path.read_bytes()


def position(run: Run, t: Curve) -> Curve:
    """Position of the robot in the picture [m]: on its foothold in stance, on the way to the next one in flight."""
    corners = [0.0, *(time for hop in run.hops for time in (hop.touchdown_time, hop.takeoff_time)), run.duration]
    return STRIDE * np.interp(t, corners, [-1, *(hop.index for hop in run.hops for _ in range(2)), len(run.hops)])


def scene(axes: Axes, run: Run, set_point: float | None) -> Callable[[float], list[Artist]]:
    """The ground, the set point and the parts that move, with what places these at a time and moves the view along."""
    edges = STRIDE * (np.arange(len(run.terrain) + 1) - 0.5)
    edges[0], edges[-1] = -3 * STRIDE, edges[-1] + 3 * STRIDE
    length = run.robot.standing_height
    tops = [0.0, set_point or 0.0, *(hop.height for hop in run.hops), *(hop.apex for hop in run.hops)]
    low, high = min(run.terrain) - 0.05, length + float(np.nanmax(tops)) + 0.15
    axes.stairs(run.terrain, edges, baseline=low, fill=True, facecolor="#DDDDDD", edgecolor=GREY)
    if set_point is not None:
        axes.axhline(
            set_point + length,
            color=BLACK,
            linestyle="--",
            linewidth=1.0,
            label=f"desired apex, {100.0 * set_point:.0f} cm",
        )
    (trace,) = axes.plot([], [], color=BLUE, linewidth=0.9, label="body")
    (spring,) = axes.plot([], [], color=BLACK, linewidth=1.4)
    (rod,) = axes.plot([], [], color=GREEN, linewidth=3.0)
    box: dict[str, Any] = {"edgecolor": BLACK, "linewidth": 0.8, "zorder": 3}
    body = Rectangle((0.0, 0.0), *BODY, facecolor=BLUE, **box)
    actuator = Rectangle((0.0, 0.0), *ACTUATOR, facecolor=ORANGE, label="actuator", **box)
    for part in (body, actuator):
        axes.add_patch(part)
    (foot,) = axes.plot([], [], "_", color=BLACK, markersize=14.0, markeredgewidth=3.0, label="foot")
    said = axes.text(0.99, 0.01, "", transform=axes.transAxes, ha="right", va="bottom", family="monospace", fontsize=8)
    axes.set(ylim=(low, high), ylabel="height [m]", xticks=[], aspect="equal")
    axes.legend(loc="upper left", ncols=4)

    def place(t: float) -> list[Artist]:
        state, level, middle = run.at(t), float(run.foot(t)), float(position(run, np.array([t]))[0])
        low = float(state.x2) - SHANK - float(state.x1)
        past = np.linspace(0.0, t, 2 + int(200 * t))
        trace.set_data(position(run, past), np.asarray(run.at(past).x2))
        spring.set_data(*coil(middle, level, low))
        foot.set_data([middle], [level])
        rod.set_data([middle, middle], [low, float(state.x2)])
        for part, height, size in ((body, float(state.x2), BODY), (actuator, low, ACTUATOR)):
            part.set_xy((middle - size[0] / 2.0, height - size[1] / 2.0))
        said.set_text(f"t = {t:6.3f} s   u = {float(run.current(t)):6.2f} A")
        axes.set_xlim(middle - 0.62, middle + 0.62)
        return []

    return place


def coil(middle: float, low: float, high: float) -> tuple[Curve, Curve]:
    """A spring between two heights."""
    turns = 0.03 * np.array([0.0, *(1.0 if n % 2 else -1.0 for n in range(2 * COILS)), 0.0])
    return middle + turns, np.linspace(low, high, turns.size)
