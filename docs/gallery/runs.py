"""Runs over time, and return maps.

Controllers that track heights: Hopper B's first one on even ground (Fig. 6), on uneven ground (Fig. 7), with errors of
sensors, motor and clock (Fig. 8); the energy-based one on even ground (Fig. 16) and on uneven ground (Fig. 17). Energy:
of an ideal drop (Fig. 12), a real one (Fig. 13), and hopping at 3 A (Fig. 14). The next apex over the apex before it
(Figs. 5, 11).
"""
# pyright: reportUnknownMemberType=false

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from docs.gallery.picture import Array, Drawn, cm, completed, legend, mm, panels, rms, stream, volts
from hopform import Reachability, Robot, choose_current, load_robot, reachability
from hopform._figures import plots
from hopform._figures.plots import BLACK, BLUE, MAGENTA, ORANGE, SKY, colours_of
from hopform.hopping import Errors, Run, animate, simulate
from hopform.hopping import _pictures as pictures_of_runs
from hopform.hopping.controllers import AsPrinted, FeedForward, ReturnMap, Sampled, Touchdown
from hopform.hopping.terrain import Heights, flat, uniform

REFERENCE = (0.16,) * 6 + (0.20,) * 6 + (0.14,) * 6
NOISE_OF_SENSORS = {"x1": 5e-4, "v1": 0.02, "x2": 3e-3, "v2": 0.05, "ground": 3e-3}
SETTLED = 3  # hops after a step of the reference that are not counted


def law(robot: Robot) -> tuple[float, float]:
    """Kp [A/m] and Kd [A s/m] of the law in expansion: 20 u_max a metre, u_max a metre a second."""
    return 20.0 * robot.u_max, robot.u_max


def references(robot: Robot) -> tuple[float, ...]:
    """Wanted heights [m] of the hops."""
    return tuple(each for each in REFERENCE)


def on_even_ground(robot: Robot) -> Drawn:
    """Fig. 6: the controller follows steps of the height."""
    (Kp, Kd), wanted = law(robot), references(robot)
    run = completed(simulate(robot, flat(len(wanted)), ReturnMap(wanted, Kp=Kp, Kd=Kd), height=wanted[0]))
    miss = run.table["apex"] - np.array(wanted)
    settled, up = after_steps(miss), wanted.index(max(wanted))
    rise = int(np.argmax(np.abs(miss[up:]) < 0.1 * (max(wanted) - wanted[0]))) + 1
    ours = (
        f"{len(run.hops)} hops over flat ground, desired {', '.join(cm(each, 0) for each in dict.fromkeys(wanted))}. "
        f"The return maps were measured in simulated steady hopping; in expansion a law at 1 kHz (Kp = {Kp:g} "
        f"{volts(robot)}/m, Kd = {Kd:g} {volts(robot)} s/m) tracks a recorded x2. It rises to a step up within "
        f"{rise} hops; the apex is off by {mm(worst(miss))} at most behind a step, by {mm(rms(settled))} rms from "
        f"the {SETTLED + 1}th hop on"
    )
    return tracked(run, {"first controller": run}), ours, {"run": run, "wanted": wanted, "miss": miss}


