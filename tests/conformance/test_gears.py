"""Geared and roped coordinates: a joint behind a gear, a weight on a drum, two levers that turn against each other.

In the coordinates of the file, against equations of motion that are written here by hand, against matrix exponentials of
these, and against the integrator, which shares nothing with the solver.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import sympy as sp
from mpmath import mp

from hopform.model import derive
from tests import needs
from tests.conformance.test_zoo import that_of_the_integrator
from tests.conformance.zoo import Case, Draw, Scales, case
from tests.derived import built, loaded, model_file, solver_of

FORCES = {
    "geared_sea": (
        "J", "k_t*i - (k*(theta/N - q) + d*(theta_dot/N - q_dot))/N - b*theta_dot - F*side_1",
        "I", "k*(theta/N - q) + d*(theta_dot/N - q_dot) + load - F_q*side_2",
    ),
    "rope_drum": (
        "J", "k_t*i - r*(k*(r*phi - y + x_0) + k/4*(r*phi - y) + d*(r*phi_dot - y_dot)) - b*phi_dot - F*side_1",
        "m", "k*(r*phi - y + x_0) + k/4*(r*phi - y) + d*(r*phi_dot - y_dot) - m*g",
    ),
    "lever": (
        "J + m*p**2", "p*P - a*k*(a*alpha + s*beta) - d*p**2*alpha_dot - F*p*side_1",
        "I", "-s*k*(a*alpha + s*beta) - b*beta_dot - (3*F_2*side_2 - F_2)/2",
    ),
}  # fmt: skip
"""Of each coordinate the inertia and the force; friction with the sign of the velocity."""
STARTS = {
    "geared_sea": ("theta", "theta_dot", "q", "q_dot"), "rope_drum": ("phi", "phi_dot", "y", "y_dot"),
    "lever": ("alpha", "alpha_dot", "beta", "beta_dot"),
}  # fmt: skip
RATIO = {"geared_sea": "N", "rope_drum": "r", "lever": "a"}
STOPS = ("theta_min", "theta_max", "end", "i_max")
"""Parameters that no motion reads which meets none of them."""
INPUT = {"geared_sea": "i", "rope_drum": "i", "lever": "P"}


def plain(value: sp.Expr) -> sp.Expr:
    return value.xreplace({symbol: sp.Symbol(symbol.name) for symbol in value.free_symbols})


def accelerations(name: str) -> list[sp.Expr]:
    """By hand, in symbols by name."""
    texts = FORCES[name]
    symbols = {each: sp.Symbol(each) for text in texts for each in map(str, sp.sympify(text, _CLASH).free_symbols)}
    inertia_1, force_1, inertia_2, force_2 = (sp.sympify(text, symbols) for text in texts)
    return [force_1 / inertia_1, force_2 / inertia_2]


_CLASH = {each: sp.Symbol(each) for each in ("N", "I", "beta", "E", "S", "Q", "O")}
"""Names that sympy has another meaning for."""


@pytest.mark.parametrize("name", needs.the_first([*FORCES]))
def test_the_equations_of_motion_are_those_in_the_coordinates_of_the_file(name):
    found = derive(model_file(name)).equations_of_motion
    for number, acceleration in enumerate(accelerations(name), 1):
        assert sp.cancel(plain(found[f"acc_{number}"]) - acceleration) == 0


def numbers(name: str, draw: Draw) -> dict[str, mp.mpf]:
    """A robot, an input and a state in motion that keeps its signs for some time."""
    sizes = Scales(draw)
    found: dict[str, Any] = case(model_file(name), draw, sizes).robot
    found = {key: value for key, value in found.items() if key not in STOPS}
    length, time = 0.1, sizes.time
    places = dict(zip(STARTS[name], (0.3, 2.0 / time, 0.5 * length, 3.0 / time), strict=True))
    found |= places | {INPUT[name]: draw.uniform(-0.1, 0.1), "side_1": 1, "side_2": 1, "t": 0.02 * time}
    return {key: mp.mpf(repr(float(value))) for key, value in found.items()}


def linear(name: str, at: dict[str, mp.mpf]) -> mp.matrix:
    """The matrix of the state and 1, by the accelerations that are written here."""
    state = [sp.Symbol(each) for each in STARTS[name]]
    first, second = accelerations(name)
    rates = [state[1], first, state[3], second, sp.Integer(0)]
    known = {sp.Symbol(key): value for key, value in at.items() if key not in STARTS[name]}
    columns = [
        [sp.diff(rate, each).subs(known) for each in state] + [rate.subs(dict.fromkeys(state, 0)).subs(known)]
        for rate in rates
    ]
    return mp.matrix([[mp.mpf(str(sp.N(each, mp.dps))) for each in row] for row in columns])


def moved(name: str, at: dict[str, mp.mpf], t: Any) -> list[mp.mpf]:
    """The state after t, from that in `at`."""
    start = mp.matrix([*(at[each] for each in STARTS[name]), 1])
    return list(mp.expm(linear(name, at) * t) * start)[:4]


@pytest.mark.parametrize("name", needs.the_first([*FORCES]))
def test_the_formulas_are_the_matrix_exponential_and_their_works_the_energy(name):
    """At 30 digits: the state at a time, and that the works of all forces are what the energy gains."""
    of, draw = derive(model_file(name)), Draw(f"{name} formulas")
    with mp.workdps(45):
        for _ in range(2):
            at = numbers(name, draw)
            start = {(f"{key}_0_" if f"{key}_0" in at else f"{key}_0"): at[key] for key in STARTS[name]}
            given = {key: sp.Rational(str(value)) for key, value in (at | start).items()}
            later = [mp.mpf(str(of.value(f"{each}_t", given, 32))) for each in STARTS[name]]
            for found, exact in zip(later, moved(name, at, at["t"]), strict=True):
                assert abs(found - exact) <= mp.mpf(10) ** -29 * (abs(exact) + 1)
            then = given | {key: sp.Rational(str(value)) for key, value in zip(STARTS[name], later, strict=True)}
            gained = of.value("total", then, 32) - of.value("total", given, 32)
            works = [of.value(each, given, 32) for each in of.works if each.endswith("_work")]
            assert abs(gained - sum(works)) <= sp.Rational(1, 10**27) * sum(map(abs, works))


# ---- the library ----


def cases(name: str, seed: int, count: int, stiffest: float = 3e2) -> Iterator[Case]:
    draw = Draw(f"{name} {seed}")
    while count:
        found = case(model_file(name), draw, Scales(draw))
        if found.fastest * found.horizon < stiffest:
            count -= 1
            yield found


@needs.library
@pytest.mark.parametrize(("name", "count"), needs.sliced(*((name, 50) for name in FORCES)))
def test_a_motion_is_that_of_the_integrator(store, name, count):
    """Events, ending, times and states; energy and ledger add up."""
    solver, seen = solver_of(store, name), set()
    for each in cases(name, 1, count):
        truth, _, _ = that_of_the_integrator(solver, each)
        seen.update(truth.kinds, [truth.status])
        motion = solver.solve_motion(solver.Robot(**each.robot), start=each.start, u=each.u, horizon=each.horizon)
        works = np.subtract(motion.ledger(motion.duration), motion.ledger(0.0))  # a stop may take some at the start
        gained = motion.total_energy(motion.duration) - motion.total_energy(0.0)
        scale = sum(map(abs, works)) + abs(motion.total_energy(0.0)) + abs(motion.total_energy(motion.duration))
        assert abs(gained - sum(works)) <= 1e-10 * scale, each
    assert len(seen) > 5 or count < 20


@needs.library
@pytest.mark.sliced
@pytest.mark.parametrize("name", FORCES)
def test_the_readable_solver_has_the_same_motions(store, name):
    solver = solver_of(store, name)
    package = loaded(built(store, name), f"{name}_readable")
    for each in cases(name, 2, 12, 1e2):
        motion = solver.solve_motion(solver.Robot(**each.robot), start=each.start, u=each.u, horizon=each.horizon)
        other = package.solve(package.Robot(**each.robot), each.start, each.u, each.horizon)
        assert [event.kind for event in other.events] == [event.kind for event in motion.events]
        for key in each.start:
            assert getattr(other.end, key) == pytest.approx(getattr(motion.end, key), rel=1e-7, abs=1e-9)


@needs.library
@pytest.mark.sliced
@pytest.mark.parametrize("name", FORCES)
def test_the_derivatives_within_a_phase_are_those_of_the_matrix_exponential(store, name):
    """At 50 digits by central differences, by the state at the start and by every parameter, that of the gear too."""
    solver, draw, seen = solver_of(store, name), Draw(f"{name} derivatives"), 0
    with mp.workdps(50):
        parameters = [each.name for each in derive(model_file(name)).model.parameters]
        while seen < 4:
            at = numbers(name, draw)
            robot = solver.Robot(**{key: float(at[key]) for key in parameters if key in at})
            start = {key: float(at[key]) for key in STARTS[name]}
            motion = solver.solve_motion(robot, start=start, u=float(at[INPUT[name]]), horizon=float(at["t"]))
            if motion.events or motion.status != "horizon":
                continue
            seen += 1
            found = motion.derivatives(motion.duration)
            for column in [*start, *(key for key in at if key in found.columns and key not in start)]:
                step = mp.mpf(10) ** -20 * (abs(at[column]) + mp.mpf(10) ** -3)
                above, below = (moved(name, at | {column: at[column] + sign * step}, at["t"]) for sign in (1, -1))
                for row, high, low in zip(start, above, below, strict=True):
                    exact = (high - low) / (2 * step)
                    size = max(abs(exact), abs(at[row]) / (abs(at[column]) + mp.mpf(10) ** -3))
                    assert abs(float(found[row, column]) - exact) <= 1e-11 * size, (row, column, at)


@needs.library
@pytest.mark.sliced
@pytest.mark.parametrize("name", FORCES)
def test_the_derivatives_through_events_are_differences_of_motions(store, name):
    """By Richardson's rule, at the ending and before it, of one motion and of a batch; where the events stay the same."""
    solver, compared = solver_of(store, name), 0
    for each in cases(name, 3, 12, 1e2):
        how = {"u": each.u, "horizon": each.horizon}
        motion = solver.solve_motion(solver.Robot(**each.robot), start=each.start, **how)
        found, column = motion.sensitivities, RATIO[name]
        if not motion.events or np.isnan(found.matrix).any():
            continue
        if isinstance(each.u, float):
            many = solver.solve_motions(
                solver.Robot(**each.robot), start={k: [v] for k, v in each.start.items()}, **how, sensitivities=True
            )
            np.testing.assert_array_equal(many.sensitivities.matrix[0], found.matrix)
        value, slopes = each.robot[column], []
        for step in (1e-5, 2e-5):
            ends = [
                solver.solve_motion(
                    solver.Robot(**each.robot | {column: value * (1 + sign * step)}), start=each.start, **how
                )
                for sign in (1, -1)
            ]
            if any([event.kind for event in end.events] != [event.kind for event in motion.events] for end in ends):
                break
            states = [np.array([end.duration, *(getattr(end.end, key) for key in each.start)]) for end in ends]
            slopes.append((states[0] - states[1]) / (2 * step * value))
        if len(slopes) < 2:
            continue
        compared += 1
        expected = (4 * slopes[0] - slopes[1]) / 3
        largest = max(abs(getattr(motion.end, key)) for key in each.start) / value
        for row, slope in zip(("T", *each.start), expected, strict=True):
            assert found[row, column] == pytest.approx(slope, rel=1e-4, abs=1e-6 * largest + 1e-9), (row, each)
    assert compared >= 4


