"""What is drawn has an oracle: every line, staircase and band of every picture is read back, in the unit of its axis,
and compared with the method that its name stands for. A line without an oracle is refused. The figures of the paper are
those of docs/gallery.
"""

import re
from collections.abc import Callable
from functools import cache
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure

import hopform
import hopform.hopping
import hopform.identify
from docs import gallery
from hopform import _figures as results
from hopform.hopping.controllers import FeedForward
from hopform.hopping.terrain import flat, uniform
from tests import needs
from tests.pictures import ANY_SHADES, Expected, Over, Panel, check, near

HOPPER, HOPPER_B = hopform.load_robot("hopper_c"), hopform.load_robot("hopper_b")
# ---- runs ----


def stances(run):
    if isinstance(run, hopform.hopping.Hop):
        return [(run.flight.duration, run.duration)]
    return [(hop.touchdown_time, hop.takeoff_time) for hop in run.hops]


def lifts(run):
    return [hop for hop in run.hops if hop.stance.takeoff is not None]


def apex_times(run):
    times = np.array([hop.takeoff_time + hop.stance.takeoff.v2 / run.robot.g for hop in lifts(run)])
    assert np.all(times < run.duration + 1e-12)
    return np.minimum(times, run.duration)


def height(run):
    """The method whose values are hop heights."""
    return lambda t: np.asarray(run.at(t).x2) - (run.robot.L0 + run.robot.c)


def heights(run, **more):
    """The panel of heights."""
    takeoffs = np.array([hop.takeoff_time for hop in lifts(run)])
    lines = {
        "body": Over(height(run), 0.0, run.duration),
        "apex": (apex_times(run), height(run)(apex_times(run))),
        "take-off": (takeoffs, height(run)(takeoffs)),
    }
    near(run.at(apex_times(run)).v2, 0.0)
    if run.h_des:
        edges = [0.0, *(hop.touchdown_time for hop in run.hops[1:]), run.duration]
        lines["desired"] = (edges, run.h_des[: len(run.hops)])
    if any(run.terrain):
        lines["ground"] = Over(run.ground, 0.0, run.duration)
    return Panel(lines | more, {}, stances(run))


def whole(method, run):
    return Over(method, 0.0, run.duration)


def kinetic(run):
    return lambda t: run.robot.m_s * np.asarray(run.at(t).v2) ** 2 / 2.0


def gravitational(run):
    return lambda t: run.robot.m_s * run.robot.g * np.asarray(run.at(t).x2)


def spring(run):
    """k (x2 - L0 - c)^2/2 of (23) in stance, x2 from the ground under the foot, and nothing in flight."""
    robot = run.robot

    def energy(t):
        state, places = run.at(t), np.zeros(np.shape(t))
        for begin, end in stances(run):
            inside = (t >= begin) & (t <= end)
            places[inside] = (np.asarray(state.x2) - np.asarray(run.ground(t)) - robot.L0 - robot.c)[inside]
        return robot.k * places**2 / 2.0

    return energy


def predicted(run):
    """What is known beforehand: the energy at the drop, less the impacts, plus what enters the ledger up to a time."""

    def energy(t):
        values = np.full(np.shape(t), run.robot.m_s * run.robot.g * float(run.at(0.0).x2))
        for hop in run.hops:
            values[t >= hop.touchdown_time] -= hop.energy_lost_at_impact - 0.5 * run.robot.k * hop.touchdown.x1**2
            inside = (t >= hop.touchdown_time) & (t <= (hop.takeoff_time if hop.stance.takeoff else run.duration))
            behind = (t > hop.touchdown_time) & ~inside
            ledger = hop.stance.ledger(np.minimum(t[inside] - hop.touchdown_time, hop.stance.duration))
            values[inside] += ledger.spring_work + ledger.viscous_2 + ledger.coulomb_2
            if hop.stance.takeoff:
                values[behind] += hop.stance.aed - 0.5 * run.robot.k * hop.stance.end.x1**2
        return values

    return energy


