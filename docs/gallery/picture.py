"""A figure of the paper: a drawing with its caption, and the data behind it."""

# pyright: reportUnknownMemberType=false
# matplotlib's own annotations leave the type of **kwargs open.

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hopform import Robot
from hopform._figures.plots import house_style, render
from hopform.hopping import Run

Array = NDArray[np.float64]

WIDTH = 4.2
"""[in] of every figure: letters stay readable on a telephone."""


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

    def in_markdown(self, file: str) -> str:
        """A section of a page: the figure, whose file it names, and its caption."""
        whose = f"{self.robot}, this project's own; the paper gives none"
        return (
            f"## Fig. {self.number}. {self.title}\n\n![Fig. {self.number}]({file})\n\n"
            f"**The paper** shows {self.paper}.\n\n**Here:** {self.ours}.\n\nParameters: {whose}.\n"
        )


Drawn = tuple[Figure, str, Mapping[str, Any]]
"""The panels of a figure, what they show here, and the data."""


def panels(rows: int, height: float, **how: Any) -> tuple[Figure, list[Axes]]:
    """A figure of so many panels, one above the other, and so many inches; call it within `house_style`."""
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    return figure, list(figure.subplots(rows, 1, squeeze=False, **how).flat)


def finished(number: int, title: str, paper: str, robot: Robot, make: Callable[[Robot], Drawn]) -> Picture:
    """The picture that is made of a robot."""
    with house_style():
        figure, ours, data = make(robot)
        figure.align_ylabels()
    return Picture(number, title, paper, ours, named(robot), figure, data)


def as_svg(figure: Figure) -> bytes:
    """A figure as the bytes of a file, the same bytes each time."""
    return render(figure, ".svg")


def legend(axes: Axes, columns: int = 2, **how: Any) -> None:
    """The legend above its panel, where it hides no curve; one column where long words have no room beside each other."""
    longest = max((len(words) for words in axes.get_legend_handles_labels()[1]), default=0)
    columns = columns if longest <= 25 else 1
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns, borderaxespad=0.2, columnspacing=1.4, **how)


def standing(robot: Robot) -> float:
    """Height of the body [m] that stands on its leg, the actuator at 0."""
    return robot.L0 + robot.c - robot.m_s * robot.g / robot.k


def stream(figure: int) -> np.random.Generator:
    """The random numbers of a figure, a stream of its own."""
    return np.random.default_rng(np.random.SeedSequence(figure, spawn_key=(6,)))


def named(robot: Robot) -> str:
    """A robot's name in captions; Hopper B's input is in V, not in A."""
    return f"{robot.name} (its input is in V)" if robot.name == "hopper_b" else robot.name


def volts(robot: Robot) -> str:
    """The unit of a robot's input."""
    return "V" if robot.name == "hopper_b" else "A"


def completed(run: Run) -> Run:
    """The run, which has hopped over all of its ground."""
    if run.status != "completed":
        raise RuntimeError(f"{run.robot.name} does not hop on: {run.status} after {len(run.hops)} hops")
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
