"""Pictures of motions, stances and flights, ready for a paper: units, legends, colours that colour-blind readers
distinguish.

`plot_...(figure, result)` fills a figure: matplotlib's Figure, which needs no display, or pyplot's.
`..._panel(axes, result)` draws the main panel alone. `render` turns a figure into the bytes of a file, the same bytes
each time. The extra `plot` brings matplotlib.
"""

# pyright: reportUnknownMemberType=false
# matplotlib's own annotations leave the type of **kwargs open.

import io
import logging
import math
import re
import textwrap
import warnings
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any

import matplotlib.style
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from hopform._batch import Batch, Motions
from hopform._control import Command, Reachability
from hopform._errors import HopformError
from hopform._figures.palette import PALETTE
from hopform._flight import Flight
from hopform._flights import Flights
from hopform._hops import Hops
from hopform._motion import Mass, Motion, Phase, energies_of, force_units, masses_of, unit_of_time, units_of_energies
from hopform._robots import Robot
from hopform._sensitivities import Sensitivities
from hopform._show import Picture
from hopform._stance import Stance
from hopform._words import modes_of, name_of, start_of

SUFFIXES = {
    ".svg": {"Date": None, "Creator": "hopform"},
    ".pdf": {"CreationDate": None, "Creator": "hopform"},
    ".png": {"Software": "hopform"},
}
"""Suffixes of files with their metadata, without date or version."""

BLUE, MAGENTA, GREY, BLACK = (PALETTE[name] for name in ("blue", "magenta", "grey", "black"))
ORANGE, GREEN, SKY, PALE_BLUE = (PALETTE[name] for name in ("orange", "green", "sky", "pale blue"))
MOST_RUNS = 12
"""Runs of hops that are drawn one by one."""
CURRENT, CURRENTS = ORANGE, "viridis_r"
"""The colour of a current over time, and matplotlib's scale of colours for curves of several currents."""
SHADES: dict[str, dict[str, Any]] = {
    "extends": {"facecolor": "#CFE6F5", "edgecolor": "none"},
    "retracts": {"facecolor": "#FBE3C5", "edgecolor": "none"},
    "slips up": {"facecolor": "#CFE6F5", "edgecolor": "none"},
    "slips down": {"facecolor": "#FBE3C5", "edgecolor": "none"},
    "held": {"facecolor": "#E6E6E6", "edgecolor": "none"},
    "at stop": {"facecolor": "#EDEDED", "edgecolor": "#BDBDBD", "hatch": "////"},
    "locked": {"facecolor": "#EDEDED", "edgecolor": "#BDBDBD", "hatch": "xxxx"},
}
TAKEOFF: dict[str, Any] = {"color": BLACK, "markersize": 4.0, "linestyle": "none"}
"""The mark of a take-off."""
NAME: dict[str, Any] = {"textcoords": "offset points", "fontsize": 7, "color": BLACK}
"""The name of an event."""
STYLE: dict[str, Any] = {
    "figure.dpi": 100, "savefig.dpi": 160, "font.size": 9, "figure.titlesize": 9.5, "axes.labelsize": 9,
    "axes.spines.top": False, "axes.spines.right": False, "axes.xmargin": 0.0, "legend.frameon": False,
    "legend.fontsize": 8, "lines.linewidth": 1.4, "lines.solid_capstyle": "round", "hatch.linewidth": 0.6,
    "svg.hashsalt": "hopform", "svg.fonttype": "path", "pdf.fonttype": 42,
}  # fmt: skip
SAMPLES = 400
"""Points along a stance's curves."""
LABEL = 20
"""Characters of a line of the label of an axis."""
LEAST_SPAN = 0.5
"""In the units of an axis."""
COLOURS = (BLUE, GREEN, SKY, MAGENTA, BLACK)
"""Those of the curves of a panel; that of a current is its own."""

Curve = NDArray[np.floating]


@contextmanager
def house_style() -> Generator[None, None, None]:
    """matplotlib's defaults and ours, whatever the user's own settings are; it does not say that a font or a glyph is
    missing, which it replaces.
    """
    log = logging.getLogger("matplotlib.font_manager")
    before = log.level
    style: list[str | Path | dict[str, Any]] = ["default", STYLE]
    with matplotlib.style.context(style), warnings.catch_warnings():
        warnings.filterwarnings("ignore", r"Glyph .* missing from", UserWarning)
        log.setLevel(logging.ERROR)
        try:
            yield
        finally:
            log.setLevel(before)