def energies(run):
    """The lines of energy by their names."""
    return {
        "kinetic + gravitational": whole(lambda t: kinetic(run)(t) + gravitational(run)(t), run),
        "with the spring as in (23) in stance": whole(lambda t: run.energy(t).body, run),
    }


def tracked(run, misses):
    """A run that follows set points: heights, current, errors of apexes."""
    current = Panel({"": whole(run.current, run)}, {}, stances(run))
    return [heights(run), current, Panel(misses, {}, stances(run))]


def missed(run):
    return apex_times(run), [hop.apex - wanted for hop, wanted in zip(run.hops, run.h_des, strict=False)]


ZERO = (None, 0.0)


# ---- the figures of the paper ----


def fig_2(_):
    start = {"v2": 0.0, "x2": HOPPER.L0 + HOPPER.c - HOPPER.m_s * HOPPER.g / HOPPER.k}
    stance = hopform.solve_stance(HOPPER, **start, u=[(0.0, HOPPER.u_max), (0.12, 0.0)], horizon=0.6)
    rate = HOPPER.b1 / HOPPER.m_eff
    free = abs(HOPPER.gamma2) * HOPPER.u_max / HOPPER.b1
    return [
        Panel({"": whole(lambda t: stance.at(t).x1, stance)}),
        Panel({"velocity $\\dot x_1$": whole(lambda t: stance.at(t).v1, stance),
               "motor and viscous friction alone": whole(lambda t: free * (1.0 - np.exp(-rate * t)), stance)}),
        Panel({"": whole(stance.current, stance)}),
    ]  # fmt: skip


def fig_3(_):
    run = hopform.hopping.simulate(HOPPER, flat(30), HOPPER.u_max, height=0.2)
    hops = run.hops[-4:]
    begin, end = hops[0].touchdown_time - 0.03, hops[-1].takeoff_time + 0.1
    takeoffs = np.array([hop.takeoff_time for hop in hops])
    shaded = [(hop.touchdown_time - begin, hop.takeoff_time - begin) for hop in hops]

    def over(name):
        return Over(lambda t: getattr(run.at(np.minimum(t + begin, run.duration)), name), 0.0, end - begin)

    places = (takeoffs - begin, run.at(takeoffs).x1)
    lines = {"actuator $x_1$": over("x1"), "take-off, still compressing": places}
    return [Panel(lines, {}, shaded), Panel({"": over("x2")}, {}, shaded)]


def models_of_tests(data, u, models):
    """Figs. 4, 10: the recordings and the motions of robots in both tests."""
    robot, measured = data["robot"], data["measured"]
    pushed, fallen = np.arange(0.0, 1.0, 0.005), np.arange(0.0, 3.0, 0.005)
    above = {"recorded (synthetic)": (pushed[::2], measured.x1[::2])}
    below = [(fallen[::2], measured.x2[::2])]
    for name, model in models.items():
        standing = model.L0 + model.c - robot.m_s * robot.g / robot.k
        stance = hopform.solve_stance(model, v2=0.0, x2=standing, u=[(0.0, u), (0.3, 0.0)], horizon=1.0)
        above[name] = (pushed, np.asarray(stance.at(np.minimum(pushed, stance.duration)).x1))
        run = hopform.hopping.simulate(model, flat(60), 0.0, height=0.12, horizon=5.0)
        below.append((fallen, np.asarray(run.at(np.minimum(fallen, run.duration)).x2)))
    return [Panel(above), Panel({"": below})]


def map_panel(reach, lines, words):
    """Figs. 5, 11: a map with its bounds, fixed points and diagonal."""
    points = [each.height for each in reach.fixed_points]
    ends = reach.heights[[0, -1]]
    return Panel(
        lines | {"fixed point": (points, points), "height held": (ends, ends)},
        {words: (reach.heights, reach.lowest, reach.highest)},
    )


def fig_5(data):
    reach = data["reach"]
    drawn = list[Expected]()
    for column in range(reach.currents.size):
        apex, limited = reach.apex[:, column], reach.limited[:, column]
        beside = np.convolve(limited, [1, 1, 1], "same") > 0
        drawn.append((reach.heights, np.where(reach.admissible[:, column], apex, np.nan)))
        drawn.append((reach.heights, np.where(beside, apex, np.nan)))
    lines = {"": drawn[:-1], "actuator meets its stop": drawn[-1]}
    return [map_panel(reach, lines, "reachable by some input"), Panel({})]


