"""Pictures of stances, flights and runs, ready for a paper: units, legends, colours that colour-blind readers
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
import warnings
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager
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

from hopform import (
    Batch,
    Command,
    Flight,
    Hop,
    HopformError,
    Motion,
    Phase,
    Reachability,
    Robot,
    Run,
    Sensitivities,
    Stance,
)
from hopform._motion import Mass, force_unit, masses_of
from hopform._stance import rest_of
from hopform._words import current, ending, input_of, modes_of, name_of, start_of, unit_of_time

SUFFIXES = {
    ".svg": {"Date": None, "Creator": "hopform"},
    ".pdf": {"CreationDate": None, "Creator": "hopform"},
    ".png": {"Software": "hopform"},
}
"""Suffixes of files with their metadata, without date or version."""

BLUE, PALE_BLUE, MAGENTA, GREY, BLACK = "#0072B2", "#8CC4E8", "#A6257A", "#666666", "#222222"
ORANGE, GREEN, SKY = "#D55E00", "#009E73", "#56B4E9"
"""Of the palette of Okabe and Ito, which colour-blind readers distinguish."""
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
STANCE: dict[str, Any] = {"facecolor": "#EDEDED", "edgecolor": "none"}
STYLE: dict[str, Any] = {
    "figure.dpi": 100, "savefig.dpi": 160, "font.size": 9, "figure.titlesize": 9.5, "axes.labelsize": 9,
    "axes.spines.top": False, "axes.spines.right": False, "axes.xmargin": 0.0, "legend.frameon": False,
    "legend.fontsize": 8, "lines.linewidth": 1.4, "lines.solid_capstyle": "round", "hatch.linewidth": 0.6,
    "svg.hashsalt": "hopform", "svg.fonttype": "path", "pdf.fonttype": 42,
}  # fmt: skip
BODY_ENERGY, WITH_SPRING = "kinetic + gravitational", "with the spring as in (23) in stance"
"""The energies of a run."""
SAMPLES = 400
"""Points along a stance's curves."""
LEAST_SPAN = 0.5
"""In the units of an axis."""

Curve = NDArray[np.floating]
Drawing = Callable[[Axes, Stance, Curve, Curve], None]


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
def framed(figure: Figure, width: float, height: float, title: str) -> Generator[None, None, None]:
    """An empty figure in its size [in] and the house style, to be filled, then titled."""
    with house_style():
        figure.set_size_inches(width, height)
        figure.set_layout_engine("constrained")
        yield
        figure.suptitle(title)


# ---- one stance ----


def plot_stance(figure: Figure, stance: Stance) -> None:
    """A stance over time, its events named: actuator if there is one, body, contact force, the energy (23), the current
    where it has steps.

    >>> import hopform
    >>> robot = hopform.load_robot("hopper_c")
    >>> figure = Figure()
    >>> plot_stance(figure, hopform.solve_stance(robot, v2=-1.93, u=3.0))
    >>> [axes.get_ylabel() for axes in figure.axes[:4]]
    ['actuator $x_1$ [mm]', 'body $x_2$ [mm]', 'contact force [N]', 'energy E (23) [J]']
    """
    scale, unit = unit_of_time(stance.duration)
    t = stance_times(stance)
    masses = masses_of(stance.robot.solver)
    panels: list[Drawing] = [*([draw_strokes] if len(masses) > 1 else []), draw_body, draw_force, draw_energy]
    shares = [1.0] * len(panels)
    if len(stance.u) > 1 and stance.inputs:
        panels.append(draw_current)
        shares.append(0.8)
    with framed(figure, 6.4, 1.45 * sum(shares) + 1.1, title_of(stance)):
        rows: list[Axes] = list(figure.subplots(len(panels), 1, sharex=True, height_ratios=shares))
        for draw, axes in zip(panels, rows, strict=True):
            draw(axes, stance, t, t * scale)
            mark_phases(axes, stance.phases, scale)
        for n in range(len(masses)):
            shade(rows[n], stance.phases, modes_over(stance, n), scale, shades(stance.robot))
        name_events(rows[: len(masses) + 1], stance, scale)
        rows[-1].set_xlabel(f"time since touchdown [{unit}]")
        figure.align_ylabels(rows)
        legend_of_modes(figure, stance)


