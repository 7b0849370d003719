"""What a fit leaves open in an answer: the same question to robots that are drawn from an identified one.

A controller has the fitted robot, the one that hops is drawn. A band goes from the 2.5 % to the 97.5 % quantile.
"""

# pyright: reportUnknownMemberType=false
# matplotlib's own annotations leave the type of **kwargs open.

import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from hopform import HopformError, Robot, reachability, solve_stances, touchdown_velocity
from hopform._checks import MEMORY, Array
from hopform._cli.output import Record, ends
from hopform._cli.use import robot_in_use
from hopform._files import name_of
from hopform._progress import progress_bar
from hopform._robots import Provenance

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Bands(NamedTuple):
    """95 % bands, arrays in the shape of the values, or numbers for one of these: NaN where no robot has a value; and
    the share of the robots that have one.
    """

    low: Any
    high: Any
    share: Any

    def at(self, *index: int) -> "Bands":
        """One of them."""
        return Bands(*(each[index] for each in self))

    def text(self, scale: float = 100.0, form: str = ".4g") -> str:
        """A band in a table, with the share of the robots if that is not all."""
        text = ends(self.low, self.high, form, scale)
        return text if self.share == 1.0 else f"{text} ({100.0 * self.share:.3g} % of robots)"

    @staticmethod
    def draw(several: "Sequence[Bands]", x: Array, axes: "Axes", bars: bool = False) -> None:
        """Shade bands [m] over x, in cm, or draw a bar for each; the legend of the panel has them, or one of their own."""
        from hopform._figures.plots import MAGENTA, house_style

        look: Record = {"color": MAGENTA, "label": "95 % by the fit"}
        for bands in several:
            low, high = 100.0 * bands.low, 100.0 * bands.high
            if bars:
                axes.plot([x, x], [low, high], "_", markersize=7.0, color=MAGENTA, zorder=4, clip_on=False)
                axes.vlines(x, low, high, linewidth=1.6, zorder=4, **look)
            else:
                axes.fill_between(x, low, high, alpha=0.35, linewidth=0.0, **look)
        shown = axes.get_legend_handles_labels()[0]
        with house_style():
            axes.legend(handles=shown if axes.get_legend() else shown[-1:])


class Draws(NamedTuple):
    """Robots drawn from the fit of an identified one, the model; the seed draws them again."""

    model: Robot
    fit: Provenance
    robots: tuple[Robot, ...]
    seed: int

    def record(self) -> Record:
        """What was drawn, for JSON."""
        return {"count": len(self.robots), "seed": self.seed, "names": self.fit.names, "white": self.fit.white}

    def said(self) -> str:
        """What was drawn, and what was not."""
        known = {*self.fit.names, *self.fit.known}
        others = ", ".join(each.name for each in self.model.fields() if each.name not in known)
        whose = f"drawn from the fit of {', '.join(self.fit.names)}"
        return f"95 % bands of {len(self.robots)} robots {whose}. Not identified, so equal in all: {others}."

    def warnings(self) -> tuple[str, ...]:
        """A warning about a fit that misses something."""
        missed = "the residuals of the fit are not white: the bands do not cover the error of its model"
        return () if self.fit.white else (missed,)

    def apexes(self, start: Record, height: float | None, datum: float, u: Any, how: Record) -> Bands:
        """Bands of the next apex [m] over the datum under currents [A].

        start: x1, v1, v2, x2 or compression at touchdown. After a drop from a height [m] each robot has its own v2; if
        x2 is given all are compressed as the model is.
        """
        names = [field.name for field in self.model.fields()]
        columns: Record = {name: np.array([[each[name]] for each in self.robots]) for name in names}
        own = dict(start)
        if height is not None:
            own["v2"] = np.array([[touchdown_velocity(each, height)] for each in self.robots])
        if own["x2"] is not None:
            length = self.model.solver.package.formulas.second_position  # at x1 = y = 0
            each, own_length = (
                length(of, 0.0, 0.0) for of in (type(self.model.parameters)(**columns), self.model.parameters)
            )
            own["x2"] = own["x2"] + each - own_length
        batch = solve_stances(self.model, **own, u=np.atleast_1d(u), **how, **columns)
        return self.bands(batch.apex.astype(np.float64) - datum)

    def maps(self, heights: Array, currents: Array, how: Record) -> dict[str, Bands]:
        """Bands of a map's `apex` (heights, currents), and of its `lowest`, `highest`, `hold` (heights)."""
        found = [reachability(each, heights, currents, **how) for each in self.each()]
        names = ("apex", "lowest", "highest", "hold")
        return {name: self.bands(np.array([getattr(each, name) for each in found])) for name in names}

    @staticmethod
    def bands(values: Array) -> Bands:
        """Bands over the first axis, that of the robots; NaN is a robot without a value."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # where no robot has one
            low, high = np.nanquantile(values, (0.025, 0.975), axis=0)
        return Bands(low, high, np.isfinite(values).mean(axis=0))

    def each(self) -> Iterator[Robot]:
        """The robots one by one, with a bar that shows how many are done."""
        with progress_bar(f"{len(self.robots)} robots") as step:
            for done, each in enumerate(self.robots):
                step(done, len(self.robots))
                yield each


def robot_and_draws(
    act: str, name: str | None, values: Sequence[str] | None, file: Path | None, count: int, seed: int, cells: int = 1
) -> tuple[Robot, Draws | None]:
    """The robot that a command is about, and those drawn from its fit where that is asked for.

    act: what the command has the model do; cells: values of each robot's answer.
    """
    if file is None:
        return robot_in_use(name, values, act), None
    if name is not None:
        raise HopformError("--robot and --from-fit exclude each other: both name the robot")
    if count * cells > MEMORY // 128:
        raise HopformError(f"--draws must be at most {MEMORY // 128 // cells} for so large an answer, got {count}")
    robot = robot_in_use(file, values, act)
    if robot.fit is None:
        raise HopformError(f"--from-fit takes a robot that `identify --out` wrote; {name_of(file)} has no fit")
    return robot, Draws(robot, robot.fit, robot.sample(count, seed), seed)