def fig_11(data):
    reach = data["reach"]
    passive = [hopform.next_apex(HOPPER, each, 0.0) for each in reach.heights]
    return [map_panel(reach, {
        "highest, within the stroke's margin": (reach.heights, reach.highest), "no actuation": (reach.heights, passive),
        "hops, most current": (data["seen"], data["most"]), "hops, no current": (data["seen"], data["least"]),
    }, "reachable")]  # fmt: skip


def fig_7(data):
    rough, exact = data["runs"]["rough"], data["runs"]["exact"]
    return tracked(rough, {"": ZERO, "first controller": missed(rough), "exact controller": missed(exact)})


def fig_8(data):
    run, clean = data["run"], data["clean"]
    near(data["miss without errors"], missed(clean)[1])
    top, *rest = tracked(run, {"": ZERO, "with errors": missed(run), "without": missed(clean)})
    seen = (apex_times(run)[:-1], data["apex as measured"])
    return [Panel(dict(top.lines) | {"apex as measured": seen}, {}, top.stances), *rest]


def fig_9(data):
    rate = float(re.search(r"a ramp of ([\d.]+) A/s", gallery.draw(9).ours)[1])
    curves = {name: (data[f"t, {name}"], data[f"x1, {name}"]) for name in ("spring unloaded", "standing")}
    words = {f"{name}: moves from {data['onset'][name]:.2f} A on": curve for name, curve in curves.items()}
    onsets = [(data["onset"][name] / rate, None) for name in curves]
    return [Panel(words), Panel({"": [*onsets, ([0.0, 6.0], [0.0, 6.0 * rate])]})]


def energy_panels(data):
    run = data["run"]
    takeoffs = {"take-off": ([hop.takeoff_time for hop in lifts(run)], None)}
    parts = {"kinetic": whole(kinetic(run), run), "gravitational": whole(gravitational(run), run),
             "spring as in (23)": whole(spring(run), run)}  # fmt: skip
    ahead = {"predicted: start, impacts, AED (24)": whole(predicted(run), run)}
    return [Panel(each, {}, stances(run)) for each in (takeoffs | ahead | energies(run), parts)]


def fig_15(data):
    run = hopform.hopping.simulate(HOPPER, flat(3), FeedForward(0.2), height=0.2)
    detector = hopform.hopping.TouchdownDetector(high=0.6, low=0.4, count=3, dt=1e-3)
    noise, delays = data["noise"], data["delays"]
    first = run.hops[0]
    costs = [hopform.hopping.delayed_apex(HOPPER, each, v2=first.touchdown.v2, u=first.u)[1] for each in delays]
    found = [event.time for event in detector.detect(data["signal"].tolist()) if event.kind == "touchdown"]
    signal = {"signal": (data["t"], data["signal"]), "touch begins above": (None, 0.6), "ends below": (None, 0.4),
              "touchdown detected": (found, 0.6)}  # fmt: skip
    few = noise[::4]
    mean = {"closed form": (noise, [detector.mean_delay(each) for each in noise]),
            "drawn": (few, [detector.simulated_delays(each, trials=2000, seed=15).mean() for each in few])}  # fmt: skip
    alarms = (noise, [detector.false_alarm_rate(each) for each in noise])
    return [Panel(signal, {}, stances(run)), Panel(mean), Panel({"": alarms}), Panel({"": (delays, costs)})]


def exact_panels(data):
    run = data["run"]
    top, middle, bottom = tracked(run, {name: (apex_times(run), each) for name, each in data["miss"].items()})
    for name, each in data["runs"].items():
        near(data["miss"][name], [hop.apex - wanted for hop, wanted in zip(each.hops, data["wanted"], strict=True)])
    off = data["all off"]
    return [top, middle, bottom._replace(bands={"all parameters off": (apex_times(run), off.min(1), off.max(1))})]