def on_uneven_ground(robot: Robot) -> Drawn:
    """Fig. 7: the same controller fails on rough ground, where the exact one holds the height."""
    (Kp, Kd), wanted, size, count = law(robot), 0.16, 0.03, 18
    ground, first = uniform(count, size, seed=7), ReturnMap(wanted, Kp=Kp, Kd=Kd)
    runs = {
        "rough": simulate(robot, ground, first, height=wanted),
        "even": simulate(robot, flat(count), first, height=wanted),
        "soft": simulate(robot, ground, ReturnMap(wanted, Kp=Kp / 4.0, Kd=Kd / 4.0), height=wanted),
        "printed": simulate(robot, ground, AsPrinted(wanted), height=wanted),
        "exact": simulate(robot, ground, FeedForward(wanted), height=wanted),
    }
    completed(runs["exact"])
    others = [simulate(robot, uniform(count, size, seed=seed), first, height=wanted) for seed in range(100, 112)]
    miss = {name: run.table["apex"] - wanted for name, run in runs.items()}
    figure = tracked(runs["rough"], {"first controller": runs["rough"], "exact controller": runs["exact"]})
    spread = {name: float(np.nanstd(values[SETTLED:])) for name, values in miss.items()}
    spreads = [float(np.nanstd(run.table["apex"][SETTLED:])) for run in others]
    fallen = sum(run.status != "completed" for run in others)
    ours = (
        f"{len(runs['rough'].hops)} of {count} hops ({runs['rough'].status}) over heights drawn from {cm(-size, 0)} "
        f"to {cm(size, 0)}, desired {cm(wanted, 0)}, gains as in Fig. 6. Under the first controller the apex scatters "
        f"by {mm(spread['rough'])} (standard deviation) and is off by up to {mm(worst(miss['rough']))}; on even "
        f"ground it scatters by {mm(spread['even'])}. On {len(others)} other grounds: {mm(min(spreads))} to "
        f"{mm(max(spreads))}, {fallen} of these runs end early. A quarter of the gains: {mm(spread['soft'])} on this "
        f"ground, up to {mm(worst(miss['soft']))} off: the paper gives no gains, and these are not the best. On the "
        f"same ground the energy-based controller is off by {worst(miss['exact']):.0e} m at most if exact, with (26), "
        f"(27) as printed by {mm(rms(miss['printed']))} rms, the first controller by {mm(rms(miss['rough']))}"
    )
    return figure, ours, {"runs": runs, "others": others, "wanted": wanted, "miss": miss, "spread": spread}


def with_errors(robot: Robot) -> Drawn:
    """Fig. 8: the experiment's place is taken by a simulation whose sensors, motor and clock are not perfect."""
    kinds: dict[str, dict[str, Any]] = {
        "noise": NOISE_OF_SENSORS, "force": {"current_scale": 0.97}, "tick": {"quantum": 1e-3, "delay": 2e-3},
    }  # fmt: skip
    errors = Errors(**{name: value for kind in kinds.values() for name, value in kind.items()})
    (Kp, Kd), wanted = law(robot), references(robot)
    first, ground = ReturnMap(wanted, Kp=Kp, Kd=Kd), flat(len(wanted))
    clean = completed(simulate(robot, ground, first, height=wanted[0]))
    tracking, seen = first.prepare(robot, ground), list[float]()

    def noting(touchdown: Touchdown) -> Sampled:
        seen.append(touchdown.apex)
        return tracking(touchdown)

    run = completed(simulate(robot, ground, noting, height=wanted[0], errors=errors, seed=8))
    run = replace(run, h_des=clean.h_des)
    each = {name: simulate(robot, ground, first, height=wanted[0], errors=Errors(**kind), seed=8)
            for name, kind in kinds.items()}  # fmt: skip
    alone = {name: one.table["apex"] - wanted for name, one in each.items()}
    miss, before = (each.table["apex"] - np.array(wanted) for each in (run, clean))
    known = np.array(seen[1:])  # at the touchdown behind each apex
    figure = tracked(run, {"with errors": run, "without": clean})
    times, _ = pictures_of_runs.apexes(run)
    figure.axes[0].plot(times[: known.size], 100 * known, "s", color=plots.GREEN, markersize=4.0,
                        markerfacecolor="none", clip_on=False, label="apex as measured")  # fmt: skip
    legend(figure.axes[0])
    ours = (
        f"a simulation in the experiment's place ({run.status}, {len(run.hops)} hops): noise of {mm(errors.x2)} and "
        f"{errors.v2:g} m/s on the body, {100 * (1 - errors.current_scale):.0f} % less force than asked for, "
        f"touchdown seen at a 1 kHz tick and {1e3 * errors.delay:.0f} ms late. Once settled the apex is off by "
        f"{mm(rms(after_steps(miss)))} rms, against {mm(rms(after_steps(before)))} without these errors. Noise alone: "
        f"{mm(rms(after_steps(alone['noise'])))}; too little force: {mm(rms(after_steps(alone['force'])))}; tick and "
        f"delay: {mm(rms(after_steps(alone['tick'])))}"
    )
    data = {"run": run, "clean": clean, "wanted": wanted, "miss": miss, "miss without errors": before, "errors": errors,
            "apex as measured": known, "alone": alone}  # fmt: skip
    return figure, ours, data


