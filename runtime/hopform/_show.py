"""How a result shows itself: three lines, a table with a curve, a plot, a dataset.

A result gives a `Card`, the figures that a reader looks for first, and its arrays by name; everything else is here.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from importlib import import_module
from operator import attrgetter
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hopform._checks import numbers, shaped, times_within
from hopform._errors import HopformError, MissingExtra, printable
from hopform._texts import in_html

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes

Figures = Sequence[tuple[str, object]]
"""Names and values, in SI units and A."""
Array = tuple[tuple[str, ...], ArrayLike] | tuple[tuple[str, ...], ArrayLike, Mapping[str, str]]
"""Dimensions, values, and `attrs` where the name does not say the unit."""
Arrays = Mapping[str, Array]
"""Arrays by name; one whose only dimension has its own name is a coordinate."""

UNITS: dict[str, str] = {
    "time": "s", "duration": "s", "horizon": "s", "apex_time": "s", "event_time": "s", "T": "s", "delay": "s",
    "x1": "m", "x2": "m", "foot": "m", "ground": "m", "terrain": "m", "compression": "m", "height": "m", "h_des": "m",
    "apex": "m", "lowest": "m", "highest": "m", "error": "m", "worst": "m", "rms": "m", "miss": "m",
    "onset_time": "s", "onset_u": "A", "onset_u_low": "A", "onset_u_high": "A", "compression_max": "m",
    "v1": "m/s", "v2": "m/s", "v2_after": "m/s", "end_compression": "m", "u": "A", "u_lowest": "A", "u_highest": "A", "hold": "A", "current": "A",
    "aed": "J", "body_energy": "J", "total_energy": "J", "predicted_energy": "J", "impact_loss": "J", "leg_loss": "J",
    "contact_force": "N", "chosen_u": "A", "chosen_apex": "m", "fixed_u": "A", "fixed_height": "m",
}  # fmt: skip
"""Units of what results hold, by name; what is not here is a number without one, or a word. Those of parameters are
facts of their solver.
"""

Picture = tuple[Callable[[Any, Any], None], Callable[[Any, Any], object]]
"""What fills a figure of matplotlib with a result, and what draws its main panel into axes."""
PICTURES: dict[type, Callable[[], Mapping[type, Picture]]] = {}
"""By the type of a result what imports the pictures of its room."""


def pictures(imported: Callable[[], Mapping[type, Picture]], *results: type) -> None:
    """Let `.plot()` and `--plot` draw some types of results: `imported` gives their pictures, by type, once one of them
    is asked for, so that a room loads no matplotlib before that.
    """
    PICTURES.update(dict.fromkeys(results, imported))


duration_of: Callable[[Any], float] = attrgetter("duration")
"""The duration [s] of a `OverTime`, whose subclasses have one each in its own way."""
MOST_POINTS = 320
"""Points of a small curve at most."""
WIDEST = 120
"""Characters of a line at most."""


class Card(NamedTuple):
    """What a reader looks for first: a title, what was given, what was found."""

    title: str
    given: Figures
    found: Figures


Curve = tuple[str, ArrayLike, ArrayLike]
"""What a small curve shows, in words, and its points."""


def same(one: Any, other: Any) -> bool:
    """Whether two values are equal: arrays by type, shape and numbers, NaN equal to NaN."""
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        left, right = cast(NDArray[Any], one), cast(NDArray[Any], other)
        return left.dtype == right.dtype and np.array_equal(left, right, equal_nan=left.dtype.kind == "f")
    if isinstance(one, Mapping):
        here, there = cast(dict[Any, Any], one), cast(dict[Any, Any], other)
        return here.keys() == there.keys() and all(same(here[name], there[name]) for name in here)
    if isinstance(one, (tuple, list)):
        several, others = cast(Sequence[Any], one), cast(Sequence[Any], other)
        return len(several) == len(others) and all(map(same, several, others))
    if is_dataclass(one):
        return all(same(getattr(one, each.name), getattr(other, each.name)) for each in fields(one) if each.compare)
    return bool(one == other) or (isinstance(one, float) and bool(np.isnan(one) and np.isnan(other)))


class Shown(ABC):
    """A result that shows itself. Two are equal if all of their numbers are; those with arrays have no hash."""

    def __eq__(self, other: object) -> bool:
        return same(self, other)

    def __hash__(self) -> int:
        raise TypeError(f"unhashable type: {type(self).__name__!r}")

    @abstractmethod
    def _card(self) -> Card: ...

    @abstractmethod
    def _arrays(self) -> Arrays: ...

    def _curve(self) -> Curve | None:
        return None

    def _unit(self, name: str) -> str | None:
        """The unit of something by its name, None for a number without one, or a word."""
        return UNITS.get(name)

    def _worded(self, figures: Figures) -> str:
        return ", ".join(worded(figure, self._unit(figure[0])) for figure in figures)

    def __repr__(self) -> str:
        card = self._card()
        lines = [printable(card.title), *(f"  {self._worded(figures)}" for figures in (card.given, card.found))]
        return "\n".join(line if len(line) <= WIDEST else f"{line[: WIDEST - 3]}..." for line in lines)

    def _repr_html_(self) -> str:
        """The same for a notebook, with the curve."""
        card, points = self._card(), self._curve()
        rows = "".join(
            f"<tr><th style='text-align:left'>{in_html(name)}</th>"
            f"<td>{in_html(shown_value(value))} {in_html(self._unit(name) or '')}</td></tr>"
            for name, value in (*card.given, *card.found)
        )
        curve = "" if points is None else sparkline(*points)
        return f"<div><b>{in_html(card.title)}</b><table>{rows}</table>{curve}</div>"

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """Draw it: the figure that `--plot` draws, or its main panel into the axes `ax`; the (first) axes.

        The figure is one of pyplot, so that `plt.show()` and notebooks show it, and `.plot().figure.savefig(...)`
        writes it. Raises MissingExtra without matplotlib.
        """
        return cast("Axes", self._drawn(self, ax))

    _drawn: ClassVar[Callable[..., Any]]
    """What draws; `_figures`, which stands above, binds it."""

    def to_xarray(self) -> "xarray.Dataset":
        """Its arrays with named dimensions, units in `attrs`; `.to_dataframe()` is one call from there.

        Raises MissingExtra without xarray.
        """
        return dataset(arrays_of(self), self._card().title)


class OverTime(Shown):
    """A result over time. Its subclasses have a `duration`, too."""

    def __hash__(self) -> int:
        return hash((type(self), duration_of(self)))

    def to_xarray(self, t: ArrayLike | None = None) -> "xarray.Dataset":
        """Its motion at times t [s], 401 uniform ones if left out, and its figures; units in `attrs`.

        Raises MissingExtra without xarray.
        """
        times = np.linspace(0.0, duration_of(self), 401) if t is None else np.atleast_1d(numbers("t", t, "s"))
        if times.ndim > 1:
            raise HopformError(f"t must have one dimension, got shape {times.shape}")
        return dataset(arrays_of(self, times), self._card().title)

    @abstractmethod
    def _over(self, t: NDArray[np.float64]) -> Mapping[str, ArrayLike]:
        """What moves, at times."""

    def _read(self, t: ArrayLike, values: Callable[[NDArray[np.float64]], Any]) -> list[Any]:
        """What a function gives at times t [s] of one dimension, in t's shape; HopformError for a time that is not of
        this result.
        """
        found = values(times_within(t, np.dtype(np.float64), duration_of(self)))
        return [shaped(each, t) for each in found]

    def _curve(self) -> Curve:
        """The height of the body over time."""
        t = np.linspace(0.0, duration_of(self), 121)
        return "x2 [m] over time [s]", t, self._over(t)["x2"]


def arrays_of(result: Shown, t: NDArray[np.float64] | None = None) -> Arrays:
    """The arrays of a result; of a motion also those over times t [s], ahead of the others."""
    motion: dict[str, Array] = {}
    if t is not None and isinstance(result, OverTime):
        over = result._over(t)  # pyright: ignore[reportPrivateUsage]
        motion = {"time": (("time",), t)}
        for name, values in over.items():
            unit = result._unit(name)  # pyright: ignore[reportPrivateUsage]
            motion[name] = (("time",), values, {"units": unit} if unit else {})
    return {**motion, **result._arrays()}  # pyright: ignore[reportPrivateUsage]


def worded(figure: tuple[str, object], unit: str | None) -> str:
    """A name and its value in words."""
    name, value = figure
    return f"{name} = {shown_value(value)}{f' {unit}' if unit not in (None, '', '1') else ''}"


def shown_value(value: object) -> str:
    """Five digits of a number, the span of several, a text without what no terminal shows."""
    if isinstance(value, (np.ndarray, list)):
        return span(cast(ArrayLike, value))
    if isinstance(value, (float, np.floating)):
        return f"{value:.5g}"
    return printable(str(value))


def span(values: ArrayLike) -> str:
    """The least and the largest of numbers, in words."""
    array = np.asarray(values, dtype=float)
    array = array[np.isfinite(array)]
    if not array.size:
        return "none"
    low, high = f"{array.min():.5g}", f"{array.max():.5g}"
    return low if low == high else f"{low} .. {high}"


def counted(words: ArrayLike) -> str:
    """How often each word occurs."""
    found, counts = np.unique(np.asarray(words), return_counts=True)
    return ", ".join(f"{count} {word}" for word, count in zip(found.tolist(), counts.tolist(), strict=True)) or "none"


def sparkline(words: str, x: ArrayLike, y: ArrayLike) -> str:
    """A small curve as inline SVG, interrupted where y is not finite."""
    wide, high = 320.0, 60.0
    xs, ys = np.asarray(x, dtype=float).reshape(-1), np.asarray(y, dtype=float).reshape(-1)
    every = -(-xs.size // MOST_POINTS) or 1
    xs, ys = xs[::every], ys[::every]
    good = np.isfinite(xs) & np.isfinite(ys)
    if not good.any():
        return ""
    across = wide * _share(xs, xs[good])
    down = high - 4.0 - (high - 8.0) * _share(ys, ys[good])
    pens = np.where(np.append(False, good[:-1]), "L", "M")
    path = [f"{pens[n]}{across[n]:.1f},{down[n]:.1f}" for n in np.flatnonzero(good)]
    words = in_html(f"{words}: {span(ys)}")
    return (
        f"<svg width='{wide:g}' height='{high:g}' role='img' aria-label='{words}' xmlns='http://www.w3.org/2000/svg'>"
        f"<title>{words}</title><path d='{' '.join(path)}' fill='none' stroke='#0072B2' stroke-width='1.5' "
        f"stroke-linecap='round'/></svg><div><small>{words}</small></div>"
    )


def _share(values: NDArray[np.float64], within: NDArray[np.float64]) -> NDArray[np.float64]:
    """Where values lie between the least and the largest of some, 0 to 1; 1/2 where those are one."""
    low, width = float(within.min()), float(np.ptp(within))
    with np.errstate(invalid="ignore"):
        return (values - low) / width if width > 0.0 else np.full_like(values, 0.5)


def needs(package: str, extra: str, what: str) -> Any:
    """A package that an extra brings; MissingExtra without it."""
    try:
        return import_module(package)
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] != package:
            raise
        raise MissingExtra(what, extra) from None


def xarray_of() -> Any:
    """xarray, of the extra with that name."""
    return needs("xarray", "xarray", "a Dataset")


def dataset(arrays: Arrays, title: str) -> "xarray.Dataset":
    """Arrays with their names and units."""
    of_xarray = xarray_of()
    variables: dict[str, Any] = {}
    for name, (dims, values, *more) in arrays.items():
        attrs = more[0] if more else {"units": UNITS[name]} if name in UNITS else {}
        variables[name] = of_xarray.Variable(dims, np.asarray(values), attrs)
    coords = {name: each for name, each in variables.items() if each.dims == (name,)}
    rest = {name: each for name, each in variables.items() if name not in coords}
    return cast("xarray.Dataset", of_xarray.Dataset(rest, coords, {"title": title}))


def events_of(events: Sequence[Any]) -> dict[str, Array]:
    """Times and kinds of events, as arrays."""
    kinds = np.array([each.kind for each in events], dtype=str)
    return {"event_time": (("event",), [each.time for each in events]), "event_kind": (("event",), kinds)}
