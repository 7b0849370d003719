"""The machine: its schematic (Fig. 1c); what the actuator can do, its step response (Fig. 2), its stroke in steady
hopping (Fig. 3), its dry friction (Fig. 9); its touchdown sensor (Fig. 15)."""
# pyright: reportUnknownMemberType=false

from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Rectangle

from docs.gallery.picture import Array, Drawn, cm, completed, legend, mm, panels, standing, stream, volts
from hopform import Robot, Stance, solve_stance
from hopform._figures.plots import BLACK, BLUE, CURRENT, GREEN, GREY, MAGENTA, ORANGE
from hopform.hopping import Run, TouchdownDetector, delayed_apex, simulate
from hopform.hopping._pictures import STANCE, shade_stances
from hopform.hopping.controllers import FeedForward
from hopform.hopping.terrain import flat


def step_response(robot: Robot) -> Drawn:
    """Fig. 2: the largest current for a short time, standing."""
    pulse = 0.12
    stance = solve_stance(robot, v2=0.0, x2=standing(robot), u=[(0.0, robot.u_max), (pulse, 0.0)], horizon=0.6)
    t = np.linspace(0.0, stance.duration, 600)
    state, u = stance.at(t), np.where(t < pulse, robot.u_max, 0.0)
    x1, v1 = np.asarray(state.x1), np.asarray(state.v1)
    # What motor and viscous friction would do alone, had they no spring, weight and dry friction against them.
    push, decay = abs(robot.gamma2) * robot.u_max / robot.m_eff, robot.b1 / robot.m_eff
    free = push / decay * -np.expm1(-decay * t) if decay else push * t
    figure, (top, middle, bottom) = panels(3, 4.9, sharex=True, height_ratios=[1.0, 1.0, 0.6])
    top.plot(1e3 * t, 100.0 * x1, color=BLUE)
    top.set_ylabel("actuator $x_1$ [cm]")
    middle.plot(1e3 * t, v1, color=BLUE, label=r"velocity $\dot x_1$")
    middle.plot(1e3 * t, free, color=BLACK, linestyle=":", label="motor and viscous friction alone")
    middle.set_ylabel("velocity [m/s]")
    legend(middle)
    bottom.step(1e3 * t, u, color=CURRENT, where="post")
    bottom.set(xlabel="time [ms]", ylabel=f"current $u$ [{volts(robot)}]")
    ours = (
        f"simulated, {robot.u_max:g} {volts(robot)} for {1e3 * pulse:.0f} ms while it stands on its spring. After "
        f"that pulse x1 has moved {cm(float(stance.at(pulse).x1))}, its velocity is at most {v1.max():.2f} m/s, and "
        f"it comes to {cm(float(x1.max()))} "
        f"{'when the leg takes off' if stance.status == 'takeoff' else 'before it sinks back'} at "
        f"{1e3 * stance.duration:.0f} ms: neither the length of the leg nor its acceleration can be commanded at once"
    )
    return figure, ours, {"t": t, "x1": x1, "v1": v1, "u": u, "free": free}


def compression_cycles(robot: Robot) -> Drawn:
    """Fig. 3: stances in steady hopping; the actuator still moves at take-off."""
    run, shown = simulate(robot, flat(30), robot.u_max, height=0.2), 4
    completed(run)
    first = run.hops[-shown]
    corners = [time for hop in run.hops[-shown:] for time in (hop.touchdown_time, hop.takeoff_time)]
    t = np.union1d(np.linspace(first.touchdown_time - 0.03, run.hops[-1].takeoff_time + 0.1, 1500), corners)
    state = run.at(t)
    takeoffs = np.array([hop.takeoff_time for hop in run.hops[-shown:]])
    x1, v1 = (np.array([float(getattr(hop.stance.end, name)) for hop in run.hops[-shown:]]) for name in ("x1", "v1"))
    peak = float(np.asarray(state.x1).max())
    figure, (top, bottom) = panels(2, 4.2, sharex=True)
    for axes in (top, bottom):
        for hop in run.hops[-shown:]:
            label = "stance" if hop is first else ""
            axes.axvspan(hop.touchdown_time - t[0], hop.takeoff_time - t[0], zorder=0, label=label, **STANCE)
    top.plot(t - t[0], 100.0 * np.asarray(state.x1), color=BLUE, label="actuator $x_1$")
    top.plot(takeoffs - t[0], 100.0 * x1, "o", color=ORANGE, markersize=4.5, label="take-off, still compressing")
    top.set_ylabel("actuator $x_1$ [cm]")
    legend(top)
    bottom.plot(t - t[0], 100.0 * np.asarray(state.x2), color=BLUE)
    bottom.set(xlabel="time [s]", ylabel="body $x_2$ [cm]")
    ours = (
        f"the last {shown} of {len(run.hops)} simulated hops at {robot.u_max:g} {volts(robot)}, settled at an apex "
        f"of {cm(run.hops[-1].apex)}. At take-off x1 is {cm(float(x1[-1]))} and still compresses at {v1[-1]:.2f} "
        f"m/s; it reaches {cm(peak)} only in flight"
    )
    return figure, ours, {"t": t, "x1": state.x1, "x2": state.x2, "takeoff_x1": x1, "takeoff_v1": v1, "peak": peak}


