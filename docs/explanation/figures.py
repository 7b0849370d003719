"""`python docs/explanation/figures.py DIR`: the figures of the explanations, computed by hopform as the site is built;
docs/images keeps the README's.

Each function draws one, whose name is that of the file.
"""

import ctypes
import dataclasses
import sys
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

import hopform
from hopform._figures import plots
from hopform._figures.plots import BLUE, GREEN, GREY, MAGENTA, ORANGE, house_style, render
from hopform._solver.c import plan_of
from hopform._solver.package import MAX_PHASES, records
from hopform_solver import formulas, kernels, solver
from hopform_solver.elements import COLUMNS

BODY = hopform.load_robot("hopper_c")
WIDTH = 4.6
"""[in] Letters stay readable on a telephone."""


# ---- near-equal poles ----


def near_equal_poles() -> Figure:
    """The error of W by partial fractions and by the kernels of hopform, over the distance of three poles."""
    times, centre = np.linspace(0.02, 0.5, 25), 10.0
    distances = np.logspace(-12, -0.3, 48)
    errors = np.array([errors_of_w(centre * np.array([1 - d, 1, 1 + 2 * d]), times) for d in distances])
    figure = Figure(figsize=(WIDTH, 3.8), layout="constrained")
    axes = figure.subplots()
    words = ("partial fractions, exact poles", "partial fractions, poles by numpy.roots", "hopform")
    for error, word, colour in zip(errors.T, words, (ORANGE, MAGENTA, BLUE), strict=True):
        axes.loglog(distances, np.maximum(error, 1e-17), color=colour, label=word)
    axes.axhline(2.0**-52, color=GREY, linewidth=0.8, linestyle=":", label="eps")
    axes.set(
        xlabel="distance of the poles / pole", ylabel="error of W / largest W", ylim=(1e-17, 1e10),
        xlim=(distances[0], distances[-1]),
    )  # fmt: skip
    axes.legend(loc="upper right")
    return figure


def errors_of_w(rates: Any, times: Any) -> tuple[float, float, float]:
    """Of the three ways, each from numbers in double precision; the truth has 60 digits."""
    with mpmath.workdps(60):
        a, b, c = (mpmath.mpf(float(rate)) for rate in rates)
        cubic = [float(value) for value in (a + b + c, a * b + b * c + c * a, a * b * c)]
        exact = [mpmath.fsum(mpmath.exp(-p * mpmath.mpf(float(t))) / ((q - p) * (r - p))
                             for p, q, r in ((a, b, c), (b, c, a), (c, a, b))) for t in times]  # fmt: skip
    truth = np.array([float(value) for value in exact])
    lanes = (np.full(times.shape, value) for value in cubic)
    ours = kernels.basis_at(kernels.factor_cubic(*lanes), times).W
    found = (by_partial_fractions(rates, times), by_partial_fractions(-np.roots([1.0, *cubic]), times), ours)
    first, second, third = (float(np.abs(way - truth).max() / truth.max()) for way in found)
    return first, second, third


def by_partial_fractions(rates: Any, times: Any) -> Any:
    """The sum of (18): a coefficient divides by the differences of the poles."""
    with np.errstate(divide="ignore", invalid="ignore"):
        terms = [np.exp(-p * times) / np.prod([q - p for q in np.delete(rates, n)]) for n, p in enumerate(rates)]
        return np.nan_to_num(np.real(np.sum(terms, axis=0)), nan=1e300)


# ---- the certificate ----

RINGING = dataclasses.replace(
    BODY, m_eff=1.0, b1=2.0, f1=0.0, f2=0.0, x1_min=-np.inf, x1_max=np.inf, name="a light actuator without friction"
)
V2 = -0.5


def certificate() -> Figure:
    """The signs that tell how many zeros of y an interval holds; its minimum, on either side of zero."""
    edge = last_current_with_a_dip(0.36, 0.38)
    figure = Figure(figsize=(WIDTH, 6.6), layout="constrained")
    parts: dict[str, Any] = figure.subplot_mosaic([["g"], ["slope"], ["d"], ["zoom"]], height_ratios=[1, 1, 1, 1.6])
    for u, colour in ((edge - 0.002, ORANGE), (edge + 0.002, BLUE)):
        t, g, rate, d = in_one_interval(u)
        for name, values in (("g", 1e3 * g), ("slope", rate), ("d", d), ("zoom", 1e3 * g)):
            parts[name].plot(1e3 * t, values, color=colour, label=f"u = {u:.4f} A")
        samples = np.arange(28, 31) * 0.005
        parts["zoom"].plot(1e3 * samples, 1e3 * np.interp(samples, t, g), "s", color=colour, markersize=4)
        zeros = 1e3 * t[np.flatnonzero(np.diff(np.sign(g)))]
        parts["zoom"].plot(zeros, np.zeros(zeros.shape), "o", color=colour, fillstyle="none")
    for name, word in (("g", "g = y [mm]"), ("slope", "g' [m/s]"), ("d", "d [m/s$^2$]"), ("zoom", "g = y [mm]")):
        parts[name].axhline(0.0, color=GREY, linewidth=0.8)
        parts[name].set_ylabel(word)
    for name in ("g", "slope"):
        parts[name].tick_params(labelbottom=False)
    for name in ("d", "zoom"):
        parts[name].set_xlabel("time [ms]")
    parts["zoom"].set(xlim=(138.5, 151.0), ylim=(-0.15, 0.85), title="samples every 5 ms")
    parts["zoom"].legend(loc="upper center")
    return figure