@needs.library
@pytest.mark.sliced
def test_a_fit_finds_the_ratio_of_a_gear(store, tmp_path):
    """From the angles of rotor and link: their scales apart say the ratio."""
    from hopform import identify

    solver = solver_of(store, "geared_sea")
    robot = solver.load_robot("geared_sea")
    steps = [(0.0, 2.0), (0.3, -2.0), (0.6, 2.0), (0.9, -1.0)]
    motion = solver.solve_motion(robot, start={"theta": 0.5}, u=steps, horizon=1.2)
    t = 3e-3 * np.arange(401)  # the steps of the drive are at samples
    drive = np.array([next(u for begin, u in reversed(steps) if begin <= each + 1e-9) for each in t])
    at, noise = motion.at(np.minimum(t, 1.2)), np.random.default_rng(1)
    columns = [t, at.theta + 5e-4 * noise.normal(size=t.size), at.q + 1e-5 * noise.normal(size=t.size), drive]
    file = tmp_path / "gear.csv"
    np.savetxt(file, np.column_stack(columns), delimiter=",", header="time_s,theta_rad,q_rad,i_A", comments="")
    fit = identify.fit(solver, file, fitted=["N", "F"], start={"N": 40.0})
    assert fit.values["N"] == pytest.approx(50.0, rel=1e-3) and fit.values["F"] == pytest.approx(0.004, rel=1e-2)


def test_units_of_what_turns_and_what_moves_along_a_line_are_their_own():
    """Of a drum and its weight: each quantity in the unit of its coordinate, rates of one per the other in both."""
    of = derive(model_file("rope_drum"))
    units = {each.name: each.quantity.unit for each in of.formulas}
    expected = {
        "acc_1": "rad/s^2", "acc_2": "m/s^2", "a1_y": "rad/m/s^2", "a1_v1": "1/s", "a1_v2": "rad/m/s", "a2_v1": "m/rad/s",
        "force_1": "N m", "force_2": "N", "C_1": "rad/s^2", "C_2": "m/s^2", "y_t": "m", "phi_dot_t": "rad/s", "y_0_": "m",
        "int_phi_dot_y_dot": "rad m/s", "phi_upper_stop": "rad", "H3_hat": "rad/s^2", "H3": "m/s^2", "total": "J",
    }  # fmt: skip
    assert {name: units[name] for name in expected} == expected