FIGURES: dict[int, Callable[[Any], list[Panel]]] = {
    2: fig_2, 3: fig_3,
    4: lambda data: models_of_tests(data, 4.0, {"model (1), (2), fitted": data["fitted"]}),
    5: fig_5,
    6: lambda data: tracked(data["run"], {"": ZERO, "first controller": missed(data["run"])}),
    7: fig_7, 8: fig_8, 9: fig_9,
    10: lambda data: models_of_tests(data, 1.5, {"model (3), (4)": HOPPER, "model (1), (2), fitted": data["fitted"]}),
    11: fig_11, 12: energy_panels, 13: energy_panels, 14: energy_panels, 15: fig_15, 16: exact_panels,
    17: exact_panels,
}  # fmt: skip
"""What the panels of each figure must show; Fig. 1 is a drawing."""


@cache
def drawn(number):
    return gallery.draw(number)


LONG = (7, 8)
"""Figures of many runs over rough ground."""


@pytest.mark.parametrize("number", [*(n for n in FIGURES if n not in LONG), *needs.sliced(*((n,) for n in LONG))])
def test_a_line_of_a_figure_of_the_paper_is_what_its_name_says(number):
    shown = drawn(number)
    for axes, panel in zip(shown.figure.axes, FIGURES[number](shown.data), strict=True):
        check(axes, panel)


def test_every_figure_of_the_paper_has_an_oracle():
    assert FIGURES.keys() | {1} == gallery.DRAWN.keys()


def test_a_curve_of_the_family_of_maps_bears_its_input():
    reach, axes = drawn(5).data["reach"], drawn(5).figure.axes[0]
    assert sum(len(each.get_text().split(",")) for each in axes.texts) == reach.currents.size
    for each in axes.texts:
        inputs = [float(word) for word in each.get_text().removesuffix(" V").split(",")]
        ends = reach.apex[-1][np.isin(reach.currents, inputs)]
        near(np.array(each.xy) / 100.0, (reach.heights[-1], ends.mean()))


# ---- what `.plot()` and `--plot` draw ----


@cache
def made(name):
    """A result of each type that has a plot."""
    rough = hopform.hopping.simulate(HOPPER, uniform(3, 0.02, seed=1), FeedForward(0.2), height=0.2)
    drop, fast = np.linspace(-2.0, -1.0, 5), {"v2": -1.93}
    kinds: dict[str, Callable[[], Any]] = {
        "Stance": lambda: hopform.solve_stance(HOPPER, v2=-0.61, u=[(0.0, 0.0), (0.05, 2.0), (0.1, -3.0)]),
        "Flight": lambda: hopform.solve_stance(HOPPER, **fast, u=3.0).fly(0.01),
        "Hop": lambda: rough.hops[1],
        "Run": lambda: rough,
        "Batch": lambda: hopform.solve_stances(HOPPER, v2=drop, u=2.0),
        "Hops": lambda: hopform.solve_hops(HOPPER, height=np.linspace(0.02, 0.2, 21), u=2.0, hops=5),
        "Flights": lambda: hopform.solve_flights(HOPPER, v2=-drop, x1=0.03),
        "Reachability": lambda: hopform.reachability(
            HOPPER, np.linspace(0.02, 0.3, 15), np.linspace(0.0, 3.0, 5), stop_margin=0.015
        ),
        "Command": lambda: hopform.choose_current(HOPPER, **fast, h_des=0.2),
        "Recording": lambda: hopform.identify.record(HOPPER, "air", duration=4.0, seed=1),
        "Fit": lambda: hopform.identify.fit_robot(
            decays=hopform.identify.record(HOPPER, "decay", height=0.04, duration=1.0, seed=3), known={"m_s": 3.0},
            holdout=False,
        ),
        "Sensitivities": lambda: hopform.solve_stance(HOPPER, **fast, u=3.0).sensitivities,
    }  # fmt: skip
    return kinds[name]()


