"""Fits over any solver: the parameters of a joint, a pendulum and a leg are found by their names in the model's file.

Recordings are made by time stepping that shares nothing with hopform.
"""

import dataclasses
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas
import pytest

import hopform
import hopform.identify
from hopform.identify import _models as models
from hopform.identify._recordings import parse_recording
from hopform.identify._rigs import power_of
from tests.derived import solver_of
from tests.fits import ALONE
from tests.oracle.recordings import Rig, simulate

RATE = 400.0


@pytest.fixture(scope="module")
def joint(store) -> Any:
    return solver_of(store, "joint")


def table(head: str, *columns: np.ndarray, rate: float = RATE) -> Any:
    rows = np.stack([np.arange(columns[0].size) / rate, *columns], axis=1).tolist()
    return parse_recording("\n".join([head, *(",".join(map(repr, row)) for row in rows)]), "log.csv")


def driven(seed: int) -> tuple[Rig, Any]:
    """A joint of random numbers under a random current, of which the angle is recorded with noise of 0.3 mrad."""
    rng = np.random.default_rng([31, seed])
    J, omega, zeta = (float(rng.uniform(*ends)) for ends in ((0.01, 0.1), (8.0, 25.0), (0.05, 0.4)))
    rig = Rig(J, J * omega**2, 2.0 * zeta * J * omega, float(rng.uniform(1.0, 8.0)), gamma=0.15 * J * omega**2)
    levels = np.resize([3.0, -3.0, 1.5, -1.5, 0.0], 20)[rng.permutation(20)]
    u = np.concatenate([np.zeros(40), np.repeat(levels, 40)])
    phi = simulate(rig, u, RATE) + 3e-4 * rng.standard_normal(u.size)
    return rig, table("time_s,phi_rad,i_A", phi, u)


def holds(fit: Any, **truth: float) -> list[str]:
    """What of the truth is not within 1.5 times the 95 % interval: three standard errors."""
    off = {name: abs(0.5 * (fit[name].low + fit[name].high) - value) for name, value in truth.items()}
    return [name for name, each in off.items() if not each <= 0.75 * (fit[name].high - fit[name].low)]


def test_the_parameters_of_a_joint_are_found_by_their_names(joint):
    """Of two joints that no start was given for: stiffness, friction either way and torque constant, J being known."""
    for seed in range(2):
        rig, recording = driven(seed)
        fitted = ["k", "b", "F_plus", "F_minus", "k_t"]
        fit = hopform.identify.fit(joint, recording, fitted=fitted, known={"J": rig.mass}, **ALONE)
        friction = rig.mass * rig.f
        truth = {"k": rig.k, "b": rig.b, "F_plus": friction, "F_minus": friction, "k_t": rig.gamma}
        assert holds(fit, **truth) == [], seed
        assert not fit.warnings and fit.rms == pytest.approx(3e-4, rel=0.1)
        assert {each.name for each in fit.estimates} >= {*fitted, "phi@0", "delay@0"}
        robot = fit.robot()
        assert isinstance(robot, joint.Robot) and robot.k == fit["k"].value and rig.mass == robot.J
        assert robot.fit.known == ("J",)


def test_a_parameter_may_be_as_another_one(joint):
    rig, recording = driven(5)
    known = {"J": rig.mass, "F_minus": "F_plus"}
    fit = hopform.identify.fit(joint, recording, fitted=["k", "b", "F_plus", "k_t"], known=known, **ALONE)
    assert holds(fit, k=rig.k, F_plus=rig.mass * rig.f) == []
    assert fit.base.F_minus == fit["F_plus"].value
    assert (
        "F_minus = " in (text := fit.robot().to_toml()) and text.count(f"; fitted, 95 % {fit['F_plus'].low:.6g}") == 2
    )


