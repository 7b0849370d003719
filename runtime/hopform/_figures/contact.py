"""Touchdown from a noisy Hall signal (Fig. 15): what it looks like, how late and how wrong it is, and what that
costs."""

# pyright: reportUnknownMemberType=false

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hopform._figures.picture import Array, Drawn, completed, legend, mm, sampled_length, scale
from hopform._figures.plots import BLACK, BLUE, GREEN, LOOK, MAGENTA, ORANGE, shade_stances
from hopform._hopping.run import Run, simulate
from hopform._hopping.touchdown import TouchdownDetector, delayed_apex
from hopform._robots import Robot
from hopform.controllers import FeedForward
from hopform.terrain import flat

NOISE = 0.12
"""Standard deviation, in units of the signal's step."""


def hall_sensor(robot: Robot) -> Drawn:
    """Fig. 15: a signal with noise, what a detector makes of it, and its delay and false alarms over the noise."""
    detector, height = TouchdownDetector(high=0.6, low=0.4, count=3, dt=1e-3), 0.2 * scale(robot)
    run = simulate(robot, flat(3), FeedForward(height), height=height)
    completed(run)
    t = sampled_length(run.duration, 1.0 / detector.dt)
    signal = in_contact(run, t) + NOISE * np.random.default_rng(15).standard_normal(t.size)
    events = detector.detect(signal.tolist())
    detected = np.array([event.time for event in events if event.kind == "touchdown"])
    true = np.array([hop.touchdown_time for hop in run.hops])
    noise = np.linspace(0.10, 0.40, 31)
    mean = np.array([detector.mean_delay(each) for each in noise])
    drawn = np.array([float(detector.simulated_delays(each, trials=2000, seed=15).mean()) for each in noise[::4]])
    alarms = np.array([detector.false_alarm_rate(each) for each in noise])
    delays = np.linspace(0.0, 0.02, 21)
    first = run.hops[0]
    cost = np.array([delayed_apex(robot, each, v2=first.touchdown.v2, u=first.u)[1] for each in delays])
    width = LOOK.get().width
    figure = Figure(figsize=(width, 4.4 if width > 5.0 else 8.0), layout="constrained")
    places = figure.subplot_mosaic("AAA;BCD" if width > 5.0 else "A;B;C;D")
    draw_signal(places["A"], run, t, signal, detector, detected)
    places["B"].plot(noise, 1e3 * mean, color=BLUE, label="closed form")
    places["B"].plot(noise[::4], 1e3 * drawn, "o", color=ORANGE, markersize=3.5, label="drawn")
    places["B"].set_ylabel("mean delay [ms]")
    places["B"].legend(loc="upper left")
    places["C"].semilogy(noise, alarms, color=BLUE)
    places["C"].set(ylabel="false alarms [1/s]", ylim=(1e-12, 1e2))
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


def in_contact(run: Run, t: Array) -> Array:
    """1 in stance, 0 in flight."""
    found = np.zeros_like(t)
    for hop in run.hops:
        found[(t >= hop.touchdown_time) & (t < hop.takeoff_time)] = 1.0
    return found


def draw_signal(axes: Axes, run: Run, t: Array, signal: Array, detector: TouchdownDetector, detected: Array) -> None:
    shade_stances(axes, run, "stance")
    axes.plot(t, signal, color=BLUE, linewidth=0.6, label="signal")
    axes.axhline(detector.high, color=GREEN, linestyle="--", linewidth=1.0, label="touch begins above")
    axes.axhline(detector.low, color=MAGENTA, linestyle=":", linewidth=1.2, label="ends below")
    axes.plot(detected, np.full(detected.size, detector.high), "v", color=ORANGE, markersize=6.0, markeredgecolor=BLACK,
              markeredgewidth=0.5, label="touchdown detected")  # fmt: skip
    axes.set(xlabel="time [s]", ylabel="Hall signal [of its step]")
    legend(axes, 5)
