"""What the actuator can do: its step response (Fig. 2), its stroke in steady hopping (Fig. 3), its dry friction
(Fig. 9)."""

# pyright: reportUnknownMemberType=false

from dataclasses import replace

import numpy as np

from hopform._errors import HopformError
from hopform._figures.picture import Drawn, cm, completed, legend, panels, scale, standing, volts
from hopform._figures.plots import BLACK, BLUE, GREEN, ORANGE, STANCE
from hopform._hopping.run import simulate
from hopform._robots import Robot
from hopform._stance import Stance, solve_stance
from hopform.terrain import flat


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
    figure, (top, middle, bottom) = panels(3, 4.0, sharex=True, height_ratios=[1.0, 1.0, 0.6])
    top.plot(1e3 * t, 100.0 * x1, color=BLUE)
    top.set_ylabel("actuator $x_1$ [cm]")
    middle.plot(1e3 * t, v1, color=BLUE, label=r"velocity $\dot x_1$")
    middle.plot(1e3 * t, free, color=BLACK, linestyle=":", label="motor and viscous friction alone")
    middle.set_ylabel("velocity [m/s]")
    legend(middle)
    bottom.step(1e3 * t, u, color=ORANGE, where="post")
    bottom.set(xlabel="time [ms]", ylabel=f"current $u$ [{volts(robot)}]")
    ours = (
        f"simulated, {robot.u_max:g} {volts(robot)} for {1e3 * pulse:.0f} ms while it stands on its spring. After "
        f"that pulse x1 has moved {cm(float(stance.at(pulse).x1))}, its velocity is at most {v1.max():.2f} m/s, and "
        f"it comes to {cm(float(x1.max()))} "
        f"{'when the leg takes off' if stance.status == 'takeoff' else 'before it sinks back'} at "
        f"{1e3 * stance.duration:.0f} ms: neither the length of the leg nor its acceleration can be commanded at once"
    )
    data = {"t": t, "x1": x1, "v1": v1, "u": u, "free": free}
    return figure, ours, data


def compression_cycles(robot: Robot) -> Drawn:
    """Fig. 3: stances in steady hopping; the actuator still moves at take-off."""
    run, shown = simulate(robot, flat(30), robot.u_max, height=0.2 * scale(robot)), 4
    completed(run)
    first = run.hops[-shown]
    t = np.union1d(
        np.linspace(first.touchdown_time - 0.03, run.hops[-1].takeoff_time + 0.1, 1500),
        [time for hop in run.hops[-shown:] for time in (hop.touchdown_time, hop.takeoff_time)],
    )
    state = run.at(t)
    takeoffs = np.array([hop.takeoff_time for hop in run.hops[-shown:]])
    x1, v1 = (np.array([float(getattr(hop.stance.end, name)) for hop in run.hops[-shown:]]) for name in ("x1", "v1"))
    peak = float(np.asarray(state.x1).max())
    figure, (top, bottom) = panels(2, 3.4, sharex=True)
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
    data = {"t": t, "x1": state.x1, "x2": state.x2, "takeoff_x1": x1, "takeoff_v1": v1, "peak": peak}
    return figure, ours, data


def friction_threshold(robot: Robot) -> Drawn:
    """Fig. 9: the current rises slowly until the actuator moves; (5) then gives f1."""
    seconds, onset_expected = 6.0, (robot.f1 * robot.m_eff + robot.m_s * robot.g) / abs(robot.gamma2)
    rate = round(1.6 * onset_expected / seconds, 3)
    # On a rig: level, so that nothing weighs on the spring, which is as good as unloaded; and standing, as built.
    level = replace(robot, g=0.0)
    steps = [(float(t), float(rate * t)) for t in np.linspace(0.0, seconds, 1201)[:-1]]
    runs = {
        "spring unloaded": solve_stance(level, v2=0.0, x2=robot.L0 + robot.c - 1e-6, u=steps, horizon=seconds),
        "standing": solve_stance(robot, v2=0.0, x2=standing(robot), u=steps, horizon=seconds),
    }
    onset = {name: moves(stance, rate) for name, stance in runs.items()}
    found = onset["spring unloaded"] * abs(robot.gamma2) / robot.m_eff
    looks = {"spring unloaded": (BLUE, "-"), "standing": (GREEN, "--")}
    draw = np.random.default_rng(9)
    data: dict[str, object] = {"onset": onset, "f1": found}
    figure, (top, bottom) = panels(2, 3.4, sharex=True, height_ratios=[1.0, 0.8])
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
    bottom.plot(ramp, rate * ramp, color=ORANGE)
    bottom.set(xlabel="time [s]", ylabel=f"current $u$ [{volts(robot)}]")
    ours = (
        f"a ramp of {rate:g} {volts(robot)}/s in steps of 5 ms, noise of 0.02 mm on x1. With the spring unloaded x1 "
        f"moves from {onset['spring unloaded']:.3f} {volts(robot)} on, and (5), taken in magnitudes, gives f1 = "
        f"{found:.3f} m/s^2; the robot has {robot.f1:g}. Standing it moves from {onset['standing']:.3f} "
        f"{volts(robot)} on, as the weight rests on the spring: read by (5), that would be f1 = "
        f"{onset['standing'] * abs(robot.gamma2) / robot.m_eff:.2f} m/s^2"
    )
    return figure, ours, data


def moves(stance: Stance, rate: float) -> float:
    """The current [A] of a ramp at which the actuator begins to slip."""
    found = [event.time for event in stance.events if event.kind == "x1_slips"]
    if not found:
        raise HopformError("the actuator does not begin to slip under the ramp: it needs dry friction, f1 > 0")
    return rate * found[0]