def stance_panel(axes: Axes, stance: Stance) -> None:
    """The height of the body, with its modes behind it."""
    scale, unit = unit_of_time(stance.duration)
    t = stance_times(stance)
    draw_body(axes, stance, t, t * scale)
    shade(axes, stance.phases, modes_over(stance, -1), scale, shades(stance.robot))
    axes.set_xlabel(f"time since touchdown [{unit}]")


def modes_over(motion: Motion, mass: int) -> list[str]:
    """The modes of a mass in the phases, in words."""
    return [modes_of(phase, motion.robot)[mass] for phase in motion.phases]


def stance_times(stance: Motion) -> Curve:
    """Uniform times, and just before and at every event, where curves have their corners."""
    corners = np.array([phase.start for phase in stance.phases])
    t = np.union1d(np.linspace(0.0, stance.duration, SAMPLES), np.concatenate([corners, corners * (1.0 - 1e-6)]))
    return np.asarray(np.minimum(t, stance.duration))


def draw_strokes(axes: Axes, moved: Stance | Run | Hop | Flight, t: Curve, shown: Curve) -> None:
    axes.plot(shown, 1000.0 * np.asarray(moved.at(t).x1), color=BLUE)
    name_axis(axes, "actuator $x_1$ [mm]")


def draw_body(axes: Axes, stance: Stance, t: Curve, shown: Curve) -> None:
    axes.plot(shown, 1000.0 * np.asarray(stance.at(t).x2), color=BLUE)
    axes.set_ylabel("body $x_2$ [mm]")


def draw_force(axes: Axes, stance: Stance, t: Curve, shown: Curve) -> None:
    axes.plot(shown, np.asarray(stance.contact_force(t)), color=BLUE)
    axes.set_ylabel("contact force [N]")
    axes.set_ylim(bottom=-0.07 * axes.get_ylim()[1])  # the mark of a take-off stands clear of the frame


def draw_energy(axes: Axes, stance: Stance, t: Curve, shown: Curve) -> None:
    axes.plot(shown, np.asarray(stance.energy(t).body), color=BLUE)
    name_axis(axes, "energy E (23) [J]")


def draw_energies(axes: Axes, run: Run | Hop, t: Curve) -> None:
    """The energy of the body, and that with the spring as in (23)."""
    axes.plot(t, sum(energies_of_body(run, t)), color=BLACK, linewidth=0.8, linestyle=(0, (3, 1)), label=BODY_ENERGY)
    axes.plot(t, np.asarray(run.energy(t).body), color=BLUE, label=WITH_SPRING)
    name_axis(axes, "energy [J]")


def energies_of_body(run: Run | Hop, t: Curve) -> tuple[Curve, Curve]:
    """Kinetic and gravitational energy [J] of the body, from level 0 on; an impact alone makes their sum jump."""
    state, robot = run.at(t), run.robot
    return 0.5 * robot.letters.m_s * np.asarray(state.v2) ** 2, robot.letters.m_s * robot.letters.g * np.asarray(
        state.x2
    )


def draw_current(axes: Axes, moved: Stance | Run | Hop | Flight, t: Curve, shown: Curve) -> None:
    axes.plot(shown, moved.current(t), color=CURRENT, linewidth=0.9 if isinstance(moved, Run | Hop) else 1.4)
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