def last_current_with_a_dip(low: float, high: float) -> float:
    """Where take-off at the first minimum of y ends, by bisection of the duration."""
    for _ in range(50):
        middle = (low + high) / 2.0
        takes_off = hopform.solve_stance(RINGING, v2=V2, u=middle).duration < 0.2
        low, high = (middle, high) if takes_off else (low, middle)
    return low


def in_one_interval(u: float) -> tuple[Any, Any, Any, Any]:
    """Times of a node about the minimum of y; y there, its rate and deflated derivative, continued past a take-off."""
    stance = hopform.solve_stance(RINGING, v2=V2, u=u)
    phase = next(found for found in stance.phases if found.start < 0.13 < found.end)
    state = phase.state
    y = state.x1 - state.x2 + RINGING.L0 + RINGING.c
    chain = solver.Chain(RINGING.parameters, [(0.0, phase.u)], records.LegState(state.x1, state.v1, state.v2, y))
    form = chain.closed_form((phase.mode_1, phase.mode_2))
    poles, numerator = form.poles, formulas.contact_numerator(RINGING.parameters, form.numerators)
    node = np.pi / 4.0 / np.sqrt(poles.q)
    start = 0.143 - 0.5 * node
    t = np.linspace(start, start + node, 801)
    lanes = records.Poles(*(np.full(t.shape, value) for value in poles))
    w = kernels.basis_at(lanes, t - phase.start)
    H3, H2, H1 = numerator
    g = y + H3 * w.Wd + H2 * w.W + H1 * w.W1
    rate = H3 * w.Wdd + H2 * w.Wd + H1 * w.W
    left = formulas.deflated_numerator(poles, numerator)
    d = left.A * (w.Wdd + poles.a * w.Wd) + left.B * (w.Wd + poles.a * w.W)
    return t, g, rate, d


# ---- branch and bound ----


def branch_and_bound() -> Figure:
    """One search: apex(u) with its candidates in their order; below, the intervals that wait after each."""
    h_des, v2 = 0.03, hopform.touchdown_velocity(BODY, height=0.05)
    command = hopform.choose_current(BODY, v2=v2, h_des=h_des)
    tried, apexes, waiting = search(v2, h_des)
    assert command.u in tried and len(tried) == command.solved
    figure = Figure(figsize=(WIDTH, 5.0), layout="constrained")
    curve, rows = figure.subplots(2, sharex=True)
    u, apex = command.curve()
    curve.plot(u, 1e3 * apex, color=BLUE, label="apex(u), admissible")
    curve.axhline(1e3 * h_des, color=GREY, linewidth=0.8, linestyle="--", label="h_des")
    curve.plot(tried, 1e3 * np.array(apexes), "o", color=ORANGE, markersize=4, clip_on=False, label="candidates")
    for n, intervals in enumerate(waiting, start=1):
        rows.plot(tried[n - 1], n, "o", color=ORANGE, markersize=4, clip_on=False, zorder=3)
        for start, end, bound in intervals:
            rows.plot([start, end], [n, n], color=GREEN if bound <= 0.0 else GREY, linewidth=4, solid_capstyle="butt")
            if bound > 0.0:
                rows.annotate(f"{1e3 * bound:.1f} mm", ((start + end) / 2, n), ha="center", xytext=(0, 4),
                              textcoords="offset points", fontsize=7)  # fmt: skip
    rows.plot([], [], color=GREEN, linewidth=4, label="may hold a root")
    rows.plot([], [], color=GREY, linewidth=4, label="cannot, by this bound")
    rows.set(xlim=(-0.6, BODY.u_max), ylim=(len(tried) + 0.6, 0.2), xlabel="u [A]", yticks=range(1, len(tried) + 1))
    rows.set_ylabel("candidate, and what waits after it")
    curve.set(ylabel="apex [mm]", ylim=(15.0, None))
    curve.legend(loc="upper left")
    rows.legend(loc="lower right", handlelength=1.0)
    return figure


