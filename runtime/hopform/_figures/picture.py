"""A figure of the paper: a drawing with its caption under it, and the data behind it."""

# pyright: reportUnknownMemberType=false
# matplotlib's own annotations leave the type of **kwargs open.

import re
import textwrap
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hopform._figures.plots import STANCE, house_style, plain, run_times
from hopform._hopping.run import Run
from hopform._robots import Robot

try:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine
except ModuleNotFoundError as error:
    if error.name is None or error.name.partition(".")[0] != "matplotlib":
        raise
    from hopform._errors import MissingExtra

    raise MissingExtra("a figure", "plot") from None

Array = NDArray[np.float64]

BLUE, ORANGE, GREEN, MAGENTA, SKY, BLACK = "#0072B2", "#D55E00", "#009E73", "#A6257A", "#56B4E9", "#222222"
"""Of the palette of Okabe and Ito, which colour-blind readers distinguish."""
GROUND = "#8C8C8C"
WIDTH = 6.4  # [in]
_COLUMNS = 115  # of a caption's line at its size
_LINE = 0.132  # [in]


@dataclass(frozen=True)
class Picture:
    """A figure of the paper, redrawn. number: the paper's. paper: what it shows there. ours: what it shows here.

    robot: from whose parameters it is drawn. data: what is drawn, by name, SI units and A.
    """

    number: int
    title: str
    paper: str
    ours: str
    robot: str
    figure: Figure
    data: Mapping[str, Any]

    @property
    def caption(self) -> str:
        """The text under the figure."""
        return caption(self.number, self.title, self.paper, self.ours, self.robot)


def caption(number: int, title: str, paper: str, ours: str, robot: str) -> str:
    """The end of every caption: the paper's figure, this one, and whose parameters these are."""
    return (
        f"Fig. {number}. {title}. The paper shows {paper}. Here: {ours}. "
        f"Parameters: {robot}, this project's own; the paper gives none."
    )


def panels(rows: int, height: float, columns: int = 1, **how: Any) -> tuple[Figure, list[Axes]]:
    """A figure of so many panels, row by row, and so many inches; call it within `house_style`."""
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    return figure, list(figure.subplots(rows, columns, squeeze=False, **how).flat)


def finished(
    number: int, title: str, paper: str, ours: str, robot: str, figure: Figure, data: Mapping[str, Any]
) -> Picture:
    """The picture, its caption set under the panels."""
    text = re.sub(
        r"(\d) (?=(?:[cmk]?m|[mk]?[sV]|k?Hz|[AJN])\b)",
        "\\1\N{NO-BREAK SPACE}",
        caption(number, title, paper, ours, robot),
    )
    lines = textwrap.wrap(text, _COLUMNS)
    width, height = (float(each) for each in figure.get_size_inches())
    foot = _LINE * len(lines) + 0.12
    with house_style():
        figure.set_size_inches(width, height + foot)
        share = foot / (height + foot)
        figure.set_layout_engine(ConstrainedLayoutEngine(rect=(0.0, share, 1.0, 1.0 - share), w_pad=0.06, h_pad=0.05))
        figure.align_ylabels()
        figure.text(
            0.012, (foot - 0.06) / (height + foot), plain("\n".join(lines)), va="top", fontsize=7.2, linespacing=1.25
        )
    return Picture(number, title, paper, ours, robot, figure, data)


def legend(axes: Axes, columns: int = 3) -> None:
    """The legend above its panel, where it hides no curve."""
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns, borderaxespad=0.2, columnspacing=1.4)


def shade_stances(axes: Axes, run: Run) -> None:
    """The stances of a run behind its curves; the first one is named for the legend."""
    for hop in run.hops:
        axes.axvspan(hop.touchdown_time, hop.takeoff_time, zorder=0, label="" if hop.index else "stance", **STANCE)


def stairs(axes: Axes, run: Run, values: Array, **how: Any) -> None:
    """A value per hop of a run, from one touchdown to the next."""
    edges = [0.0, *(hop.touchdown_time for hop in run.hops[1:]), run.duration]
    axes.stairs(100.0 * values[: len(run.hops)], edges, baseline=None, **how)


def hop_heights(run: Run) -> tuple[Array, Array]:
    """Times [s], and the body's height [m] over level 0 less that in which the leg stands unloaded."""
    t = np.asarray(run_times(run), dtype=float)
    return t, np.asarray(run.at(t).x2, dtype=float) - (run.robot.L0 + run.robot.c)


def apexes(run: Run) -> tuple[Array, Array]:
    """Times [s] and heights [m] of a run's apexes; hops without take-off are left out."""
    found = [
        (hop.takeoff_time + max(float(hop.stance.takeoff.v2), 0.0) / run.robot.g, hop.apex)
        for hop in run.hops
        if hop.stance.takeoff is not None
    ]
    times, heights = np.array(found).reshape(-1, 2).T
    return times, heights


def standing(robot: Robot) -> float:
    """Height of the body [m] that stands on its spring, the actuator at 0."""
    return robot.L0 + robot.c - robot.m_s * robot.g / robot.k


def sampled_length(duration: float, rate: float) -> Array:
    """Times [s] of samples at a rate [1/s]."""
    return np.arange(int(duration * rate) + 1) / rate


def named(robot: Robot) -> str:
    """A robot's name in captions; Hopper B's input is in V, not in A."""
    return f"{robot.name} (its input is in V)" if robot.name == "hopper_b" else robot.name


def cm(metres: float, digits: int = 1) -> str:
    """A length in cm."""
    return f"{100.0 * metres:.{digits}f} cm"


def mm(metres: float, digits: int = 1) -> str:
    """A length in mm."""
    return f"{1000.0 * metres:.{digits}f} mm"