def friction_threshold(robot: Robot) -> Drawn:
    """Fig. 9: the current rises slowly until the actuator moves; (5) then gives f1, which is that at rest."""
    at_rest = robot.f1 + robot.f1_excess
    seconds, onset_expected = 6.0, (at_rest * robot.m_eff + robot.m_s * robot.g) / abs(robot.gamma2)
    rate = round(1.6 * onset_expected / seconds, 3)
    # On a rig: level, so that nothing weighs on the spring, which is as good as unloaded; and standing, as built.
    steps = [(float(t), float(rate * t)) for t in np.linspace(0.0, seconds, 1201)[:-1]]
    loose = solve_stance(replace(robot, g=0.0), v2=0.0, x2=robot.L0 + robot.c - 1e-6, u=steps, horizon=seconds)
    stands = solve_stance(robot, v2=0.0, x2=standing(robot), u=steps, horizon=seconds)
    runs = {"spring unloaded": loose, "standing": stands}
    onset = {name: moves(stance, rate) for name, stance in runs.items()}
    found = onset["spring unloaded"] * abs(robot.gamma2) / robot.m_eff
    looks = {"spring unloaded": (BLUE, "-"), "standing": (GREEN, "--")}
    draw = stream(9)
    data: dict[str, object] = {"onset": onset, "f1": found}
    figure, (top, bottom) = panels(2, 4.2, sharex=True, height_ratios=[1.0, 0.8])
    for name, stance in runs.items():
        t = np.linspace(0.0, min(seconds, stance.duration), 1201)
        x1 = np.asarray(stance.at(t).x1) + 2e-5 * draw.standard_normal(t.size)
        data |= {f"t, {name}": t, f"x1, {name}": x1}
        colour, line = looks[name]
        words = f"{name}: moves from {onset[name]:.2f} {volts(robot)} on"
        top.plot(t, 1e3 * x1, color=colour, linestyle=line, linewidth=1.0, label=words)
        bottom.axvline(onset[name] / rate, color=colour, linestyle=":", linewidth=1.0)
    top.set(ylabel="actuator $x_1$ [mm]", ylim=(-0.1, 1.0))
    legend(top)
    ramp = np.array([0.0, seconds])
    bottom.plot(ramp, rate * ramp, color=CURRENT)
    bottom.set(xlabel="time [s]", ylabel=f"current $u$ [{volts(robot)}]")
    ours = (
        f"a ramp of {rate:g} {volts(robot)}/s in steps of 5 ms, noise of 0.02 mm on x1. With the spring unloaded x1 "
        f"moves from {onset['spring unloaded']:.3f} {volts(robot)} on, and (5), taken in magnitudes, gives f1 = "
        f"{found:.3f} m/s^2; at rest the robot has {at_rest:g}. Standing it moves from {onset['standing']:.3f} "
        f"{volts(robot)} on, as the weight rests on the spring: read by (5), that would be f1 = "
        f"{onset['standing'] * abs(robot.gamma2) / robot.m_eff:.2f} m/s^2"
    )
    return figure, ours, data


def moves(stance: Stance, rate: float) -> float:
    """The current [A] of a ramp at which the actuator begins to slip."""
    return rate * next(event.time for event in stance.events if event.kind == "x1_slips")


# ---- the schematic: actuator, spring and body, with their coordinates, forces and signs ----

LIFT, DOWN, PLATE, BODY = 0.10, 0.06, 0.03, 0.16
"""[m] of the drawing: x1, the spring's compression, thickness of the plate on the spring, height of the body."""
ROTOR = 0.055
"""[m] of the drawing: its radius."""


