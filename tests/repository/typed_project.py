"""A program of another project that keeps to mypy --strict: what is read at one time is a float, at many an array."""

from typing import assert_type

import numpy as np
from numpy.typing import NDArray

import hopform
import hopform.hopping
from hopform import Energy, Ledger, State
from hopform.hopping import controllers

robot = hopform.load_robot("hopper_c")
stance = hopform.solve_stance(robot, v2=-1.93, u=2.0)
assert_type(stance.at(0.05), State[float])
assert_type(stance.at(0.05).x2, float)
assert_type(stance.at(np.float64(0.05)).x2, float)
assert_type(stance.at([0.0, 0.05]).x2, NDArray[np.floating])
assert_type(stance.at(np.linspace(0.0, 0.05, 3)).v1, NDArray[np.floating])
assert_type(stance.grid(3)[1].x2, NDArray[np.floating])
assert_type(stance.end, State[float])
assert_type(stance.phases[0].state.x1, float)
assert_type(stance.takeoff, State[float] | None)
assert_type(stance.contact_force(0.05), float)
assert_type(stance.energy(0.05).body, float)
assert_type(stance.energy([0.0, 0.05]), Energy[NDArray[np.floating]])
assert_type(stance.ledger(0.05), Ledger[float])
assert_type(stance.ledger(np.linspace(0.0, 0.05, 3)).motor_work, NDArray[np.floating])

flight = stance.fly()
assert_type(flight.at(0.1).x1, float)
assert_type(flight.at(np.array([0.1])).x1, NDArray[np.floating])
assert_type(flight.ledger(0.1).motor_work, float)


def law(t: float, state: State) -> float:
    """A state without a parameter is that of one instant."""
    return 2.0 - 10.0 * state.x1 if t < 0.02 else 0.0


run = hopform.hopping.simulate(robot, [0.0, 0.01], lambda _: controllers.Sampled(1e-3, law), height=0.2)
assert_type(run.at(0.3).x2, float)
assert_type(run.at(run.times(5)).x2, NDArray[np.float64])
assert_type(run.hops[0].at(0.3).x2, float)
print(f"{stance.at(0.05).x2:.6f}")