def search(v2: float, h_des: float) -> tuple[list[float], list[float], list[list[tuple[float, float, float]]]]:
    """Candidates [A] and apices [m] of a search, and after each the intervals (A, A, lower bound [m]) that wait."""
    library = BODY.solver.compiled().library
    types = library.types(np.dtype(np.float64))
    plan = plan_of(types, BODY.parameters)
    found, room, command = types.Search(), (types.Phase * MAX_PHASES)(), types.Command()
    start, target = types.State(0.0, 0.0, v2, 0.0), types.Target(h_des, 0.0, 0.0, 2.0)
    searching = library.call(
        "choose_current_begin", types, ctypes.byref(found), plan, *map(ctypes.byref, (start, target, command))
    )
    status, never = searching, 1e300
    tried, waiting = list[float](), list[list[tuple[float, float, float]]]()
    while status == searching:
        tried.append(found.next)
        status = library.call(
            "choose_current_step", types, ctypes.byref(found), room, ctypes.c_int32(len(room)), ctypes.byref(command)
        )
        ends = [candidate.u for candidate in found.candidates[: found.count]]
        bounds = zip(ends, ends[1:], found.lower_bound, strict=False)
        waiting.append([each for each in bounds if each[2] < never])
    apexes = [hopform.solve_stance(BODY, v2=v2, u=u).apex for u in tried]
    return tried, apexes, waiting


# ---- saltation ----


def saltation() -> Figure:
    """d v1/du through a stance with every event of the actuator, and difference quotients of two stances."""
    u, step, v2 = 0.75, 1e-3, hopform.touchdown_velocity(BODY, height=0.20)
    stance = hopform.solve_stance(BODY, v2=v2, u=u)
    t = np.linspace(0.0, stance.duration, 2001)
    figure = Figure(figsize=(WIDTH, 4.2), layout="constrained")
    velocity, slope = figure.subplots(2, sharex=True)
    states, tangents = stance._solved.tangents(t)
    velocity.plot(1e3 * t, states.v1, color=BLUE)
    slope.plot(1e3 * t, tangents[:, records.LegState._fields.index("v1"), COLUMNS.index("u")], color=BLUE,
               label="by saltation")  # fmt: skip
    few = t[::40]
    quotient = [hopform.solve_stance(BODY, v2=v2, u=u + side * step).at(few[:-1]).v1 for side in (1, -1)]
    slope.plot(1e3 * few[:-1], (quotient[0] - quotient[1]) / (2 * step), ".", color=ORANGE, markersize=4,
               label=f"two stances, {step:g} A to either side")  # fmt: skip
    for event in stance.events:
        for axes in (velocity, slope):
            axes.axvline(1e3 * event.time, color=GREY, linewidth=0.8, linestyle=":")
        velocity.annotate(event.kind, (1e3 * event.time, 1.0), xycoords=("data", "axes fraction"), rotation=90,
                          xytext=(2, -2), textcoords="offset points", va="top", fontsize=7)  # fmt: skip
    velocity.set_ylabel("v1 [m/s]")
    slope.set(xlabel="time [ms]", ylabel="d v1/du [m/s/A]")
    for axes in (velocity, slope):
        axes.margins(x=0.02)  # markers clear of the frame
    slope.legend()
    return figure


# ---- a stance, for the README ----


def stance() -> Figure:
    """Actuator and contact force of a stance at 0.75 A over time, its events named."""
    found = hopform.solve_stance(BODY, v2=hopform.touchdown_velocity(BODY, 0.2), u=0.75)
    t, modes, looks = plots.stance_times(found), plots.modes_over(found, 0), plots.shades(BODY)
    figure = Figure(figsize=(4.2, 4.2), layout="constrained")
    strokes, force = figure.subplots(2, 1, sharex=True)
    plots.draw_strokes(strokes, found, t, 1e3 * t)
    force.plot(1e3 * t, np.asarray(found.contact_force(t)), color=BLUE)
    force.set_ylabel("contact force [N]")
    for axes in (strokes, force):
        plots.mark_phases(axes, found.phases, 1e3)
    for axes, room in ((strokes, 1.6), (force, 2.0)):
        top = float(np.max(axes.lines[0].get_ydata()))
        axes.set_ylim(-0.04 * top, room * top)  # the names of events are above the curve
    plots.shade(strokes, found.phases, modes, 1e3, looks)
    plots.name_events([strokes, force, force], found, 1e3)
    for name in force.texts:
        name.set_text(name.get_text().replace("reverses", "body reverses"))
    force.set_xlabel("time since touchdown [ms]")
    figure.align_ylabels()
    patches = [Patch(label=f"actuator {word}", linewidth=0.0, **looks[word]) for word in dict.fromkeys(modes)]
    figure.legend(handles=patches, loc="outside lower center", ncols=2)
    return figure


FIGURES = (near_equal_poles, certificate, branch_and_bound, saltation, stance)


def draw(folder: Path) -> None:
    """Write each figure as SVG."""
    folder.mkdir(parents=True, exist_ok=True)
    with house_style():
        for figure in FIGURES:
            (folder / f"{figure.__name__}.svg").write_bytes(render(figure(), ".svg"))


if __name__ == "__main__":
    draw(Path(sys.argv[1]))