def schematic(robot: Robot) -> Drawn:
    """Fig. 1: what x1, x2, L0, c, the spring force and the signs are; gravity, friction; the rotor, whose inertia behind
    its gear is the mass of the actuator.
    """
    figure, axes = panels(2, 5.7)
    hopper(axes[0], 0.0, 0.0, "unloaded:\n$F = 0$, $x_1 = 0$, $x_2 = L_0 + c$")
    hopper(axes[1], LIFT, DOWN, "in stance:\n$F = k\\,(x_1 - x_2 + L_0 + c) > 0$")
    sign = "a positive input lifts the body" if robot.gamma2 < 0.0 else "a positive input lowers the body"
    ours = (
        f"the foot stands on the ground and carries the spring, k = {robot.k:g} N/m. The actuator moves the spring's "
        f"upper end away from the body by x1, {cm(robot.x1_min)} to {cm(robot.x1_max)}. Its mass m_eff = "
        f"{robot.m_eff:g} kg is the rotor's inertia behind the gear, so nothing of it weighs. x2 is the height of the "
        f"body, m_s = {robot.m_s:g} kg, over the ground, L0 + c = {cm(robot.L0 + robot.c)} unloaded. The motor pushes "
        f"the actuator by -gamma2 u along x1: with gamma2 = {robot.gamma2:g} {sign}. The spring pushes body and "
        "actuator by F, gravity pulls the body by m_s g. Friction R1 and R2, viscous and dry, acts against v1 and v2; "
        "drawn where the actuator extends and the body moves up. The leg takes off where F = 0"
    )
    return figure, ours, {"drawn": {"x1": LIFT, "compression": DOWN}, "robot": robot}


def hopper(axes: Axes, x1: float, compression: float, title: str) -> None:
    """The hopper on the ground, displaced: x1 more between plate and body, a shorter spring."""
    free = 0.40
    top = free + x1 - compression
    plate = top - 0.12 - x1
    turns = 0.045 * np.array([0.0, 0.0, *(1.0 if n % 2 else -1.0 for n in range(12)), 0.0, 0.0])
    axes.plot(turns, np.linspace(0.0, plate, turns.size), color=BLACK, linewidth=1.3)
    axes.plot([-0.05, 0.05], [0.0, 0.0], color=BLACK, linewidth=3.5, solid_capstyle="butt")
    axes.plot([0.0, 0.0], [plate, top + BODY / 2.0], color=GREEN, linewidth=3.0, zorder=4)
    axes.add_patch(Rectangle((-0.09, plate), 0.18, PLATE, facecolor=ORANGE, edgecolor=BLACK, zorder=3))
    axes.add_patch(Rectangle((-0.17, top), 0.34, BODY, facecolor=BLUE, edgecolor=BLACK, zorder=3))
    axes.add_patch(Circle((ROTOR, top + BODY / 2.0), ROTOR, facecolor=ORANGE, edgecolor=BLACK, zorder=3))
    axes.text(ROTOR + 0.004, top + BODY / 2.0, "$m_{eff}$", ha="center", va="center", zorder=5, fontsize="small")
    axes.text(-0.095, top + BODY / 2.0, "$m_s$", ha="center", va="center", color="white", zorder=4)
    axes.text(0.07, plate / 2.0, "$k$", va="center")
    axes.fill_between([-0.45, 0.45], -0.03, 0.0, facecolor="#DDDDDD", edgecolor=GREY, hatch="////", linewidth=0.0)
    arrow(axes, -0.27, 0.0, top, "$x_2$", BLACK)
    if x1:
        axes.plot([-0.13, 0.27], [plate + x1, plate + x1], color=GREY, linestyle=":", linewidth=1.0)
        arrow(axes, 0.25, plate + x1, plate, "$x_1$", GREEN)
        arrow(axes, 0.12, top + BODY, top + BODY + 0.09, "$F$", MAGENTA)
        arrow(axes, -0.14, plate - 0.10, plate, "$F$", MAGENTA)
        arrow(axes, 0.13, plate, plate - 0.10, "$-\\gamma_2 u$", ORANGE)
        arrow(axes, -0.12, plate + PLATE, plate + 0.09 + PLATE, "$R_1$", GREY)
        arrow(axes, 0.22, top + BODY, top + BODY - 0.12, "$m_s g$", BLACK)
        arrow(axes, 0.34, top + BODY, top + BODY - 0.12, "$R_2$", GREY)
    else:
        arrow(axes, 0.27, 0.0, free, "$L_0 + c$", GREY)
    axes.set(xlim=(-0.45, 0.55), ylim=(-0.03, 0.72), aspect="equal", xticks=[], yticks=[])
    axes.spines[:].set_visible(False)
    axes.set_title(title, fontsize="small")


def arrow(axes: Axes, x: float, low: float, high: float, words: str, colour: str) -> None:
    """An arrow upwards, or downwards, with a word beside it."""
    how = {"arrowstyle": "-|>", "color": colour, "shrinkA": 0.0, "shrinkB": 0.0, "linewidth": 1.2}
    axes.annotate("", (x, high), (x, low), arrowprops=how)
    axes.text(x + 0.015, (low + high) / 2.0, words, color=colour, va="center")