def tracked(run: Run, compared: Mapping[str, Run]) -> Figure:
    """Heights and inputs of a run, its set points, and by how much the apexes of some runs, by name, miss them."""
    figure, bottom = over_hops(run, 6.2, 0.9)
    bottom.axhline(0.0, color=plots.BLACK, linestyle="--", linewidth=0.8)
    for (name, each), colour, marker in zip(compared.items(), (plots.BLUE, plots.GREEN), "oD", strict=False):
        times, heights = pictures_of_runs.apexes(each)
        miss = 1e3 * (heights - np.array(run.h_des[: times.size]))
        bottom.plot(times, miss, marker, color=colour, markersize=3.5, clip_on=False, label=name)
    legend(bottom)
    return figure


def over_hops(run: Run, height: float, share: float) -> tuple[Figure, Axes]:
    """Heights and current of a run, its stances shaded, and the panel under these, for errors of its apexes."""
    figure, (top, middle, bottom) = panels(3, height, sharex=True, height_ratios=[1.6, 0.8, share])
    t = pictures_of_runs.run_times(run)
    pictures_of_runs.draw_heights(top, run, t)
    pictures_of_runs.shade_stances(top, run, "stance")
    legend(top)
    middle.plot(t, np.asarray(run.current(t)), color=plots.CURRENT, linewidth=0.9)
    for axes in (middle, bottom):
        pictures_of_runs.shade_stances(axes, run)
    middle.set_ylabel(f"{'input' if volts(run.robot) == 'V' else 'current'} $u$ [{volts(run.robot)}]")
    bottom.set(xlabel="time [s]", ylabel="apex error [mm]")
    return figure, bottom


def after_steps(miss: Array) -> Array:
    """The errors but for the first hops after each step of the reference."""
    steps = [0, *(n for n in range(1, len(REFERENCE)) if REFERENCE[n] != REFERENCE[n - 1])]
    late = [n for n in range(len(miss)) if n - max(step for step in steps if step <= n) >= SETTLED]
    return np.asarray(miss[late])


def worst(values: Array) -> float:
    """Largest magnitude of what is a number."""
    return float(np.nanmax(np.abs(values)))


# ---- the energy-based controller ----

WANTED = (0.14,) * 6 + (0.18,) * 6 + (0.12,) * 6
SIZE = 0.02  # [m] half width of the uneven ground
IDENTIFIED = ("m_eff", "k", "b1", "b2", "f1", "f2", "gamma2")
OFF = 0.05  # share by which a parameter of a model is off
MODELS = 32  # all of whose parameters are off, each sign drawn
PERFECT = Errors()
NOISE = Errors(x1=5e-4, v1=0.02, v2=0.02, ground=2e-3)
LATE = Errors(quantum=1e-3, delay=2e-3)
LEAST = 0.1  # [mm] below which the scale of errors is linear
MARKS = (("o", plots.GREEN), ("s", plots.BLACK), ("^", plots.MAGENTA), ("D", plots.SKY), ("v", plots.ORANGE))


def exact_on_even_ground(robot: Robot) -> Drawn:
    """Fig. 16."""
    return compared(16, robot, flat(len(WANTED)), "over flat ground")


def exact_on_uneven_ground(robot: Robot) -> Drawn:
    """Fig. 17."""
    size = SIZE
    where = f"over heights drawn from {cm(-size, 0)} to {cm(size, 0)}, known at touchdown only"
    return compared(17, robot, uniform(len(WANTED), size, seed=17), where)