def test_what_is_tied_is_drawn_alike_and_a_combination_is_refused_by_name(joint):
    """Friction either way, tied, and then with a constant load, of which a decay fixes what they add up to."""
    rig = Rig(0.03, 6.0, 0.02, 4.0, start=0.5, held=0.05)
    phi = simulate(rig, np.zeros(900), RATE) + 3e-4 * np.random.default_rng(2).standard_normal(900)
    recording, known = table("time_s,phi_rad", phi), {"k": rig.k, "phi_0": 0.0}
    fit = hopform.identify.fit(
        joint, recording, fitted=["J", "b", "F_plus"], known=known | {"F_minus": "F_plus"}, **ALONE
    )
    drawn = fit.sample(500, 1)
    tied = np.array([(each.F_plus, each.F_minus) for each in drawn])
    np.testing.assert_allclose(tied[:, 0], tied[:, 1], rtol=1e-6)
    assert np.std(tied[:, 0]) == pytest.approx(fit["F_plus"].stderr, rel=0.15)
    loose = hopform.identify.fit(joint, recording, fitted=["J", "b", "F_plus", "F_minus", "load"], known=known, **ALONE)
    assert any({"F_plus", "F_minus", "load"} >= {*some} for some in loose.combinations)
    with pytest.raises(
        hopform.HopformError, match="no robots can be drawn: the recordings identify only a combination of .*load; give"
    ):
        loose.sample(3, 1)


@dataclass(frozen=True)
class Pendulum:
    """J q'' = -K sin(q) - b q' - F sign(q'), let go at an angle; more: by how much F is higher backward; softer: the share
    of sin(q) - q that is added to sin(q).
    """

    J: float = 0.0071
    K: float = 0.4807
    b: float = 0.002
    F: float = 0.012
    more: float = 0.0
    softer: float = 0.0

    def swings(self, start: float, count: int) -> np.ndarray:
        """The angle at samples, by 40 semi-implicit steps of time in each."""
        q, v, h, found = start, 0.0, 1.0 / (40.0 * RATE), np.empty(count)
        for n in range(count):
            found[n] = q
            for _ in range(40):
                z = q + 0.5 * h * v
                pull = math.sin(z) + self.softer * (math.sin(z) - z)
                w = v - h * (self.K * pull + self.b * v) / self.J
                slowed = h * (self.F + (self.more if w < 0.0 else 0.0)) / self.J
                w = 0.0 if abs(w) <= slowed else w - math.copysign(slowed, w)
                q, v = q + 0.5 * h * (v + w), w
        return found


def test_a_pendulum_that_swings_through_80_degrees_is_found_by_gravity_s_sine(joint):
    """As a spring it is not explained, and gravity's sine is named."""
    own = Pendulum()
    phi = own.swings(1.4, 800) + 1e-3 * np.random.default_rng(4).standard_normal(800)
    recording, known = table("time_s,phi_rad", phi), {"k": own.K, "k_t": 1.0, "F_minus": "F_plus"}
    how = {"fitted": ["J", "b", "F_plus"], "known": known, "compare": False, "holdout": False}
    fit = hopform.identify.fit(joint, recording, sine=True, **how)
    assert holds(fit, J=own.J, b=own.b, F_plus=own.F) == []
    assert fit["J"].high / fit["J"].low < 1.002 and fit.rms == pytest.approx(1e-3, rel=0.1)
    noise = 1e-3 * np.random.default_rng(5).standard_normal(800)
    small = table("time_s,phi_rad", own.swings(0.4, 800) + noise)
    plain = hopform.identify.fit(joint, small, **how)
    assert math.isinf(plain["J"].high) and plain["J"].value > 1.005 * own.J
    assert any("gravity's sine" in each and "--sine (in Python sine=True)" in each for each in plain.warnings)


def test_gravity_s_sine_is_no_cause_of_what_a_fit_with_it_leaves(joint):
    """A spring that softens three times as much as gravity's sine: with the sine in the fit, a second one is no cause."""
    own = Pendulum(softer=2.0)
    phi = own.swings(0.6, 640) + 1e-3 * np.random.default_rng(6).standard_normal(640)
    known, fitted = {"k": own.K, "k_t": 1.0, "F_minus": "F_plus"}, ["J", "b", "F_plus"]
    diagnosed = ALONE | {"diagnose": True}
    fit = hopform.identify.fit(joint, table("time_s,phi_rad", phi), sine=True, fitted=fitted, known=known, **diagnosed)
    names = [each.name for each in fit.diagnoses]
    assert "hardening" in names and "gravity" not in names


