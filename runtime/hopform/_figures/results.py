"""The picture of each type of result, whole and as one panel: what `.plot()` and `--plot` draw."""

# pyright: reportUnknownMemberType=false

from collections.abc import Callable
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hopform._checks import shown
from hopform._errors import HopformError
from hopform._figures import fits, plots
from hopform._show import Shown

Whole = Callable[[Any, plots.Make], Figure]
Panel = Callable[[Axes, Any], object]


def alone(panel: Panel, width: float, height: float) -> Whole:
    """A figure of that panel alone [in]."""

    def whole(result: Any, make: plots.Make) -> Figure:
        with plots.framed(make, width, height, plots.literal(repr(result).partition("\n")[0])) as figure:
            panel(figure.subplots(), result)
        return figure

    return whole


PICTURES: dict[str, tuple[Whole, Panel]] = {
    "Stance": (plots.plot_stance, plots.stance_panel),
    "Flight": (plots.plot_flight, plots.flight_panel),
    "Hop": (plots.plot_run, plots.run_panel),
    "Run": (plots.plot_run, plots.run_panel),
    "Batch": (alone(plots.batch_panel, 6.0, 3.6), plots.batch_panel),
    "Sensitivities": (alone(plots.sensitivities_panel, 9.0, 3.6), plots.sensitivities_panel),
    "Reachability": (plots.plot_reach, plots.reach_panel),
    "Command": (plots.plot_command, plots.command_panel),
    "Recording": (fits.plot_recording, fits.recording_panel),
    "Fit": (fits.plot_fit, lambda axes, fit: fits.trace_panel(axes, fit.traces[0], fit.units)),
    "Threshold": (fits.plot_threshold, lambda axes, found: fits.rise_panel(axes, found.rises[0], found.units)),
}


def figure_of(result: Shown, make: plots.Make = Figure) -> Figure:
    """The whole picture of a result."""
    whole, _ = _picture_of(result)
    return whole(result, make)


def drawn(result: Shown, axes: Axes | None) -> Axes:
    """The first axes of its picture in a figure of pyplot, or `axes` with its main panel."""
    whole, panel = _picture_of(result)
    if axes is not None:
        if not isinstance(axes, Axes):
            raise HopformError(f"ax must be axes of matplotlib, got {shown(axes)}")
        panel(axes, result)
        return axes
    from matplotlib import pyplot

    figure = pyplot.figure()  # outside of the house style: with the first one a notebook sets up its own

    def made(figsize: tuple[float, float], layout: Any) -> Figure:
        figure.set_size_inches(figsize)
        figure.set_layout_engine(layout)
        return figure

    try:
        return whole(result, made).axes[0]
    except BaseException:
        pyplot.close(figure)
        raise


def _picture_of(result: Shown) -> tuple[Whole, Panel]:
    name = type(result).__name__
    if name not in PICTURES:
        raise HopformError(f"there is no plot of {name}; `to_xarray` has its numbers")
    return PICTURES[name]