def hops_panels(runs):
    """Of 21 runs, some of which do not take off again."""
    hop, columns = np.arange(5), [np.sort(column[np.isfinite(column)]) for column in runs.apex.T]
    assert 0 < columns[-1].size < 21
    low, middle, high = ([np.quantile(column, q) for column in columns] for q in (0.05, 0.5, 0.95))
    share = Panel({"": (hop, [column.size / 21.0 for column in columns])})
    return [Panel({"median": (hop, middle)}, {"5 to 95 % of the runs": (hop, low, high)}), share]


def stance_panels(stance):
    shaded, velocities = ("x1", "x2"), ("v1", "v2")
    state = {name: whole(lambda t, name=name: getattr(stance.at(t), name), stance) for name in (*shaded, *velocities)}
    forces = {f"{name} [N]": whole(lambda t, name=name: stance.forces(t)[name], stance)
              for name in ("friction_x1", "stop_x1", "friction_x2")}  # fmt: skip
    forces |= {"contact [N]": whole(lambda t: HOPPER.k * stance.compression(t), stance)}
    energies = {f"{name} [J]": whole(lambda t, n=n: stance.energy(t)[n], stance) for n, name in enumerate("EH")}
    return [
        *(Panel({"": state[name]}, {}, ANY_SHADES) for name in shaded),
        Panel({f"{name} [m/s]": state[name] for name in velocities}),
        Panel(forces | {"take-off": (stance.duration, 0.0)}), Panel(energies), Panel({"": whole(stance.current, stance)}),
    ]  # fmt: skip


def flight_panels(flight):
    places = {"body": whole(lambda t: flight.at(t).x2, flight), "foot": whole(flight.foot, flight)}
    return [Panel(places), Panel({"": whole(lambda t: flight.at(t).x1, flight)}),
            Panel({"": whole(flight.current, flight)})]  # fmt: skip


def hop_panels(hop):
    return motion_panels(hop, Panel({"body": whole(height(hop), hop)}, {}, stances(hop)))


def motion_panels(run, top):
    lines = {"": whole(lambda t: run.at(t).x1, run)}, energies(run), {"": whole(run.current, run)}
    return [top, *(Panel(each, {}, stances(run)) for each in lines)]


def reach_panels(reach):
    drawn = [
        (reach.heights, np.where(which[:, column], reach.apex[:, column], np.nan))
        for column in range(reach.currents.size) for which in (reach.admissible, reach.limited)
    ]  # fmt: skip
    stable = [each.height for each in reach.fixed_points if abs(each.multiplier) < 1.0 and each.admissible]
    lines = {"": drawn, "beyond the stroke": ([], []), "height held": (reach.heights, reach.heights),
             "fixed point, stable": (stable, stable)}  # fmt: skip
    return [Panel(lines, {"reachable": (reach.heights, reach.lowest, reach.highest)}), Panel({})]


def command_panels(found):
    u, apex = found.curve()
    stances = [hopform.solve_stance(HOPPER, v2=-1.93, u=each) for each in u]
    near(
        apex,
        [each.apex if each.at(np.linspace(0.0, each.duration, 200)).x1.max() < 0.08 else np.nan for each in stances],
    )
    chosen = hopform.solve_stance(HOPPER, v2=-1.93, u=found.u).apex
    return [Panel({"next apex, admissible currents": (u, apex), "desired": (None, 0.2), "reached": (found.u, chosen)})]


def recording_panels(recording):
    return [Panel({"": (recording.time, recording.columns[name].values)}) for name in ("x1", "current")]


def fit_panels(fit):
    (trace,) = fit.traces
    off, rate = trace.predicted - trace.measured, np.gradient(trace.predicted, trace.time)
    lines = {"measured": trace.measured, "(1), (2): viscous friction alone": trace.old,
             "(3), (4): with Coulomb friction": trace.predicted}  # fmt: skip
    intervals = list[Expected]()
    for row, name in enumerate(("f2", "b2", "k")):
        (each,) = (one for one in fit.estimates if one.name == name)
        ends = np.array([each.low, each.high]) / each.value - 1.0
        intervals += [(ends, [row, row]), (0.0, row)]
    return [
        Panel({name: (trace.time, values) for name, values in lines.items()}),
        Panel({"": [(trace.time, trace.old - trace.measured), (trace.time, off)]}),
        Panel({"": (trace.predicted, off)}),
        Panel({"": (1000.0 * rate, 1000.0 * off)}),  # mm/s, and mm, which the panel on the left says
        Panel({"": intervals}),
        Panel({}),
    ]