def check_suffix(path: Path) -> None:
    """Raise HopformError for a file whose name does not end in .svg, .pdf or .png."""
    if path.suffix.lower() not in SUFFIXES:
        raise HopformError(f"a plot's name must end in .svg, .pdf or .png, got {str(path)!r}")


def render(figure: Figure, suffix: str) -> bytes:
    """The bytes of a picture file; `suffix` is ".svg", ".pdf" or ".png"."""
    buffer = io.BytesIO()
    with house_style():
        figure.savefig(buffer, format=suffix.lower().removeprefix("."), metadata=SUFFIXES[suffix.lower()])
    return buffer.getvalue()


@contextmanager
def framed(figure: Figure, width: float, height: float, name: str, words: str = "") -> Generator[None, None, None]:
    """An empty figure in its size [in] and the house style, to be filled, then titled: by a name, which is shown as it
    is, and words, whose minus signs and squares are true ones.
    """
    with house_style():
        figure.set_size_inches(width, height)
        figure.set_layout_engine("constrained")
        yield
        figure.suptitle(literal(name) + plain(words))


# ---- what pictures over time are made of ----


def modes_over(motion: Motion, mass: int) -> list[str]:
    """The modes of a mass in the phases, in words."""
    return [modes_of(phase, motion.robot)[mass] for phase in motion.phases]


def stance_times(stance: Motion) -> Curve:
    """Uniform times, and just before and at every event, where curves have their corners."""
    corners = np.array([phase.start for phase in stance.phases])
    t = np.union1d(np.linspace(0.0, stance.duration, SAMPLES), np.concatenate([corners, corners * (1.0 - 1e-6)]))
    return np.asarray(np.minimum(t, stance.duration))


def draw_strokes(axes: Axes, moved: Stance | Flight, t: Curve, shown: Curve) -> None:
    axes.plot(shown, 1000.0 * np.asarray(moved.at(t).x1), color=BLUE)
    name_axis(axes, "actuator $x_1$ [mm]")


def draw_current(axes: Axes, moved: Flight, t: Curve, shown: Curve) -> None:
    axes.plot(shown, moved.current(t), color=CURRENT)
    name_axis(axes, "current $u$ [A]")


def name_axis(axes: Axes, label: str) -> None:
    """The name of the vertical axis, which spans at least so much that rounding does not look like motion."""
    axes.set_ylabel(label)
    low, high = axes.get_ylim()
    if high - low < LEAST_SPAN:
        axes.set_ylim((low + high - LEAST_SPAN) / 2.0, (low + high + LEAST_SPAN) / 2.0)


def shade(
    axes: Axes, phases: Sequence[Phase], modes: Sequence[str], scale: float, looks: Mapping[str, Mapping[str, Any]]
) -> None:  # fmt: skip
    """The mode of a mass behind its curve; neighbours of one mode are one shade."""
    for word, stretch in groupby(zip(phases, modes, strict=True), key=lambda pair: pair[1]):
        some = [phase for phase, _ in stretch]
        axes.axvspan(some[0].start * scale, some[-1].end * scale, zorder=0, linewidth=0.0, **looks[word])


def mark_phases(axes: Axes, phases: Sequence[Phase], scale: float) -> None:
    """A hairline where a phase ends and the next begins."""
    axes.vlines(
        [phase.start * scale for phase in phases[1:]], 0.0, 1.0, transform=axes.get_xaxis_transform(),
        color=GREY, linewidth=0.6, linestyle=(0, (1, 2)), zorder=1,
    )  # fmt: skip


def name_events(rows: Sequence[Axes], stance: Motion, scale: float) -> None:
    """The name of an event beside its line, in the panel of its mass; that of the take-off where the force ends. Of names
    that would overlap the first one stands.
    """
    room, masses = stance.duration / 40.0, masses_of(stance.robot.solver)  # for a name
    for row, mass in zip(rows, masses, strict=False):
        free = -math.inf
        for event in stance.events:
            near_end = event.time > 0.95 * stance.duration
            begin = event.time - room if near_end else event.time
            if event.kind in mass.events and begin >= free:
                words = mass.events[event.kind].removeprefix(f"{mass.name} ")
                label(row, event.time * scale, words, "right" if near_end else "left")
                free = begin + room
    if stance.status == "takeoff":
        force = rows[len(masses)]
        force.plot([stance.duration * scale], [0.0], "^", label="take-off", clip_on=False, **TAKEOFF)
        label(force, stance.duration * scale, "take-off", "right")


