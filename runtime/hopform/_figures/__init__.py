"""Pictures: what `.plot()` of a result and `--plot` of a command draw. They need the extra `plot`, which is imported when
one is asked for.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, cast

from hopform._batch import Batch
from hopform._checks import instance
from hopform._control import Command, Reachability
from hopform._errors import HopformError
from hopform._flight import Flight
from hopform._flights import Flights
from hopform._hops import Hops
from hopform._motion import Motion
from hopform._sensitivities import Sensitivities
from hopform._show import PICTURES, Picture, Shown, needs, pictures
from hopform._stance import Stance

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def of_core() -> Mapping[type, Picture]:
    """The pictures of the results of this room."""
    from hopform._figures.plots import OF_RESULTS

    return OF_RESULTS


pictures(of_core, Motion, Stance, Flight, Flights, Batch, Hops, Sensitivities, Reachability, Command)


def figure_of(result: Shown) -> "Figure":
    """The whole picture of a result, in a figure of matplotlib that needs no display."""
    fill, _ = picture_of(result)
    from matplotlib.figure import Figure

    from hopform._figures.plots import house_style

    with house_style():
        figure = Figure()
    fill(figure, result)
    return figure


def drawn(result: Shown, axes: "Axes | None") -> "Axes":
    """The first axes of its picture in a figure of pyplot, or `axes` with its main panel."""
    fill, panel = picture_of(result)
    from matplotlib import pyplot as _pyplot
    from matplotlib.axes import Axes

    if axes is not None:
        panel(instance("ax", axes, Axes, "axes of matplotlib"), result)
        return axes
    pyplot: Any = _pyplot
    figure = pyplot.figure()  # outside of the house style: with the first one a notebook sets up its own
    try:
        fill(figure, result)
    except BaseException:
        pyplot.close(figure)
        raise
    return cast("Axes", figure.axes[0])


def picture_of(result: Shown) -> Picture:
    """What draws a result; MissingExtra without matplotlib."""
    if type(result) not in PICTURES:
        raise HopformError(f"there is no plot of {type(result).__name__}; `to_xarray` has its numbers")
    needs("matplotlib", "plot", "a plot")
    return PICTURES[type(result)]()[type(result)]


# What `plot` of a result calls, from below.
Shown._drawn = staticmethod(drawn)  # pyright: ignore[reportPrivateUsage]