def compared(seed: int, robot: Robot, ground: Heights, where: str) -> Drawn:
    """Heights, currents and errors of the exact controller, of the one as printed, and of the exact one that errs: with
    a model of which one parameter is off, or with models of which all are.
    """
    wanted = tuple(each for each in WANTED)

    def hopped(kind: Any = FeedForward, errors: Errors = PERFECT) -> Run:
        return simulate(robot, ground, kind(wanted), height=wanted[0], errors=errors, seed=seed)

    def missed(run: Run) -> Array:
        """The errors of its apexes [m], NaN behind its end."""
        apexes = [*run.table["apex"], *[np.nan] * (len(wanted) - len(run.hops))]
        found: Array = np.array(apexes) - np.array(wanted)
        return found

    run = completed(hopped())
    alone = {
        (name, share): hopped(errors=believing(robot, {name: share})) for name in IDENTIFIED for share in (-OFF, OFF)
    }
    costly, share = max(alone, key=lambda each: np.nan_to_num(rms(missed(alone[each]))))
    one = f"{costly} off"
    runs = {"exact": run, "printed": hopped(AsPrinted), one: alone[costly, share], "noise": hopped(errors=NOISE),
            "late": hopped(errors=LATE)}  # fmt: skip
    miss = {name: missed(each) for name, each in runs.items()}
    shares = OFF * stream(seed).choice([-1.0, 1.0], (MODELS, len(IDENTIFIED)))
    models: list[dict[str, float]] = [dict(zip(IDENTIFIED, each, strict=True)) for each in shares.tolist()]
    all_off = np.array([missed(hopped(errors=believing(robot, model))) for model in models])
    figure, bottom = over_hops(run, 6.9, 1.3)
    times, _ = pictures_of_runs.apexes(run)
    ends = (1e3 * end.reduce(all_off)[: times.size] for end in (np.fmin, np.fmax))
    bottom.fill_between(times, *ends, color=plots.MAGENTA, alpha=0.2, linewidth=0.0, label="all parameters off")
    for (name, each), (marker, colour) in zip(miss.items(), MARKS, strict=True):
        bottom.plot(times, 1e3 * each[: times.size], marker, color=colour, markersize=3.5, clip_on=False, label=name)
    bottom.set_yscale("symlog", linthresh=LEAST)
    legend(bottom)
    off = {name: f"{mm(rms(each))} rms, {mm(worst(each))} at most" for name, each in miss.items()}
    low, hops = (int(np.sum(each)) for each in (miss["printed"] < 0.0, np.isfinite(miss["printed"])))
    each_rms = [rms(each) for each in all_off if np.isfinite(each).any()] or [np.nan]
    ours = (
        f"{len(run.hops)} hops {where}, desired {', '.join(cm(each, 0) for each in dict.fromkeys(wanted))}. With "
        f"apex(u) = h_des solved exactly every apex is within {worst(miss['exact']):.0e} m of the set point, at "
        f"{np.abs(run.table['u']).max():.2f} {volts(robot)} of {robot.u_max:g} {volts(robot)} at most. (26), (27) as "
        f"printed, J minimised on a grid of 0.01 {volts(robot)}: {off['printed']}; {low} of {hops} apexes are too low, "
        f"by {mm(-float(np.nanmean(miss['printed'])))} on average. The exact controller with models "
        f"of which {', '.join(IDENTIFIED)} are all off by {100 * OFF:.0f} %, each sign drawn for {MODELS} models: "
        f"{mm(rms(all_off))} rms, {1e3 * min(each_rms):.1f} to {mm(max(each_rms))} rms by the model, "
        f"{mm(worst(all_off))} at most. Of one parameter alone {costly}, {100 * OFF:.0f} % too "
        f"{'large' if share > 0.0 else 'small'}, costs most: {off[one]}. With noise of {mm(NOISE.x1)} and "
        f"{NOISE.v1:g} m/s on x1, {NOISE.v2:g} m/s on v2, {mm(NOISE.ground)} on the ground: {off['noise']}; with "
        f"touchdown seen at a tick of 1 kHz and {1e3 * LATE.delay:.0f} ms late: {off['late']}. The scale of the "
        f"errors is linear below {LEAST:g} mm"
    )
    data = {"run": run, "runs": runs, "wanted": wanted, "miss": miss, "shares": shares.T, "all off": all_off.T,
            "alone": {" ".join(map(str, key)): missed(each) for key, each in alone.items()}}  # fmt: skip
    return figure, ours, data


def believing(robot: Robot, shares: Mapping[str, float]) -> Errors:
    """The controller's model is the robot, some of its parameters off by shares of their values."""
    return Errors(model=replace(robot, **{name: (1.0 + each) * getattr(robot, name) for name, each in shares.items()}))