def label(axes: Axes, x: float, words: str, side: str) -> None:
    """A name at the top of a panel, upright, to the left or the right of a time."""
    at = {"left": 1.5, "right": -1.5}[side]
    where = axes.get_xaxis_transform()
    axes.annotate(words, (x, 1.0), (at, -2.0), where, ha=side, va="top", rotation=90, **NAME)


def legend_of_modes(figure: Figure, stance: Motion) -> None:
    """Legend of the shades behind the coordinates that occur."""
    looks = shades(stance.robot)
    lasting = [phase for phase in stance.phases if phase.end > phase.start]
    present = {word for phase in lasting for word in modes_of(phase, stance.robot)}
    patches = [Patch(label=word, linewidth=0.0, **look) for word, look in looks.items() if word in present]
    if patches:
        figure.legend(handles=patches, loc="outside lower center", ncols=len(patches))


_NO_CHARACTER = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\ud800-\udfff\ufffe\uffff]")
"""Not allowed in XML: control characters, but line feeds are, halves of surrogate pairs, non-characters."""


def literal(text: str) -> str:
    """Text that matplotlib shows as it is: names of robots and files are no mathematics."""
    return _NO_CHARACTER.sub("\N{REPLACEMENT CHARACTER}", text).replace("$", r"\$")


def plain(text: str) -> str:
    """Text of hopform's own as matplotlib shows it, with true minus signs and squares."""
    return literal(re.sub(r"-(?=\d)", "\N{MINUS SIGN}", text).replace("^2", "\N{SUPERSCRIPT TWO}"))


# ---- a motion ----


def plot_motion(figure: Figure, motion: Motion) -> None:
    """A motion over time, of which a stance is one, its events named: each coordinate, the velocities, what friction,
    stops and a contact carry, the energies, and the input where it has steps, or the current that a law sets.

    >>> import hopform
    >>> robot = hopform.load_robot("hopper_c")
    >>> figure = Figure()
    >>> plot_motion(figure, hopform.solve_stance(robot, v2=-1.93, u=3.0))
    >>> [axes.get_ylabel().replace("\\n", ", ") for axes in figure.axes]
    ['actuator, x1 [m]', 'body, x2 [m]', 'velocity', 'force', 'energy']
    """
    scale, unit = unit_of_time(motion.duration)
    t, masses, facts = stance_times(motion), masses_of(motion.robot.solver), motion.robot.solver.facts
    state, drives = motion.at(t), facts.currents or motion.inputs
    curves: dict[str, dict[str, Curve]] = {
        "velocity": {f"{mass.velocity} [{mass.unit}/s]": getattr(state, mass.velocity) for mass in masses},
        "force": carried(motion, t),
        "energy": {
            f"{name} [{units_of_energies(motion)[name]}]": each for name, each in energies_of(motion, t).items()
        },
    }
    shown = [(name, lines) for name, lines in curves.items() if lines]
    inputs = [each for each in drives if len(motion.u) > 1 or facts.currents]
    count = len(masses) + len(shown) + len(inputs)
    with framed(figure, 7.4, 1.45 * count + 1.1, *title_of(motion)):
        rows: list[Axes] = list(figure.subplots(count, 1, sharex=True))
        for n, mass in enumerate(masses):
            draw_coordinate(rows[n], motion, mass, t, t * scale)
            shade(rows[n], motion.phases, modes_over(motion, n), scale, shades_of(mass))
        by_name = {name: axes for (name, _), axes in zip(shown, rows[len(masses) :], strict=False)}
        for name, lines in shown:
            for (words, values), colour in zip(lines.items(), COLOURS, strict=False):
                by_name[name].plot(t * scale, values, color=colour, label=literal(words))
            by_name[name].set_ylabel(name)
        for axes, each in zip(rows[count - len(inputs) :], inputs, strict=True):
            axes.plot(t * scale, motion.current(t), color=CURRENT)
            name_axis(axes, named(each["meaning"], each["name"], each["unit"]))
        for axes in rows:
            mark_phases(axes, motion.phases, scale)
        name_events([*rows[: len(masses)], by_name.get("force", rows[0])], motion, scale)
        for axes in by_name.values():
            axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        rows[-1].set_xlabel(f"time since {motion.beginning} [{unit}]")
        figure.align_ylabels(rows)
        legend_of_modes(figure, motion)