def test_a_pendulum_that_is_let_go_at_160_degrees_is_found_to_its_noise(joint):
    own = Pendulum()
    phi = own.swings(2.8, 1600) + 1e-3 * np.random.default_rng(4).standard_normal(1600)
    known = {"k": own.K, "k_t": 1.0, "F_minus": "F_plus"}
    fit = hopform.identify.fit(
        joint, table("time_s,phi_rad", phi), sine=True, fitted=["J", "b", "F_plus"], known=known, **ALONE
    )
    assert holds(fit, J=own.J, b=own.b, F_plus=own.F) == []
    assert fit["phi@0"].value > 2.7 and fit.rms == pytest.approx(1e-3, rel=0.05)
    assert fit["J"].value == pytest.approx(own.J, rel=1e-4)


def test_derivatives_under_gravity_s_sine_are_those_of_the_motion(joint):
    """By every parameter of a joint that rests off 0 under friction that differs by direction, against differences, while
    the pendulum swings."""
    own = Pendulum(F=0.0)
    recording = table("time_s,phi_rad", own.swings(1.0, 700))
    fit = hopform.identify.fit(joint, recording, fitted=["J", "b"], known={"k": own.K, "k_t": 1.0}, sine=True, **ALONE)
    experiment, values = fit.solution.experiments[0], fit.solution.values
    at = {"k": own.K, "phi_0": 0.05, "load": 0.01, "F_plus": 0.004, "F_minus": 0.002}
    values, names = {**values, **at}, {**experiment.names, **{name: name for name in at}}
    experiment = dataclasses.replace(experiment, names=names)
    _, by = experiment.predict(values)
    assert by.keys() == values.keys()
    for name, rows in by.items():
        step = 1e-4 * max(abs(values[name]), 1e-2)
        ends = [experiment.predict({**values, name: values[name] + side * step})[0] for side in (1.0, -1.0)]
        expected = (ends[0] - ends[1]) / (2.0 * step)
        np.testing.assert_allclose(rows, expected, atol=2e-3 * np.abs(expected).max(), err_msg=name)


def test_friction_by_direction_does_not_turn_gravity(joint):
    """A pendulum swings about where it hangs, not about the middle of where it sticks."""
    own = Pendulum(F=0.008, more=0.010)
    phi = own.swings(1.4, 1000) + 1e-3 * np.random.default_rng(4).standard_normal(1000)
    known, fitted = {"k": own.K, "k_t": 1.0}, ["J", "b", "F_plus", "F_minus"]
    fit = hopform.identify.fit(joint, table("time_s,phi_rad", phi), sine=True, fitted=fitted, known=known, **ALONE)
    assert holds(fit, J=own.J, b=own.b, F_plus=own.F, F_minus=own.F + own.more) == []
    assert fit.rms == pytest.approx(1e-3, rel=0.05)


def test_accelerations_are_the_rates_of_the_velocities_of_a_motion(joint):
    """Of each mass that moves, in the middle of each phase; where both do, each depends on both velocities."""
    leg, h, seen = hopform.load_robot("hopper_c"), 1e-5, set[tuple[int, int, int]]()
    stands = {"x2": leg.L0 - 0.02, "v1": 0.2, "v2": -0.8}
    swings = joint.Robot(J=0.03, k=9.0, b=0.05, F_plus=0.1, F_minus=0.2, k_t=0.5, load=0.1)
    for motion in (
        hopform.load_solver("hopper").solve_motion(leg, start=stands, u=[(0.0, 3.0), (0.1, -1.0)], horizon=0.4),
        joint.solve_motion(swings, start={"phi": 0.2}, u=0.3, horizon=1.0),
    ):
        model = models.Model(motion.robot.solver)
        for phase in motion.phases:
            t = 0.5 * (phase.start + phase.end)
            before, now, after = (motion.at(each) for each in (t - h, t, t + h))
            x, v = ([getattr(now, getattr(mass, of)) for mass in model.masses] for of in ("coordinate", "velocity"))
            moving = [mass for mass, speed in zip(model.masses, v, strict=True) if speed != 0.0]
            for mass in moving:
                rate = (getattr(after, mass.velocity) - getattr(before, mass.velocity)) / (2.0 * h)
                found = model.accelerations(motion.robot.parameters, mass.number, x, v, phase.u, np.sign(v))
                assert found == pytest.approx(rate, rel=1e-6), (mass, phase)
                seen.add((len(v), len(moving), mass.number))
    assert seen >= {(2, 2, 1), (2, 2, 2), (1, 1, 1)}


