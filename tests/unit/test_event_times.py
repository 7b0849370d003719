"""What is read at the time of an event holds after it: a stop has taken the velocity, a step of the current has come,
an impact has cost its energy.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import hopform
import hopform.hopping

HOPPER = hopform.load_robot("hopper_c")
STROKE = replace(HOPPER, x1_max=0.02)
"""A hopper whose actuator meets both its stops at some speed."""
FREE = replace(STROKE, b1=20.0, b2=0.5, f1=0.0)
STEPS = [(0.0, 3.0), (0.06, -3.0), (0.1, 2.0)]


@cache
def stances(dtype=np.float64):
    """Stances with stops, steps, sticking, and an actuator that oscillates."""
    how = {"dtype": dtype}
    return (
        hopform.solve_stance(STROKE, v2=-1.93, u=3.0, **how),
        hopform.solve_stance(STROKE, v2=-1.93, x1=0.01, v1=-0.8, u=STEPS, **how),
        hopform.solve_stance(FREE, v2=-1.5, x1=0.01, v1=0.5, u=STEPS, **how),
        hopform.solve_stance(HOPPER, v2=-0.3, u=1.2, **how),
        hopform.solve_stance(replace(HOPPER, b2=80.0, k=4000.0), v2=-2.5, u=0.2, horizon=1.0, **how),
    )


@cache
def flights():
    """Flights whose actuator meets a stop, sticks, and leaves the limit of the current."""
    return tuple(
        hopform.solve_flight(STROKE, v2=1.9, gains=gains, **start)
        for gains, start in [
            ((0.0, 0.0), {"x1": 0.01, "v1": -0.9}),
            ((0.0, 0.0), {"x1": 0.01, "v1": 0.9}),
            ((4e3, 100.0), {"x1": 0.018, "v1": -0.5}),
            (None, {"x1": 0.015, "v1": 0.2}),
        ]
    )


def starts(motion):
    """Times at which a phase starts that lasts, but for the first."""
    return sorted({phase.start for phase in motion.phases if phase.end > phase.start > 0.0})


def readings(motion, t):
    """All that can be read at some times, by name."""
    found = {**motion.at(t)._asdict(), **motion.energy(t)._asdict(), **motion.ledger(t)._asdict()}
    found |= {"u": motion.current(t), "compression": motion.compression(t)}
    if isinstance(motion, hopform.Flight):
        return found | {"foot": motion.foot(t)}
    states, rows = motion._solved.tangents(np.atleast_1d(t))
    found |= {f"{name} with its tangents": column.reshape(np.shape(t)) for name, column in states._asdict().items()}
    return found | {f"tangent {n}": each.reshape(np.shape(t)) for n, each in enumerate(rows.reshape(len(rows), -1).T)}


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_a_state_at_the_start_of_a_phase_is_that_with_which_it_starts(dtype):
    """To the last bit: one by one, at times of an array, and on a grid."""
    for stance in stances(dtype):
        for phase in stance.phases:
            if phase.start not in starts(stance):
                continue
            assert stance.at(phase.start) == phase.state
            assert [column.tolist() for column in stance.at([0.0, phase.start])] == [
                [first, then] for first, then in zip(stance.phases[0].state, phase.state, strict=True)
            ]
            t, states = stance.grid(dt=phase.start)
            assert t[1] == phase.start
            assert [float(column[1]) for column in states] == list(phase.state)


@pytest.mark.parametrize("of", [stances, flights])
def test_what_is_read_at_an_event_is_its_limit_from_behind(of):
    jumps = set()
    for motion in of():
        for time in starts(motion):
            before, after = (np.nextafter(time, end) for end in (0.0, np.inf))
            earlier, later = (readings(motion, float(t)) for t in (before, after))
            together = {name: column[1] for name, column in readings(motion, np.array([before, time, after])).items()}
            for found in (readings(motion, time), together):
                for name, value in later.items():
                    assert found[name] == pytest.approx(value, rel=1e-7, abs=1e-9), (name, time)
            jumps |= {name for name in later if abs(earlier[name] - later[name]) > 1e-3}
    expected = {"v1", "stop_loss", "total"} | ({"u", "v1 with its tangents"} if of is stances else {"u"})
    assert jumps >= expected


def test_a_touchdown_is_read_after_its_impact():
    run = hopform.hopping.simulate(HOPPER, [0.0, 0.02, -0.01], 3.0, height=0.2)
    for hop in run.hops:
        t = hop.touchdown_time
        assert run.at(t).v2 == run.at([t]).v2[0] == hop.touchdown.v2
        assert hop.at(hop.flight.duration).v2 == hop.touchdown.v2
        assert run.at(np.nextafter(t, 0.0)).v2 < 1.02 * hop.touchdown.v2
        assert run.current(t) == 3.0 != run.current(np.nextafter(t, 0.0))