def motion_panel(axes: Axes, motion: Motion, n: int = 0) -> None:
    """A coordinate, the first, with the modes of its mass behind it."""
    scale, unit = unit_of_time(motion.duration)
    t, mass = stance_times(motion), masses_of(motion.robot.solver)[n]
    draw_coordinate(axes, motion, mass, t, t * scale)
    shade(axes, motion.phases, modes_over(motion, n), scale, shades_of(mass))
    axes.set_xlabel(f"time since {motion.beginning} [{unit}]")


def draw_coordinate(axes: Axes, motion: Motion, mass: Mass, t: Curve, shown: Curve) -> None:
    axes.plot(shown, getattr(motion.at(t), mass.position), color=BLUE)
    axes.set_ylabel(named(mass.name, mass.position, mass.unit))


def named(thing: str, name: str, unit: str) -> str:
    """The label of an axis: what is shown, in lines that an axis has room for, above its name, if it has another."""
    lines = [] if thing == name else textwrap.wrap(thing, LABEL)
    return literal("\n".join([*lines, f"{name} [{unit}]"]))


def shades_of(mass: Mass) -> dict[str, dict[str, Any]]:
    """The shades behind the coordinate of a mass, by the words for its modes."""
    forwards, backwards = mass.directions
    return SHADES | {forwards: SHADES["extends"], backwards: SHADES["retracts"]}


def shades(robot: Robot) -> dict[str, dict[str, Any]]:
    """Those of all its masses."""
    looks = dict(SHADES)
    for mass in masses_of(robot.solver):
        looks |= shades_of(mass)
    return looks


def carried(motion: Motion, t: Curve) -> dict[str, Curve]:
    """The forces of friction, stops and a contact, named with their units."""
    units = force_units(motion)
    return {f"{name} [{units[name]}]": each for name, each in motion.forces(t).items() if name != "input"}


def title_of(motion: Motion) -> tuple[str, str]:
    about = (each for each in (motion.input_in_words, motion.outcome) if each)
    return name_of(motion.robot), f": from {start_of(motion)}\n{', '.join(about)}"


# ---- a flight ----


def plot_flight(figure: Figure, flight: Flight) -> None:
    """A flight over time: body and foot over the ground ahead, the actuator on its way back, its current."""
    t = np.linspace(0.0, flight.duration, SAMPLES)
    words, facts = f": {flight.status} after {flight.duration:.4g} s", flight.robot.solver.facts
    panels: list[Callable[..., None]] = [draw_strokes] if "x1" in facts.axes else []
    panels += [draw_current] if facts.inputs else []
    shares = [1.5, 1.0, 0.8][: 1 + len(panels)]
    with framed(figure, 6.4, sum(shares) + 1.3, name_of(flight.robot), words):
        rows: list[Axes] = list(figure.subplots(len(shares), 1, sharex=True, height_ratios=shares, squeeze=False)[:, 0])
        flight_panel(rows[0], flight)
        rows[0].set_xlabel("")
        for draw, axes in zip(panels, rows[1:], strict=True):
            draw(axes, flight, t, t)
        rows[-1].set_xlabel("time since take-off [s]")
        figure.align_ylabels(rows)


def flight_panel(axes: Axes, flight: Flight) -> None:
    """Body and foot over the ground ahead."""
    t = np.linspace(0.0, flight.duration, SAMPLES)
    axes.plot(t, 100.0 * np.asarray(flight.at(t).x2), color=BLUE, label="body")
    axes.plot(t, 100.0 * np.asarray(flight.foot(t)), color=GREY, label="foot")
    axes.set(xlabel="time since take-off [s]", ylabel="height [cm]")
    axes.legend()


# ---- many stances ----