def title_of(stance: Stance) -> str:
    first = stance.phases[0].state
    start = ", ".join(
        (f"touchdown at {float(first.v2) + 0.0:.3g} m/s", *([current(stance.u)] if stance.inputs else []))
    )
    return literal(name_of(stance.robot)) + plain(f": {start}\n{ending(stance)}")


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
    """A motion over time, its events named: each coordinate, the velocities, what friction and stops carry, the energy of
    the whole machine, and the input where it has steps, or the current that a law sets.
    """
    scale, unit = unit_of_time(motion.duration)
    t, masses, facts = stance_times(motion), masses_of(motion.robot.solver), motion.robot.solver.facts
    steps = int(len(motion.u) > 1 or len(facts.currents) > 0)
    held_by = carried(motion, t)
    count = len(masses) + 2 + bool(held_by) + steps
    with framed(figure, 6.4, 1.45 * count + 1.1, title_of_motion(motion)):
        rows: list[Axes] = list(figure.subplots(count, 1, sharex=True))
        for n, mass in enumerate(masses):
            draw_coordinate(rows[n], motion, mass, t, t * scale)
            shade(rows[n], motion.phases, modes_over(motion, n), scale, shades_of(mass))
        state, (velocities, *forces, energy) = motion.at(t), rows[len(masses) : count - steps]
        inputs = rows[count - steps :]
        for mass, colour in zip(masses, (BLUE, GREEN), strict=False):
            words = literal(f"{mass.velocity} [{mass.unit}/s]")
            velocities.plot(t * scale, getattr(state, mass.velocity), color=colour, label=words)
        for axes in forces:
            for (name, values), colour in zip(held_by, (BLUE, ORANGE, GREEN, SKY), strict=False):
                axes.plot(t * scale, values, color=colour, label=literal(name))
            axes.set_ylabel("force")
        energy.plot(t * scale, motion.total_energy(t), color=BLUE)
        drives = facts.currents or motion.inputs
        for axes in inputs:
            axes.plot(t * scale, motion.current(t), color=CURRENT)
            name_axis(axes, literal(f"{drives[0]['name']} [{drives[0]['unit']}]"))
        velocities.set_ylabel("velocity")
        energy.set_ylabel("energy H [J]")
        for axes in rows:
            mark_phases(axes, motion.phases, scale)
        for axes in (velocities, *forces):
            axes.legend(loc="upper right")
        name_events(rows, motion, scale)
        rows[-1].set_xlabel(f"time [{unit}]")
        figure.align_ylabels(rows)
        legend_of_modes(figure, motion)


def motion_panel(axes: Axes, motion: Motion) -> None:
    """The first coordinate, with the modes of its mass behind it."""
    scale, unit = unit_of_time(motion.duration)
    t, mass = stance_times(motion), masses_of(motion.robot.solver)[0]
    draw_coordinate(axes, motion, mass, t, t * scale)
    shade(axes, motion.phases, modes_over(motion, 0), scale, shades_of(mass))
    axes.set_xlabel(f"time [{unit}]")


def draw_coordinate(axes: Axes, motion: Motion, mass: Mass, t: Curve, shown: Curve) -> None:
    axes.plot(shown, getattr(motion.at(t), mass.position), color=BLUE)
    axes.set_ylabel(literal(f"{mass.name}\n{mass.position} [{mass.unit}]"))


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


def carried(motion: Motion, t: Curve) -> list[tuple[str, Curve]]:
    """The forces of friction and stops, named with their units."""
    found, masses = motion.forces(t), masses_of(motion.robot.solver)
    names = [(mass, f"{what}_{mass.position}") for mass in masses for what in ("friction", "stop")]
    return [(f"{name} [{force_unit(mass.unit)}]", found[name]) for mass, name in names if name in found]


def title_of_motion(motion: Motion) -> str:
    about = ", ".join(each for each in (f"from {start_of(motion)}", input_of(motion)) if each)
    return literal(name_of(motion.robot)) + plain(f": {about}\n{ending(motion)}")


# ---- a run ----