def test_a_leg_of_two_masses_is_found_from_both_positions():
    """The paper's hopper stands on its spring and shakes under a current; nothing takes off."""
    robot = hopform.load_robot("hopper_c")
    rng, rate, h = np.random.default_rng(6), 500.0, 1e-4
    u = np.repeat(rng.choice([-0.3, 0.3, 1.0, 1.6], 12), 50)
    x1 = v1 = v2 = 0.0
    x2, rows = robot.L0 - 0.03, []
    for current in u.tolist():
        rows.append((x1, x2))
        for _ in range(round(1.0 / (rate * h))):
            force = robot.k * (x1 - x2 + robot.L0)
            w1 = v1 - h * (force + robot.b1 * v1 + robot.gamma2 * current) / robot.m_eff
            w2 = v2 + h * ((force - robot.b2 * v2) / robot.m_s - robot.g)
            v1, v2 = (
                0.0 if abs(w) <= h * f else w - math.copysign(h * f, w) for w, f in ((w1, robot.f1), (w2, robot.f2))
            )
            x1, x2 = x1 + h * v1, x2 + h * v2
    noisy = np.array(rows).T + 1e-4 * rng.standard_normal((2, u.size))
    recording = table("time_s,x1_m,x2_m,u_A", *noisy, u, rate=rate)
    known = {"m_s": robot.m_s, "L0": robot.L0}
    fit = hopform.identify.fit(
        "hopper", recording, fitted=["m_eff", "k", "b1", "b2", "f1", "f2", "gamma2"], known=known, **ALONE
    )
    truth = {name: getattr(robot, name) for name in ("m_eff", "k", "b1", "b2", "f1", "f2", "gamma2")}
    assert holds(fit, **truth) == []
    assert {trace.quantity for trace in fit.traces} == {"x1", "x2"}


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"known": {"mass": 1.0}}, "known: joint has no parameter 'mass'; it has J, k"),
        ({"known": {"J": -1.0}}, "J must be > 0"),
        ({"fitted": ["k", "spring"]}, "fitted: unknown parameter 'spring'; free ones are"),
        ({"fitted": ["k"]}, "fitted: J must be fitted or known; they have no default"),
        ({"fitted": ["k", "J"], "start": {"F": 1.0}}, "near: 'F': unknown parameter; fitted are k, J"),
        (
            {"fitted": ["k"], "known": {"J": 1.0}, "start": {"J": 1.0}},
            "near: 'J': it is not fitted; fitted are k",
        ),
        ({"known": {"J": 1.0, "F_minus": "F"}}, "known: F_minus = 'F' names no fitted parameter; fitted are k"),
    ],
)
def test_what_is_no_parameter_is_refused_by_name(joint, given, said):
    with pytest.raises(hopform.HopformError, match=said):
        hopform.identify.fit(joint, driven(1)[1], **given)