def batch_panel(axes: Axes, batch: Batch) -> None:
    """Apexes over the dimensions of the batch."""
    over_dimensions(axes, batch, 100.0 * batch.apex, "apex [cm]", "stance [index]")


def flights_panel(axes: Axes, flights: Flights) -> None:
    """Durations over the dimensions of the batch."""
    over_dimensions(axes, flights, flights.duration, "duration [s]", "flight [index]")


def over_dimensions(axes: Axes, batch: Motions, values: Curve, label: str, each: str) -> None:
    """What a batch has over its dimensions: a map of two, else a curve over the last."""
    dims = batch.labels.dims if batch.labels else tuple(f"dimension {n}" for n in range(values.ndim))
    coords: dict[str, Curve] = batch.labels.coords if batch.labels else {}
    sizes: tuple[int, ...] = values.shape
    whole: dict[str, Curve] = {dim: np.arange(float(size)) for dim, size in zip(dims, sizes, strict=True)}
    ticks = list((whole | coords).values())
    units: Mapping[str, str] = batch.labels.units if batch.labels else {}
    names = [f"{dim} [{units[dim]}]" if dim in units else f"{dim} [index]" for dim in dims]
    if values.ndim == 2 and min(values.shape) > 1:
        drawn = axes.pcolormesh(ticks[1], ticks[0], values, cmap="viridis", shading="nearest")
        axes.figure.colorbar(drawn, ax=axes, label=label)
        axes.set_ylabel(names[0])
    else:
        across = ticks[-1] if values.ndim else np.zeros(1)
        axes.plot(across, values.reshape(-1, across.size).T, ".-", linewidth=0.8, markersize=3.0)
        axes.margins(x=0.02)
        axes.set_ylabel(label)
    axes.set_xlabel(names[-1] if names else each)


def sensitivities_panel(axes: Axes, found: Sensitivities) -> None:
    """Each derivative as a number, its size beside the others of its row as a colour."""
    with np.errstate(invalid="ignore", divide="ignore"):
        share = found.matrix / np.nanmax(np.abs(found.matrix), axis=1, keepdims=True)
    axes.imshow(share, cmap="RdBu_r", vmin=-1.0, vmax=1.0, aspect="auto")
    for (row, column), value in np.ndenumerate(found.matrix):
        axes.text(column, row, f"{value:.2g}", ha="center", va="center", fontsize=5.5, rotation=90)
    axes.set(xlabel="by", ylabel="derivative of")
    axes.set_xticks(range(len(found.columns)), [f"{name} [{found.units[name]}]" for name in found.columns], rotation=90)
    axes.set_yticks(range(len(found.rows)), [f"{name} [{found.units[name]}]" for name in found.rows])


# ---- where a hop may lead ----


def plot_reach(figure: Figure, found: Reachability) -> None:
    """The next apex over the apex before it (Figs. 5, 11): the reachable, each current's curve, fixed points, the
    stroke.
    """
    margin = f", stop margin {100.0 * found.stop_margin:.3g} cm" if found.stop_margin else ""
    words = f", {found.currents[0]:.4g} to {found.currents[-1]:.4g} A{margin}"
    with framed(figure, 5.2, 4.8, name_of(found.robot), words):
        axes: Axes = figure.subplots()
        reach_panel(axes, found)
        figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3)


def reach_panel(axes: Axes, found: Reachability) -> None:
    """The map itself, a colour for each current."""
    heights, apex = 100.0 * found.heights, 100.0 * found.apex
    ends = (heights, 100.0 * found.lowest, 100.0 * found.highest)
    axes.fill_between(*ends, color=PALE_BLUE, alpha=0.35, label="reachable")
    colours = colours_of(found.currents)
    for u, column, inside, beyond in zip(found.currents, apex.T, found.admissible.T, found.limited.T, strict=True):
        axes.plot(heights, np.where(inside, column, np.nan), color=colours.to_rgba(u), linewidth=0.6)
        axes.plot(heights, np.where(beyond, column, np.nan), color=GREY, linewidth=0.5)
    if found.limited.any():
        axes.plot([], [], color=GREY, linewidth=0.5, label="beyond the stroke")
    axes.figure.colorbar(colours, ax=axes, label="current [A]")
    axes.plot(heights, heights, color=GREY, linestyle="--", linewidth=0.8, label="height held")
    for stable, marker, words in ((True, "o", "stable"), (False, "x", "unstable")):
        points = [100.0 * each.height for each in found.fixed_points if each.stable is stable and each.admissible]
        if points:
            axes.plot(points, points, marker, color=MAGENTA, markersize=4.0, label=f"fixed point, {words}")
    axes.set(xlabel="apex [cm]", ylabel="next apex [cm]")