# ---- touchdown from a noisy Hall signal: how late and how wrong it is, and what that costs ----

NOISE = 0.12
"""Standard deviation, in units of the signal's step."""


def hall_sensor(robot: Robot) -> Drawn:
    """Fig. 15: a signal with noise, what a detector makes of it, and its delay and false alarms over the noise."""
    detector, height = TouchdownDetector(high=0.6, low=0.4, count=3, dt=1e-3), 0.2
    run = simulate(robot, flat(3), FeedForward(height), height=height)
    completed(run)
    rate = 1.0 / detector.dt
    t = np.arange(int(run.duration * rate) + 1) / rate
    in_contact = np.any([(t >= hop.touchdown_time) & (t < hop.takeoff_time) for hop in run.hops], axis=0)
    signal = in_contact + NOISE * stream(15).standard_normal(t.size)
    detected = np.array([event.time for event in detector.detect(signal.tolist()) if event.kind == "touchdown"])
    true = np.array([hop.touchdown_time for hop in run.hops])
    noise = np.linspace(0.10, 0.40, 31)
    mean = np.array([detector.mean_delay(each) for each in noise])
    drawn = np.array([float(detector.simulated_delays(each, trials=2000, seed=15).mean()) for each in noise[::4]])
    alarms = np.array([detector.false_alarm_rate(each) for each in noise])
    delays = np.linspace(0.0, 0.02, 21)
    first = run.hops[0]
    cost = np.array([delayed_apex(robot, each, v2=first.touchdown.v2, u=first.u)[1] for each in delays])
    figure, panes = panels(4, 8.0)
    places = dict(zip("ABCD", panes, strict=True))
    draw_signal(places["A"], run, t, signal, detector, detected)
    places["B"].plot(noise, 1e3 * mean, color=BLUE, label="closed form")
    places["B"].plot(noise[::4], 1e3 * drawn, "o", color=ORANGE, markersize=3.5, label="drawn")
    places["B"].set_ylabel("mean delay [ms]")
    places["B"].legend(loc="upper left")
    places["C"].semilogy(noise, alarms, color=BLUE)
    places["C"].set(ylabel="false alarms [1/s]", ylim=(1e-12, 1e2))
    places["B"].margins(x=0.03)
    for name in "BC":
        places[name].set(xlabel="noise [of the step]", xticks=[0.1, 0.2, 0.3, 0.4])
    places["D"].plot(1e3 * delays, 1e3 * cost, color=BLUE)
    places["D"].set(xlabel="delay [ms]", ylabel="apex error [mm]")
    late = detected[: true.size] - true
    ours = (
        f"a synthetic signal of {true.size} hops at 1 kHz, noise {NOISE:g} of the step, through hysteresis "
        f"({detector.low:g}, {detector.high:g}) and {detector.count} samples in a row. {detected.size} touchdowns "
        f"detected for {true.size}, {1e3 * late.mean():.1f} ms late on average; expected "
        f"{1e3 * detector.mean_delay(NOISE):.1f} ms and {detector.false_alarm_rate(NOISE):.1e} false alarms a "
        f"second. At noise {noise[-1]:g} it would be {1e3 * mean[-1]:.1f} ms and {alarms[-1]:.1f} a second. A "
        f"current that comes {1e3 * delays[5]:.0f} ms late costs {mm(-cost[5])} of a {100 * first.apex:.0f} cm apex"
    )
    data = {"t": t, "signal": signal, "detected": detected, "true": true, "noise": noise, "mean delay": mean,
            "drawn": drawn, "false alarms": alarms, "delays": delays, "cost": cost}  # fmt: skip
    return figure, ours, data


def draw_signal(axes: Axes, run: Run, t: Array, signal: Array, detector: TouchdownDetector, detected: Array) -> None:
    shade_stances(axes, run, "stance")
    axes.plot(t, signal, color=BLUE, linewidth=0.6, label="signal")
    axes.axhline(detector.high, color=GREEN, linestyle="--", linewidth=1.0, label="touch begins above")
    axes.axhline(detector.low, color=MAGENTA, linestyle=":", linewidth=1.2, label="ends below")
    axes.plot(detected, np.full(detected.size, detector.high), "v", color=ORANGE, markersize=6.0, markeredgecolor=BLACK,
              markeredgewidth=0.5, label="touchdown detected")  # fmt: skip
    axes.set(xlabel="time [s]", ylabel="signal [of its step]")
    legend(axes)