def plot_run(figure: Figure, run: Run | Hop) -> None:
    """A run over time: hop height, actuator, energies (Figs. 12 to 14), current; without an actuator or an input not these."""
    t, facts = run_times(run), run.robot.solver.facts
    of_actuator, of_input = ([0.9] if "x1" in facts.axes else []), ([0.75] if facts.inputs else [])
    shares = [1.0, *of_actuator, 1.3, *of_input]
    with framed(figure, 6.4, 1.3 * sum(shares) + 1.665, title_of_run(run)):
        rows: list[Axes] = list(figure.subplots(len(shares), 1, sharex=True, height_ratios=shares, squeeze=False)[:, 0])
        energies = rows[1 + len(of_actuator)]
        draw_heights(rows[0], run, t)
        if of_actuator:
            draw_strokes(rows[1], run, t, t)
        draw_energies(energies, run, t)
        if of_input:
            draw_current(rows[-1], run, t, t)
        for axes in rows:
            shade_stances(axes, run)
        lines = [line for axes in (rows[0], energies) for line in axes.get_legend_handles_labels()[0]]
        figure.legend(handles=[Patch(label="stance", **STANCE), *lines], loc="outside lower center", ncols=3)
        rows[-1].set_xlabel(since(run))
        figure.align_ylabels(rows)


def run_panel(axes: Axes, run: Run | Hop) -> None:
    """The hop height over the ground."""
    draw_heights(axes, run, run_times(run))
    shade_stances(axes, run)
    axes.set_xlabel(since(run))


def stances_of(run: Run | Hop) -> list[tuple[float, float]]:
    """Touchdown and end of each stance [s]."""
    if isinstance(run, Hop):
        return [(run.flight.duration, run.duration)]
    return [(hop.touchdown_time, hop.takeoff_time) for hop in run.hops]


def shade_stances(axes: Axes, run: Run | Hop, label: str = "") -> None:
    """The stances behind the curves; the first one has the label."""
    for n, (begin, end) in enumerate(stances_of(run)):
        axes.axvspan(begin, end, zorder=0, label="" if n else label, **STANCE)


def since(run: Run | Hop) -> str:
    return f"time since the {'flight began' if isinstance(run, Hop) else 'start'} [s]"


def title_of_run(run: Run | Hop) -> str:
    if isinstance(run, Hop):
        of_input = f"{current(run.stance.u)}, " if run.stance.inputs else ""
        words = f", hop {run.index}: {of_input}{ending(run.stance)}"
        return literal(name_of(run.robot)) + plain(words)
    start = f"from {100.0 * (float(run.at(0.0).x2) - run.robot.letters.L0 - run.robot.letters.c + rest_of(run.robot)):.4g} cm"
    currents = {hop.stance.u for hop in run.hops}
    is_constant = len(currents) == 1 and run.robot.solver.facts.inputs
    words = current(currents.pop()) if is_constant else f"{len(run.hops)} hops"
    return literal(name_of(run.robot)) + plain(f" {start}, {words}")


def draw_heights(axes: Axes, run: Run | Hop, t: Curve) -> None:
    """The body over the level at which the leg stands unloaded; of a run apexes, take-offs, ground and set points
    too.
    """
    base = run.robot.letters.L0 + run.robot.letters.c - rest_of(run.robot)
    axes.plot(t, 100.0 * (np.asarray(run.at(t).x2) - base), color=BLUE, linewidth=1.0, label="body")
    axes.set_ylabel("hop height [cm]")
    if isinstance(run, Hop):
        return
    lifts = [hop for hop in run.hops if hop.stance.takeoff is not None]
    marks: dict[str, Any] = {"color": BLUE, "markersize": 3.5, "clip_on": False}
    times, heights = apexes(run)
    if lifts:  # a line of no points that is not clipped has no extent, which the layout does not survive
        axes.plot(times, 100.0 * heights, "o", label="apex", **marks)
        x2 = [100.0 * (float(hop.stance.end.x2) + hop.ground - base) for hop in lifts]
        axes.plot([hop.takeoff_time for hop in lifts], x2, "^", clip_on=False, label="take-off", **TAKEOFF)
    if run.h_des:
        draw_wanted(axes, run)
    if any(run.terrain):
        axes.plot(t, 100.0 * np.asarray(run.ground(t)), color=GREY, linewidth=1.6, label="ground")


