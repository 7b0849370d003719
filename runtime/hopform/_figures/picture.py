"""A figure of the paper: a drawing with its caption under it, and the data behind it."""

# pyright: reportUnknownMemberType=false
# matplotlib's own annotations leave the type of **kwargs open.

import re
import textwrap
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from numpy.typing import NDArray

from hopform import ROBOTS, HopformError, Robot, Run
from hopform._figures.plots import LOOK, house_style, plain
from hopform._stance import rest_of
from hopform._words import name_of

Array = NDArray[np.float64]

_COLUMNS = 115  # of a caption's line at its size
_LINE = 0.132  # [in]


class Picture(NamedTuple):
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
    def whose(self) -> str:
        """Whose parameters these are."""
        ours = any(self.robot.startswith(name) for name in ROBOTS)
        whose = "this project's own; the paper gives none" if ours else "from its robot file"
        return f"{self.robot}, {whose}"

    @property
    def caption(self) -> str:
        """The text under the figure."""
        head = f"Fig. {self.number}. {self.title}. The paper shows {self.paper}."
        return f"{head} Here: {self.ours}. Parameters: {self.whose}."


Drawn = tuple[Figure, str, Mapping[str, Any]]
"""The panels of a figure, what they show here, and the data."""


def panels(rows: int, height: float, columns: int = 1, **how: Any) -> tuple[Figure, list[Axes]]:
    """A figure of so many panels, row by row, and so many inches; call it within `house_style`."""
    width = LOOK.get().width
    figure = Figure(figsize=(width, height * max(1.0, (6.4 / width) ** 0.5)), layout="constrained")
    return figure, list(figure.subplots(rows, columns, squeeze=False, **how).flat)


def finished(number: int, title: str, paper: str, robot: Robot, make: Callable[[Robot], Drawn]) -> Picture:
    """The picture that is made of a robot, its caption set under the panels; a title may hold the robot's {name}."""
    with house_style():
        figure, ours, data = make(robot)
        picture = Picture(number, title.format(name=name_of(robot)), paper, ours, named(robot), figure, data)
        if LOOK.get().with_caption:
            set_under(figure, picture.caption)
        figure.align_ylabels()
    return picture


def set_under(figure: Figure, caption: str) -> None:
    """A text under the panels, whose numbers keep their units in the line."""
    text = re.sub(r"(\d) (?=(?:[cmk]?m|[mk]?[sV]|k?Hz|[AJN])\b)", "\\1\N{NO-BREAK SPACE}", caption)
    lines = textwrap.wrap(text, round(_COLUMNS * LOOK.get().width / 6.4))
    width, height = (float(each) for each in figure.get_size_inches())
    foot = _LINE * len(lines) + 0.12
    whole, words = height + foot, plain("\n".join(lines))
    figure.set_size_inches(width, whole)
    room = (0.0, foot / whole, 1.0, 1.0 - foot / whole)
    figure.set_layout_engine(ConstrainedLayoutEngine(rect=room, w_pad=0.06, h_pad=0.05))
    figure.text(0.012, (foot - 0.06) / whole, words, va="top", fontsize=7.2, linespacing=1.25)


def legend(axes: Axes, columns: int = 3, **how: Any) -> None:
    """The legend above its panel, where it hides no curve, in as many columns as have room beside each other."""
    longest = max((len(words) for words in axes.get_legend_handles_labels()[1]), default=0)
    columns = max(1, min(columns, int(LOOK.get().width / max(2.1, 0.6 + 0.06 * longest))))
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns, borderaxespad=0.2, columnspacing=1.4, **how)


def unloaded(robot: Robot) -> float:
    """Length of the leg [m] that carries nothing, the actuator at 0."""
    return float(robot.letters.L0 + robot.letters.c - rest_of(robot))


def standing(robot: Robot) -> float:
    """Height of the body [m] that stands on its leg, the actuator at 0: what acts on it at rest and the leg balance."""
    rates = robot.solver.package.formulas.rates_of(robot.parameters)
    return unloaded(robot) + float(rates.a2_0 / rates.a2_y)


def named(robot: Robot) -> str:
    """A robot's name in captions; Hopper B's input is in V, not in A."""
    return f"{name_of(robot)} (its input is in V)" if robot.name == "hopper_b" else name_of(robot)


def volts(robot: Robot) -> str:
    """The unit of a robot's input."""
    return "V" if robot.name == "hopper_b" else "A"


def scale(robot: Robot) -> float:
    """Heights of a robot over those of the shipped ones: they grow with the leg, of 0.4 m there."""
    return float(robot.letters.L0 / 0.4)


def movable(robot: Robot) -> Robot:
    """The robot; HopformError for one whose actuator cannot be driven."""
    if not (
        0.0 < robot.letters.u_max < np.inf
        and robot.letters.gamma2 != 0.0
        and robot.letters.x1_min < robot.letters.x1_max
    ):
        raise HopformError(f"{name_of(robot)} has no actuator to drive: it needs a finite u_max, gamma2 and a stroke")
    return robot


def completed(run: Run) -> Run:
    """The run; HopformError for one that has not hopped over all of its ground."""
    if run.status != "completed":
        raise HopformError(f"{name_of(run.robot)} does not hop on: {run.status} after {len(run.hops)} hops")
    return run


def rms(values: Array) -> float:
    """Root mean square of what is a number; NaN where nothing is."""
    found = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(found**2))) if found.size else np.nan


def cm(metres: float, digits: int = 1) -> str:
    """A length in cm."""
    return f"{100.0 * metres:.{digits}f} cm"


def mm(metres: float, digits: int = 1) -> str:
    """A length in mm."""
    return f"{1000.0 * metres:.{digits}f} mm"
