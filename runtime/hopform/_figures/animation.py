"""The hopper on rough ground under the energy-based controller, moving."""

# pyright: reportUnknownMemberType=false

from pathlib import Path

import numpy as np
from matplotlib.animation import PillowWriter
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from hopform._figures.picture import BLACK, BLUE, GREEN, GROUND, ORANGE, Array, cm
from hopform._figures.plots import house_style
from hopform._hopping.run import Run, simulate
from hopform._robots import load_robot
from hopform.controllers import FeedForward
from hopform.terrain import uniform

STRIDE = 0.45  # [m] between two footholds, for the eye alone: the robot is constrained to its vertical
BODY, ACTUATOR = (0.22, 0.10), (0.12, 0.045)  # [m] width, height
SHANK = 0.08  # [m] from the body's middle to the actuator's at x1 = 0
WANTED = 0.18
COILS = 7


def animate(path: Path, seconds: float | None = None, rate: int = 12) -> Run:
    """Write a GIF of 6 hops at half speed, or of its first seconds, `rate` pictures a second; the run that it
    shows."""
    robot = load_robot("hopper_c")
    run = simulate(robot, uniform(6, 0.04, seed=4), FeedForward(WANTED), height=WANTED)
    end = run.duration if seconds is None else min(seconds / 2.0, run.duration)
    times = np.arange(0.0, end, 0.5 / rate)
    with house_style():
        figure = Figure(figsize=(5.4, 3.6), dpi=100, layout="constrained")
        axes = figure.subplots()
        parts = scene(axes, run)
        writer = PillowWriter(fps=rate, metadata={"Software": "hopform"})
        writer.setup(figure, str(path), dpi=100)
        figure.draw_without_rendering()
        figure.set_layout_engine("none")  # laid out once
        for t in times.tolist():
            place(axes, parts, run, t)
            writer.grab_frame()
        writer.finish()
    return run


def position(run: Run, t: Array) -> Array:
    """Position of the robot in the picture [m]: on its foothold in stance, on the way to the next one in flight."""
    corners = [0.0, *(time for hop in run.hops for time in (hop.touchdown_time, hop.takeoff_time)), run.duration]
    places = [-1, *(hop.index for hop in run.hops for _ in range(2)), len(run.hops)]
    return STRIDE * np.interp(t, corners, places)


def scene(axes: Axes, run: Run) -> dict[str, Line2D | Rectangle]:
    """The static parts, ground and set point, and the moving ones."""
    edges = STRIDE * (np.arange(len(run.terrain) + 1) - 0.5)
    edges[0], edges[-1] = -3 * STRIDE, edges[-1] + 3 * STRIDE
    axes.stairs(run.terrain, edges, baseline=-0.2, fill=True, facecolor="#DDDDDD", edgecolor=GROUND)
    length = run.robot.L0 + run.robot.c
    axes.axhline(WANTED + length, color=BLACK, linestyle="--", linewidth=1.0, label=f"wanted apex, {cm(WANTED, 0)}")
    (trace,) = axes.plot([], [], color=BLUE, linewidth=0.9, label="body")
    (spring,) = axes.plot([], [], color=BLACK, linewidth=1.4)
    (rod,) = axes.plot([], [], color=GREEN, linewidth=3.0)
    body = Rectangle((0.0, 0.0), *BODY, facecolor=BLUE, edgecolor=BLACK, linewidth=0.8, zorder=3)
    actuator = Rectangle(
        (0.0, 0.0), *ACTUATOR, facecolor=ORANGE, edgecolor=BLACK, linewidth=0.8, zorder=3, label="actuator"
    )
    for box in (body, actuator):
        axes.add_patch(box)
    axes.set_ylim(-0.09, 0.78)
    axes.set_ylabel("height [m]")
    axes.set_xticks([])
    axes.set_aspect("equal")
    axes.legend(loc="upper left", ncols=3)
    return {"trace": trace, "spring": spring, "rod": rod, "body": body, "actuator": actuator}


def place(axes: Axes, parts: dict[str, Line2D | Rectangle], run: Run, t: float) -> None:
    """The parts at a time, the view moved along."""
    state, foot, middle = run.at(t), float(run.foot(t)), float(position(run, np.array([t]))[0])
    low = float(state.x2) - SHANK - float(state.x1)
    past = np.linspace(0.0, t, 2 + int(200 * t))
    moved = {
        "trace": (position(run, past), np.asarray(run.at(past).x2)),
        "spring": coil(middle, foot, low),
        "rod": (np.array([middle, middle]), np.array([low, float(state.x2)])),
    }
    for name, (x, y) in moved.items():
        line = parts[name]
        assert isinstance(line, Line2D)
        line.set_data(x, y)
    for name, height, size in (("body", float(state.x2), BODY), ("actuator", low, ACTUATOR)):
        box = parts[name]
        assert isinstance(box, Rectangle)
        box.set_xy((middle - size[0] / 2.0, height - size[1] / 2.0))
    axes.set_xlim(middle - 0.62, middle + 0.62)


def coil(middle: float, low: float, high: float) -> tuple[Array, Array]:
    """A spring between two heights."""
    turns = 0.03 * np.array([0.0, *(1.0 if n % 2 else -1.0 for n in range(2 * COILS)), 0.0])
    return middle + turns, np.linspace(low, high, turns.size)