# ---- energy over time ----


def ideal_drop(robot: Robot) -> Drawn:
    """Fig. 12: without losses the energy stays; the robot without friction, its actuator locked."""
    height, kept = 0.2, max(0.0, robot.x1_min)
    none: dict[str, Any] = dict.fromkeys(("b1", "b2", "f1", "f2", "f1_excess", "f2_excess", "impact_loss"), 0.0)
    still = replace(robot, **none, x1_min=kept, x1_max=kept)
    run = simulate(still, flat(5), 0.0, height=height)
    data, figure = energies(run)
    energy = data["energy"]
    span = float(np.ptp(energy)) / float(energy[0])
    ours = (
        f"a drop of {cm(height, 0)}, {len(run.hops)} hops. Kinetic, gravitational and spring energy add up to "
        f"{energy[0]:.4f} J throughout; the sum varies by {span:.0e} of that"
    )
    return figure, ours, data


def real_drop(robot: Robot) -> Drawn:
    """Fig. 13: a passive drop, the energy as predicted by (24)."""
    height = 0.2
    run = simulate(robot, flat(7), 0.0, height=height)
    data, figure = energies(run)
    first = run.hops[0]
    loss = data["energy"][0] - data["energy"][-1]
    ours = (
        f"a drop of {cm(height, 0)} at 0 A, {len(run.hops)} hops ({run.status}), {loss:.2f} J lost. At the first "
        f"impact {first.energy_lost_at_impact:.3f} J go at once, {-float(first.stance.aed):.3f} J over the stance. "
        "The AED of (24), predicted at each touchdown, and the energy after the fact differ by at most "
        f"{data['predicted off']:.0e} J"
    )
    return figure, ours, data


def actuated(robot: Robot) -> Drawn:
    """Fig. 14: the same at 3 A, up to a steady height."""
    height, u = 0.2, robot.u_max
    run, long = (simulate(robot, flat(hops), u, height=height) for hops in (12, 60))
    completed(long)
    steady = long.hops[-1].apex
    data, figure = energies(run)
    heights = run.table["apex"]
    ours = (
        f"the same drop at {u:g} {volts(robot)}, {len(run.hops)} hops: apexes go from {cm(heights[0])} to "
        f"{cm(heights[-1], 2)} and settle at {cm(steady, 2)}. With the spring as in (23), the minima in stance are the "
        "actuator's work on the body, and the drop at take-off is k x1^2/2, the spring's share at x1 > 0, which (27) "
        "leaves out; the body's kinetic and gravitational energy have no jump there. AED predicted and energy after "
        f"the fact differ by at most {data['predicted off']:.0e} J"
    )
    data["steady"] = steady
    return figure, ours, data


def energies(run: Run) -> tuple[dict[str, Any], Figure]:
    """The body's energy over a run, that with the spring as in (23) and as predicted by the AED, and its parts; and
    these numbers.
    """
    t = np.asarray(pictures_of_runs.run_times(run), dtype=float)
    energy, predicted = np.asarray(run.energy(t).body), np.asarray(run.aed(t))
    kinetic, weight = pictures_of_runs.energies_of_body(run, t)
    spring = energy - kinetic - weight
    figure, (top, bottom) = panels(2, 5.2, sharex=True, height_ratios=[1.4, 1.0])
    lifts = [hop.takeoff_time for hop in run.hops if hop.stance.takeoff is not None]
    for axes in (top, bottom):
        pictures_of_runs.shade_stances(axes, run, "stance")
    where: dict[str, Any] = {"transform": top.get_xaxis_transform(), "clip_on": False}
    top.plot(lifts, np.full(len(lifts), 0.04), "^", label="take-off", **where, **plots.TAKEOFF)
    top.plot(t, predicted, color=plots.MAGENTA, linewidth=4.0, alpha=0.4, label="predicted: start, impacts, AED (24)")
    pictures_of_runs.draw_energies(top, run, t)
    legend(top)
    bottom.plot(t, kinetic, color=plots.BLUE, linewidth=1.0, label="kinetic")
    bottom.plot(t, weight, color=plots.GREEN, linewidth=1.0, linestyle="--", label="gravitational")
    bottom.plot(t, spring, color=plots.ORANGE, linewidth=1.0, linestyle="-.", label="spring as in (23)")
    bottom.set(xlabel="time [s]", ylabel="parts [J]")
    legend(bottom, handles=bottom.get_lines())
    data = {"run": run, "t": t, "body": kinetic + weight, "energy": energy, "predicted": predicted, "kinetic": kinetic,
            "weight": weight, "spring": spring, "predicted off": float(np.abs(energy - predicted).max())}  # fmt: skip
    return data, figure