def test_columns_that_are_not_the_model_s_are_refused(joint):
    phi, zero = np.sin(np.arange(200) / 20.0), np.zeros(200)
    for head, said in {
        "time_s,phi_m,i_A": "must be in rad or a multiple of it, as phi of the model",
        "time_s,phi_rad,i_m": "must be in A, as i of the model",
        "time_s,q_rad,i_A": r"no column is a coordinate of the model \w+: name it phi .* there are q_rad, i_A$",
        "time_s,phi,i": "there are none; without a known unit, so left out: 'phi', 'i'$",
    }.items():
        with pytest.raises(hopform.HopformError, match=said):
            hopform.identify.fit(joint, table(head, phi, zero), known={"J": 1.0})
    with pytest.raises(hopform.HopformError, match=r"recordings must be .* got a table: write it by to_csv"):
        hopform.identify.fit(joint, pandas.DataFrame({"time_s": phi, "phi_rad": phi}), known={"J": 1.0})
    with pytest.raises(hopform.HopformError, match="gravity's sine is a torque on one angle .* x1 .m., x2 .m."):
        hopform.identify.fit("hopper", table("time_s,x1_m,x2_m,u_A", phi, phi, zero), sine=True)


def test_the_power_of_time_of_a_parameter_follows_from_its_unit():
    units = {"kg m^2": 0, "N m/rad": 2, "N m s/rad": 1, "N m": 2, "N m/A": 2, "m/s^2": 2, "N s/m": 1, "rad": 0, "s": -1}
    assert {unit: power_of(unit) for unit in units} == units


# ---- in MuJoCo ----


def replayed(fit: Any, start: tuple[float, float], drive: np.ndarray) -> np.ndarray:
    """What the file of a fit does in MuJoCo under a drive, from a start on."""
    mujoco = pytest.importorskip("mujoco", reason="mujoco is absent, which reads this file")
    model = mujoco.MjModel.from_xml_string(hopform.identify.simulator_file(fit, "mjcf"))
    data, found = mujoco.MjData(model), np.empty(drive.size)
    data.qpos[0], data.qvel[0] = start
    for n, u in enumerate(drive.tolist()):
        found[n], data.ctrl[0] = data.qpos[0], u
        mujoco.mj_step(model, data, nstep=round(1.0 / (RATE * model.opt.timestep)))
    return found


def test_a_joint_in_mujoco_moves_as_a_recording_that_was_not_fitted(joint):
    """Under another current, with the rms of the fit's own residual beside it: at most 1.5 times that."""
    rig, recording = driven(7)
    fit = hopform.identify.fit(
        joint, recording, fitted=["k", "b", "F_plus", "k_t"], known={"J": rig.mass, "F_minus": "F_plus"}, **ALONE
    )
    u = np.repeat(np.random.default_rng(8).choice([-3.0, 0.0, 2.0], 16), 40)
    other = simulate(rig, u, RATE) + 3e-4 * np.random.default_rng(9).standard_normal(u.size)
    rms = float(np.sqrt(np.mean((replayed(fit, (0.0, 0.0), u) - other) ** 2)))
    print(f"replay {1e3 * rms:.3f} mrad, fit {1e3 * fit.rms:.3f} mrad")
    assert rms <= 1.5 * fit.rms


def test_a_pendulum_in_mujoco_is_a_link_with_its_weight(joint):
    """It swings through 80 degrees as one does that was fitted from 40."""
    own = Pendulum()
    phi = own.swings(0.7, 800) + 1e-3 * np.random.default_rng(4).standard_normal(800)
    known = {"k": own.K, "k_t": 1.0, "F_minus": "F_plus"}
    fit = hopform.identify.fit(
        joint, table("time_s,phi_rad", phi), fitted=["J", "b", "F_plus", "phi_0"], known=known, sine=True, **ALONE
    )
    other = own.swings(1.4, 800)
    rms = float(np.sqrt(np.mean((replayed(fit, (1.4, 0.0), np.zeros(800)) - other) ** 2)))
    print(f"replay {1e3 * rms:.3f} mrad, fit {1e3 * fit.rms:.3f} mrad")
    assert rms <= 1.5 * fit.rms
    assert 'gravity="0 -9.81 0"' in hopform.identify.simulator_file(fit, "mjcf")
    with pytest.raises(hopform.HopformError, match="a pendulum's gravity is the weight of a link: mjcf writes it"):
        hopform.identify.simulator_file(fit, "urdf")