RESULTS: dict[str, tuple[Callable[[Any], list[Panel]], int]] = {
    "Stance": (stance_panels, 1), "Flight": (flight_panels, 0), "Hop": (hop_panels, 0),
    "Run": (lambda run: motion_panels(run, heights(run)), 0),
    "Batch": (lambda batch: [Panel({"": (np.arange(batch.apex.size), batch.apex)})], 0),
    "Hops": (hops_panels, 0),
    "Flights": (lambda flights: [Panel({"": (np.arange(flights.duration.size), flights.duration)})], 0),
    "Reachability": (reach_panels, 0), "Command": (command_panels, 0), "Recording": (recording_panels, 0),
    "Fit": (fit_panels, 0),
}  # fmt: skip
"""What the panels of each result must show, and which one is drawn alone."""


@pytest.mark.parametrize("name", RESULTS)
def test_a_line_of_a_plot_is_the_method_of_its_name(name):
    result = made(name)
    for axes, panel in zip(results.figure_of(result).axes, RESULTS[name][0](result), strict=True):
        check(axes, panel)


@pytest.mark.parametrize("name", RESULTS)
def test_the_main_panel_alone_shows_the_same(name):
    result, axes = made(name), Figure().subplots()
    panels, main = RESULTS[name]
    assert result.plot(axes) is axes
    check(axes, panels(result)[main])


def test_every_plot_has_an_oracle():
    """That of derivatives has no lines, that of a motion is tried in test_motion.py."""
    known = {each.__name__ for each in results.PICTURES if each.__module__.startswith("hopform.")}
    assert RESULTS.keys() | {"Sensitivities", "Motion"} == known


def test_a_curve_of_a_map_has_the_colour_of_its_current():
    reach, axes = made("Reachability"), results.figure_of(made("Reachability")).axes[0]
    colours = mpl.colormaps["viridis_r"](reach.currents / reach.currents[-1])
    shown = [line.get_color() for line in axes.get_lines()[: 2 * reach.currents.size : 2]]
    np.testing.assert_array_equal(shown, colours)


def test_derivatives_stand_in_their_cells():
    found, axes = made("Sensitivities"), results.figure_of(made("Sensitivities")).axes[0]
    words = [re.match(r"\w+", each.get_text())[0] for each in (*axes.get_yticklabels(), *axes.get_xticklabels())]
    assert words == [*found.rows, *found.columns]
    for each in axes.texts:
        column, row = map(int, each.get_position())
        assert float(each.get_text()) == pytest.approx(found[found.rows[row], found.columns[column]], rel=0.051)
    shares = found.matrix / np.abs(found.matrix).max(axis=1, keepdims=True)
    near(np.asarray(axes.images[0].get_array()), shares)


def test_a_map_of_stances_has_their_apexes_in_its_cells():
    v2, u = np.linspace(-2.0, -1.0, 5), np.array([0.0, 1.0, 2.0])
    axes = results.figure_of(hopform.solve_stances(HOPPER, v2=v2[:, np.newaxis], u=u)).axes[0]
    (mesh,) = axes.collections
    near(np.asarray(mesh.get_array()), [[100.0 * hopform.solve_stance(HOPPER, v2=a, u=b).apex for b in u] for a in v2])
    assert (axes.get_ylabel(), axes.get_xlabel()) == ("dimension 0 [index]", "dimension 1 [index]")


def test_correlations_stand_in_their_cells():
    fit, axes = made("Fit"), results.figure_of(made("Fit")).axes[-1]
    names = [each.get_text() for each in axes.get_yticklabels()]
    assert names == [each.get_text() for each in axes.get_xticklabels()]
    for (first, second), value in fit.correlations.items():
        assert axes.images[0].get_array()[names.index(first), names.index(second)] == value