# ---- the hopper, moving ----


def hopping() -> bytes:
    """The GIF of six hops of hopper_c over rough ground under the energy-based controller."""
    wanted = 0.18
    run = simulate(load_robot("hopper_c"), uniform(6, 0.04, seed=4), FeedForward(wanted), height=wanted)
    gif: bytes = animate(completed(run), h_des=wanted).gif
    return gif


# ---- the next apex over the apex before it ----


def family_of_maps(robot: Robot) -> Drawn:
    """Fig. 5: a family of return maps, one per control action."""
    currents = np.array([0.0, *np.linspace(0.5, 1.0, 6) * robot.u_max])
    reach = reachability(robot, np.linspace(0.02, 0.36, 171), currents)
    colours = colours_of(currents)
    free = np.where(reach.admissible, 100 * reach.apex, np.nan)
    stopped = np.where(beside(reach.limited), 100 * reach.apex, np.nan)
    silent, held = np.isnan(reach.apex).any(axis=1), np.isfinite(reach.hold)
    up_to, highest = (float(reach.heights[some].max(initial=0.0)) for some in (silent, held))
    figure, (axes,) = panels(1, 5.3)
    shade(axes, reach, "reachable by some input")
    for column, colour in enumerate(map(colours.to_rgba, currents)):
        axes.plot(100 * reach.heights, free[:, column], color=colour)
        label = "" if column < currents.size - 1 else "actuator meets its stop"
        axes.plot(100 * reach.heights, stopped[:, column], color=colour, linestyle=":", label=label)
    for height, words in grouped(100 * reach.apex[-1], currents, 1.2):
        end = (100 * reach.heights[-1], height)
        label = f"{words} {volts(robot)}"
        axes.annotate(label, end, (3, 0), textcoords="offset points", va="center", fontsize=8)
    axes.figure.colorbar(colours, ax=axes, label=f"input [{volts(robot)}]", pad=0.08)
    returned(axes, reach)
    half = 0.2
    points = "; ".join(
        f"{cm(each.height)} at {each.u:g} {volts(robot)} (multiplier {each.multiplier:.2f})"
        for each in reach.fixed_points
    )
    ours = (
        f"the next apex after drops of {cm(reach.heights[0])} to {cm(reach.heights[-1])}, actuator at its origin, "
        f"under {currents.size} constant inputs. Heights that one gives back: {points}. Without actuation "
        f"{cm(half, 0)} become {cm(passive(reach, half))}; the highest that can be held is "
        f"{cm(highest)}. Up to {cm(up_to)} some inputs lead to no take-off: "
        "their curves begin above that"
    )
    return figure, ours, {"reach": reach}