def colours_of(values: Curve) -> ScalarMappable:
    """The colours of currents, on a scale whose ends are apart."""
    low, high = float(np.min(values)), float(np.max(values))
    return ScalarMappable(Normalize(low, high) if low < high else Normalize(low - 0.5, high + 0.5), CURRENTS)


def plot_command(figure: Figure, found: Command) -> None:
    """The next apex over the current and the current that was chosen."""
    with framed(figure, 6.0, 3.4, name_of(found.question.robot), f": {found.u:.5g} A"):
        command_panel(figure.subplots(), found)


def plot_hops(figure: Figure, runs: Hops) -> None:
    """The apexes hop by hop, and below the share of the runs that still take off."""
    with framed(figure, 6.0, 5.0, repr(runs).partition("\n")[0]):
        apexes, share = figure.subplots(2, 1, sharex=True, height_ratios=[1.6, 1.0])
        hops_panel(apexes, runs)
        apexes.set_xlabel("")
        share.step(np.arange(runs.survival.size), runs.survival, where="mid", color=MAGENTA)
        share.set(xlabel="hop", ylabel="runs that\ntake off", ylim=(-0.03, 1.03))
        figure.align_ylabels()


def hops_panel(axes: Axes, runs: Hops) -> None:
    """Median and range of the apexes over level 0, hop by hop; of few runs each."""
    apex = 100.0 * runs.apex.reshape(-1, runs.apex.shape[-1]).astype(float)
    hop: Curve = np.arange(float(apex.shape[1]))
    lifts = np.isfinite(apex).any(axis=0)
    if len(apex) <= MOST_RUNS:
        axes.plot(hop, apex.T, color=BLUE, linewidth=0.8, marker=".", markersize=3.0)
    elif lifts.any():
        low, middle, high = np.nanpercentile(apex[:, lifts], [5.0, 50.0, 95.0], axis=0)
        axes.fill_between(hop[lifts], low, high, color=PALE_BLUE, linewidth=0.0, label="5 to 95 % of the runs")
        axes.plot(hop[lifts], middle, color=BLUE, label="median")
        axes.legend()
    axes.set(xlabel="hop", ylabel="apex [cm]")
    axes.margins(x=0.02)


def command_panel(axes: Axes, found: Command) -> None:
    """The next apex over the current, NaN where none is admissible, what is desired, and what was chosen."""
    u, apex = found.curve()
    axes.plot(u, 100.0 * apex, color=BLUE, label="next apex, admissible currents")
    axes.axhline(100.0 * found.question.target[0], color=GREY, linestyle="--", linewidth=0.8, label="desired")
    if found.status != "no_takeoff":
        axes.plot([found.u], [100.0 * found.apex], "o", color=MAGENTA, label=found.status)
    axes.set(xlabel="current [A]", ylabel="next apex [cm]")
    axes.margins(x=0.02)
    axes.legend()


def alone(panel: Callable[[Axes, Any], object], width: float, height: float, figure: Figure, result: Any) -> None:
    """A figure of that panel alone [in]."""
    with framed(figure, width, height, repr(result).partition("\n")[0]):
        panel(figure.subplots(), result)


OF_RESULTS: Mapping[type, Picture] = {
    Motion: (plot_motion, motion_panel),
    Stance: (plot_motion, partial(motion_panel, n=-1)),
    Flight: (plot_flight, flight_panel),
    Batch: (partial(alone, batch_panel, 6.0, 3.6), batch_panel),
    Hops: (plot_hops, hops_panel),
    Flights: (partial(alone, flights_panel, 6.0, 3.6), flights_panel),
    Sensitivities: (partial(alone, sensitivities_panel, 9.0, 5.0), sensitivities_panel),
    Reachability: (plot_reach, reach_panel),
    Command: (plot_command, command_panel),
}
"""The whole picture of each type of result, and its main panel."""
