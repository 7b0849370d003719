"""Pictures of recordings and fits."""

# pyright: reportUnknownMemberType=false
# matplotlib's own annotations leave the type of **kwargs open.
import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hopform._figures import plots
from hopform._show import Picture
from hopform.identify._estimation import Estimate
from hopform.identify._fits import Fit, Trace
from hopform.identify._recordings import DRIVES, SI, Recording


def plot_recording(figure: Figure, recording: Recording) -> None:
    """The columns of a recording over time."""
    with plots.framed(figure, 6.4, 1.6 * len(recording.columns) + 0.8, Path(recording.source).name):
        rows = figure.subplots(len(recording.columns), 1, sharex=True, squeeze=False)[:, 0]
        for axes, name in zip(rows, _by_name(recording), strict=True):
            recording_panel(axes, recording, name)
            axes.label_outer()


def _by_name(recording: Recording) -> list[str]:
    """Its columns as they are drawn from the top: x, u, F."""
    return sorted(recording.columns, reverse=True)


def recording_panel(axes: Axes, recording: Recording, name: str | None = None) -> None:
    """One column of a recording over time; the one that is drawn at the top where none is named."""
    shown = name or _by_name(recording)[0]
    column = recording.columns[shown]
    scale, unit = (100.0, "cm") if column.quantity == "length" else (1.0, SI[column.quantity])
    colour = plots.CURRENT if column.quantity in DRIVES else plots.BLUE
    axes.plot(recording.time, scale * column.values, lw=0.9, color=colour)
    axes.set(xlabel="t [s]", ylabel=f"{shown} [{unit}]")


def plot_fit(figure: Figure, fit: Fit) -> None:
    """Each recording with both models, the residuals over time, position and velocity, then the intervals of the
    parameters and their correlations.
    """
    traces, shown = [trace for trace in fit.traces if trace.time.size > 1], _with_intervals(fit)
    names = list(dict.fromkeys(name for pair in fit.correlations for name in pair))
    last = 0.7 + 0.22 * max(len(shown), len(names))
    with plots.framed(figure, 8.0, 5.6 * len(traces) + last, "Identification: " + fit.title):
        heights = [*([2.0, 1.3, 1.3] * len(traces)), max(last, 1.0)]
        grid = figure.add_gridspec(len(heights), 2, height_ratios=heights)
        for n, trace in enumerate(traces):
            above, below = (figure.add_subplot(grid[3 * n + row, :]) for row in range(2))
            left = figure.add_subplot(grid[3 * n + 2, 0])
            right = figure.add_subplot(grid[3 * n + 2, 1], sharey=left)
            _draw_trace(above, below, trace, fit)
            _draw_residuals(left, right, trace, fit)
        _draw_intervals(figure.add_subplot(grid[-1, 0] if names else grid[-1, :]), shown)
        if names:
            _draw_correlations(figure.add_subplot(grid[-1, 1]), fit.correlations, names)


def _draw_residuals(left: Axes, right: Axes, trace: Trace, fit: Fit) -> None:
    """Residuals over position, where a guide shows, and over velocity, where a friction law does."""
    unit, factor = fit.units_of(trace).shown(trace.quantity)
    residual, rate = factor * (trace.predicted - trace.measured), factor * np.gradient(trace.predicted, trace.time)
    left.plot(factor * trace.predicted, residual, ".", ms=1.5, color=plots.BLUE)
    left.set(xlabel=f"{fit.called(trace)} [{unit}]", ylabel=f"residual [{unit}]")
    right.plot(rate, residual, ".", ms=1.5, color=plots.BLUE)
    right.set(xlabel=f"d {fit.called(trace)}/dt [{unit}/s]")
    right.tick_params(labelleft=False)
    for axes in (left, right):
        axes.margins(x=0.02)


def _draw_correlations(axes: Axes, correlations: Mapping[tuple[str, str], float], names: Sequence[str]) -> None:
    """Correlations of the parameters from -1, blue, to 1, red."""
    table = np.eye(len(names))
    for pair, value in correlations.items():
        row, column = map(names.index, pair)
        table[row, column] = table[column, row] = value
    axes.imshow(table, cmap="RdBu_r", vmin=-1.0, vmax=1.0)
    axes.set_xticks(range(len(names)), names, rotation=90)
    axes.set(yticks=range(len(names)), yticklabels=names, xlabel="correlations")
    axes.grid(visible=False)


def _draw_trace(above: Axes, below: Axes, trace: Trace, fit: Fit) -> None:
    unit, factor = fit.units_of(trace).shown(trace.quantity)
    trace_panel(above, trace, fit)
    if trace.old is not None:
        below.plot(trace.time, factor * (trace.old - trace.measured), lw=0.6, color=plots.MAGENTA)
    below.plot(trace.time, factor * (trace.predicted - trace.measured), lw=0.6, color=plots.BLUE)
    above.set(xlabel="", xticklabels=[])
    below.set(xlabel="t [s]", ylabel=f"residual [{unit}]", xlim=above.get_xlim())


def trace_panel(axes: Axes, trace: Trace, fit: Fit) -> None:
    """A recording beside the models that were fitted to it."""
    (unit, factor), (old, new) = fit.units_of(trace).shown(trace.quantity), fit.rivals
    axes.plot(trace.time, factor * trace.measured, ".", ms=2, color=plots.GREY, label="measured")
    if trace.old is not None:
        axes.plot(trace.time, factor * trace.old, "--", lw=0.9, color=plots.MAGENTA, label=old)
    axes.plot(trace.time, factor * trace.predicted, lw=1.1, color=plots.BLUE, label=new)
    axes.set(xlabel="t [s]", ylabel=f"{fit.called(trace)} [{unit}]")
    axes.margins(x=0.01)
    axes.set_title(plots.literal(Path(trace.label).name), loc="left", fontsize=9, pad=20.0)  # above the legend
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, fontsize=7, frameon=False)


def _with_intervals(fit: Fit) -> list[Estimate]:
    """Estimates whose interval is shown as a share of the value: none that may have either sign, none of one
    recording.
    """
    bounded = [each for each in fit.estimates if not each.own and math.isfinite(each.high - each.low)]
    return [each for each in bounded if each.high - each.low < 2.0 * abs(each.value)]


def _draw_intervals(axes: Axes, shown: Sequence[Estimate]) -> None:
    """95 % intervals as shares of the values, on a scale that shows small and large ones."""
    for row, estimate in enumerate(reversed(shown)):
        ends = 100.0 * (np.array([estimate.low, estimate.high]) - estimate.value) / abs(estimate.value)
        axes.plot(ends, [row, row], "|-", color=plots.BLUE)
        axes.plot([0.0], [row], "o", ms=3, color=plots.BLUE)
    axes.set(xlabel="95 % interval about the value [%]")
    axes.set_yticks(range(len(shown)), [each.name for each in reversed(shown)])
    axes.set_xscale("symlog", linthresh=0.1)
    axes.xaxis.set_major_formatter("{x:g}")
    axes.margins(x=0.05, y=0.1)


OF_RESULTS: Mapping[type, Picture] = {
    Recording: (plot_recording, recording_panel),
    Fit: (plot_fit, lambda axes, fit: trace_panel(axes, fit.traces[0], fit)),
}