def draw_wanted(axes: Axes, run: Run) -> None:
    """The set point of each hop, from one touchdown to the next."""
    edges = [0.0, *(hop.touchdown_time for hop in run.hops[1:]), run.duration]
    if run.hops:
        values = 100.0 * np.array(run.h_des[: len(run.hops)])
        axes.stairs(values, edges, baseline=None, color=BLACK, linestyle="--", linewidth=1.0, label="wanted")


def apexes(run: Run) -> tuple[Curve, Curve]:
    """Times [s] and heights [m] of a run's apexes, up to its end; hops without take-off are left out."""
    lifts = [hop for hop in run.hops if hop.stance.takeoff is not None]
    found = [(hop.takeoff_time + max(float(hop.stance.end.v2), 0.0) / run.robot.fall, hop.apex) for hop in lifts]
    times, heights = np.array(found).reshape(-1, 2).T
    return times[times <= run.duration], heights[times <= run.duration]


def run_times(run: Run | Hop) -> Curve:
    """Uniform times, and both sides of every touchdown and take-off, where the energy jumps."""
    corners = np.array(stances_of(run)).reshape(-1)
    both = np.concatenate([np.nextafter(corners, -np.inf), corners, np.nextafter(corners, np.inf)])
    uniform = np.linspace(0.0, run.duration, min(200 * (1 + corners.size // 2), 6000))
    return np.asarray(np.minimum(np.union1d(uniform, both), run.duration))


# ---- a flight ----


def plot_flight(figure: Figure, flight: Flight) -> None:
    """A flight over time: body and foot over the ground ahead, the actuator on its way back, its current."""
    t = np.linspace(0.0, flight.duration, SAMPLES)
    title = literal(name_of(flight.robot)) + plain(f": {flight.status} after {flight.duration:.4g} s")
    facts = flight.robot.solver.facts
    panels: list[Callable[..., None]] = [draw_strokes] if "x1" in facts.axes else []
    panels += [draw_current] if facts.inputs else []
    shares = [1.5, 1.0, 0.8][: 1 + len(panels)]
    with framed(figure, 6.4, sum(shares) + 1.3, title):
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
    """Apexes over the dimensions of the batch: a map of two, else a curve over the last."""
    apex: Curve = 100.0 * batch.apex
    dims = batch.labels.dims if batch.labels else tuple(f"dimension {n}" for n in range(apex.ndim))
    coords: dict[str, Curve] = batch.labels.coords if batch.labels else {}
    sizes: tuple[int, ...] = apex.shape
    whole: dict[str, Curve] = {dim: np.arange(float(size)) for dim, size in zip(dims, sizes, strict=True)}
    ticks = list((whole | coords).values())
    units: Mapping[str, str] = batch.labels.units if batch.labels else {}
    names = [f"{dim} [{units[dim]}]" if dim in units else f"{dim} [index]" for dim in dims]
    if apex.ndim == 2 and min(apex.shape) > 1:
        drawn = axes.pcolormesh(ticks[1], ticks[0], apex, cmap="viridis", shading="nearest")
        axes.figure.colorbar(drawn, ax=axes, label="apex [cm]")
        axes.set_ylabel(names[0])
    else:
        across = ticks[-1] if apex.ndim else np.zeros(1)
        axes.plot(across, apex.reshape(-1, across.size).T, ".-", linewidth=0.8, markersize=3.0)
        axes.margins(x=0.02)
        axes.set_ylabel("apex [cm]")
    axes.set_xlabel(names[-1] if names else "stance [index]")


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
    with framed(figure, 5.2, 4.8, literal(name_of(found.robot)) + plain(words)):
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
    for stable, marker, words in ((True, "o", "settles"), (False, "x", "leaves")):
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
    with framed(figure, 6.0, 3.4, literal(name_of(found.question.robot)) + plain(f": {found.u:.5g} A")):
        command_panel(figure.subplots(), found)


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