def bounds_of_map(robot: Robot) -> Drawn:
    """Fig. 11: what a current can reach, bounds from the closed form, markers from simulated hops with errors."""
    margin, noise = 0.015, 0.003
    heights = np.linspace(0.02, 0.40, 77)
    reach = reachability(robot, heights, np.array([0.0, robot.u_max]), stop_margin=margin)
    draw = stream(11)
    drops = np.repeat(np.linspace(0.04, 0.38, 12), 2)
    least, most = (np.array([measured(robot, each, high, margin) for each in drops]) for high in (False, True))
    seen = drops + noise * draw.standard_normal(drops.size)
    least, most = (values + noise * draw.standard_normal(drops.size) for values in (least, most))
    idle = np.interp(seen, reach.heights, reach.apex[:, 0])
    misses = np.concatenate([least - idle, most - np.interp(seen, reach.heights, reach.highest)])
    figure, (axes,) = panels(1, 5.3)
    shade(axes, reach, "reachable")
    axes.plot(100 * reach.heights, 100 * reach.highest, color=BLUE, label="highest, within the stroke's margin")
    axes.plot(100 * reach.heights, 100 * reach.apex[:, 0], color=MAGENTA, linestyle="--", label="no actuation")
    hollow: dict[str, Any] = {"markersize": 4.5, "markerfacecolor": "none"}
    axes.plot(100 * seen, 100 * most, "^", color=BLUE, label="hops, most current", **hollow)
    axes.plot(100 * seen, 100 * least, "v", color=MAGENTA, label="hops, no current", **hollow)
    returned(axes, reach)
    top = next((point for point in reach.fixed_points if point.u == robot.u_max), None)
    back = top and f"{cm(top.height)} is given back (multiplier {top.multiplier:.2f})"
    holds = f"at {robot.u_max:g} {volts(robot)} {back}" if back else "none is held"
    half = 0.2
    row, below = int(np.abs(reach.heights - half).argmin()), reach.apex[:, 0] - reach.lowest
    ours = (
        f"the dashed curve is a drop at 0 {volts(robot)} ({cm(half, 0)} become {cm(passive(reach, half))}); the "
        f"lowest apex of all currents lies below it, by up to {mm(float(below.max()))}: {cm(reach.heights[row], 0)} "
        f"become {cm(reach.lowest[row])} at {reach.u_lowest[row]:.2f} {volts(robot)}. The upper curve is the highest "
        f"apex of all currents up to {robot.u_max:g} {volts(robot)} that keep x1 {cm(margin)} off its stop; {holds}. "
        f"The stroke limits {int(reach.limited.any(axis=1).sum())} of {reach.heights.size} heights. Markers: "
        f"simulated hops, {mm(noise)} noise on each height; rms distance to the curves {mm(rms(misses))}"
    )
    return figure, ours, {"reach": reach, "seen": seen, "least": least, "most": most, "misses": misses, "noise": noise}


def beside(which: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Where it holds (H, U), and at the heights next to that, so that a curve goes on from its neighbour."""
    wider = which.copy()
    wider[1:] |= which[:-1]
    wider[:-1] |= which[1:]
    return wider


def measured(robot: Robot, height: float, highest: bool, margin: float) -> float:
    """The apex [m] of one simulated hop from a height [m]: without actuation, or with what leads highest."""

    def controller(touchdown: Touchdown) -> float:
        return choose_current(robot, v2=touchdown.v2, h_des=10.0, stop_margin=margin).u if highest else 0.0

    return simulate(robot, flat(1), controller, height=height).hops[0].apex


def grouped(ends: Array, currents: Array, least: float) -> list[tuple[float, str]]:
    """Ends of curves with their labels; those that end closer than `least` share one."""
    order = np.argsort(ends)
    groups = np.split(order, np.flatnonzero(~(np.diff(ends[order]) < least)) + 1)
    return [(float(ends[group].mean()), ", ".join(f"{u:g}" for u in currents[np.sort(group)])) for group in groups]


def passive(reach: Reachability, height: float) -> float:
    """The next apex [m] without actuation, the first current of the map, from a height [m]."""
    return float(np.interp(height, reach.heights, reach.apex[:, 0]))


def shade(axes: Axes, reach: Reachability, words: str) -> None:
    """Shade the apexes that admissible currents reach."""
    ends = (100 * reach.heights, 100 * reach.lowest, 100 * reach.highest)
    axes.fill_between(*ends, color=SKY, alpha=0.18, linewidth=0.0, label=words)


def returned(axes: Axes, reach: Reachability) -> None:
    """The line on which a height is given back, a dot where a current does so, the axes' names and the legend."""
    heights, ends = [100 * point.height for point in reach.fixed_points], 100 * reach.heights[[0, -1]]
    axes.plot(heights, heights, "o", color=ORANGE, markersize=5.0, zorder=4, label="fixed point")
    axes.plot(ends, ends, color=BLACK, linestyle=":", linewidth=1.0, label="height held")
    axes.set(xlabel="apex [cm]", ylabel="next apex [cm]")
    legend(axes)
