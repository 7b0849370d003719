"""Fits in the words of simulators: each file, replayed in MuJoCo under the drive of its own recording.

Recordings are made by the independent time stepping of tests/oracle/recordings.c.
"""

import ast
import math
import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np
import pytest

import hopform
import hopform.identify
from hopform import _front as cli
from hopform.identify._fits import Fit
from hopform.identify._force import fit_force
from hopform.identify._joint import fit_robot
from hopform.identify._recordings import parse_recording
from hopform.identify._segments import filtered
from hopform.identify._simulators import exported, quantities
from tests.fits import ALONE
from tests.oracle.recordings import Rig, simulate
from tests.unit.test_rotary import COUNT, DRIVE, PENDULUM, RATE, SERVO, SPRUNG, TIME, air, angles, decay, recorded

mujoco = pytest.importorskip("mujoco", reason="mujoco is absent, which reads the files for simulators")
ROOT = Path(__file__).resolve().parents[2]

# ---- each kind of recording, of rigs that a seed scatters by 30 % ----

CART = Rig(mass=25.0, k=0.0, b=150.0, f=0.8, gamma=65.0)
CARRIAGE = replace(CART, k=1200.0)
BODY = Rig(mass=3.0, k=1200.0, b=5.0, f=0.6, start=0.05)
LEG = Rig(mass=3.0, k=1200.0, b=5.0, f=0.6, rest=0.3, drops=1.0, g=9.81, loss=0.05, start=0.45)
LOAD = 0.07
"""Of the largest drive: a constant load."""


class Recorded(NamedTuple):
    """A fit, and the drive at its samples."""

    fit: Fit
    drive: np.ndarray


def scattered(rig: Rig, seed: int) -> Rig:
    by = dict(zip(("mass", "b", "f"), np.random.default_rng([11, seed]).uniform(0.7, 1.3, 3), strict=True))
    return replace(rig, **{name: getattr(rig, name) * share for name, share in by.items()})


def moved(rig: Rig, drive: np.ndarray, noise: float, seed: int) -> np.ndarray:
    return simulate(rig, drive, RATE) + np.random.default_rng([12, seed]).normal(0.0, noise, COUNT)


@cache
def turning_in_air(seed: int) -> Recorded:
    x = moved(scattered(SERVO, seed), DRIVE + 0.6 * LOAD, 3e-4, seed)
    made = recorded("time_s,position_rad,voltage_V", x, DRIVE)
    return Recorded(fit_robot(air=made, known={"gamma2": -SERVO.gamma}, **ALONE), DRIVE)


@cache
def turning_on_a_spring(seed: int) -> Recorded:
    made = recorded("time_s,position_rad,torque_Nm", moved(scattered(SPRUNG, seed), DRIVE, 3e-4, seed), 0.05 * DRIVE)
    return Recorded(fit_robot(steps=made, **ALONE), 0.05 * DRIVE)


@cache
def turning_decay(seed: int) -> Recorded:
    made = recorded("time_s,position_rad", moved(scattered(PENDULUM, seed), 0.0 * DRIVE, 3e-4, seed))
    return Recorded(fit_robot(decays=made, known={"k": PENDULUM.k}, **ALONE), 0.0 * DRIVE)


@cache
def sliding_in_air(seed: int) -> Recorded:
    made = recorded("time_s,x1_m,current_A", moved(scattered(CART, seed), 3.0 * DRIVE + LOAD, 2e-4, seed), 3.0 * DRIVE)
    return Recorded(fit_robot(air=made, known={"gamma2": -65.0}, **ALONE), 3.0 * DRIVE)


@cache
def sliding_on_a_spring(seed: int) -> Recorded:
    made = recorded("time_s,x1_m,current_A", moved(scattered(CARRIAGE, seed), 3.0 * DRIVE, 2e-4, seed), 3.0 * DRIVE)
    return Recorded(fit_robot(steps=made, known={"gamma2": -65.0}, **ALONE), 3.0 * DRIVE)


@cache
def sliding_decay(seed: int) -> Recorded:
    made = recorded("time_s,x2_m", moved(scattered(BODY, seed), 0.0 * DRIVE, 2e-4, seed))
    return Recorded(fit_robot(decays=made, known={"k": BODY.k}, **ALONE), 0.0 * DRIVE)


@cache
def hanging_decay(seed: int) -> Recorded:
    rig = replace(scattered(BODY, seed), g=9.81)
    made = recorded("time_s,x2_m", moved(rig, 0.0 * DRIVE, 2e-4, seed))
    return Recorded(fit_robot(decays=made, known={"k": BODY.k, "g": 9.81}, **ALONE), 0.0 * DRIVE)


@cache
def robot(seed: int) -> Recorded:
    """Of the actuator in it: the decay of a body is recorded beside its step response."""
    body = recorded("time_s,x2_m", moved(replace(scattered(BODY, seed), rest=0.02), 0.0 * DRIVE, 2e-4, seed))
    step = recorded("time_s,x1_m,current_A", moved(scattered(CARRIAGE, seed), 3.0 * DRIVE, 2e-4, seed), 3.0 * DRIVE)
    return Recorded(fit_robot(decays=[body], steps=[step], known={"k": 1200.0}, **ALONE), 3.0 * DRIVE)


KINDS = [
    turning_in_air, turning_on_a_spring, turning_decay, sliding_in_air, sliding_on_a_spring,
    sliding_decay, hanging_decay, robot,
]  # fmt: skip


# ---- each file as MuJoCo has it ----

HEAD = re.compile(r"^(?:  <!--|#) (\w+) (\S+) \[", re.MULTILINE)
JOINT = """<mujoco><worldbody><body><joint type="{kind}" axis="0 0 1" damping="{viscous_friction}"
frictionloss="{friction}"/><inertial pos="0 0 0" mass="{armature}" diaginertia="{armature} {armature} {armature}"/>
</body></worldbody></mujoco>"""


class Replayed(NamedTuple):
    """A model, and the generalized force under a drive where that is no actuator of the model's."""

    model: Any
    force: Callable[[float], float]


def of_mjcf(fit: Fit) -> Replayed:
    """The file as it is; a drive that it does not know is the control."""
    return Replayed(mujoco.MjModel.from_xml_string(exported(fit, "mjcf")), lambda _: 0.0)


def of_urdf(fit: Fit) -> Replayed:
    """The file with what stands in its comments, as URDF has no word for it."""
    text = exported(fit, "urdf")
    return finely(mujoco.MjModel.from_xml_string(text), {word: float(value) for word, value in HEAD.findall(text)})


def of_isaac(fit: Fit) -> Replayed:
    """Its numbers in a joint of MuJoCo's: Isaac Lab is not at hand."""
    constants, arguments = of_python(exported(fit, "isaac"))
    kind = "hinge" if fit.units.position == "rad" else "slide"
    given = {word.lower(): value for word, value in constants.items()} | {"stiffness": arguments["stiffness"]}
    return finely(mujoco.MjModel.from_xml_string(JOINT.format(kind=kind, **arguments)), given)


def of_python(text: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Constants of a module, and the arguments of its call."""
    given = {each.targets[0].id: each.value for each in ast.parse(text).body if isinstance(each, ast.Assign)}
    call = given.pop("IDENTIFIED")
    values = {name: ast.literal_eval(each) for name, each in given.items()}
    return values, {each.arg: ast.literal_eval(each.value) for each in call.keywords}


def finely(model: Any, given: dict[str, float]) -> Replayed:
    """A model with stiff friction in small steps, without gravity, with the spring and the drive that are given."""
    model.opt.timestep, model.opt.integrator, model.opt.gravity[:] = 1e-4, mujoco.mjtIntegrator.mjINT_RK4, 0.0
    model.dof_solref[0] = [2e-4, 1.0]
    model.jnt_stiffness.flat[0], model.qpos_spring[0] = given.get("stiffness", 0.0), given.get("springref", 0.0)
    return Replayed(model, lambda u: given.get("gear", 0.0) * (u + given.get("bias", 0.0)))


FORMATS = {"mjcf": of_mjcf, "urdf": of_urdf, "isaac": of_isaac}


def replay(replayed: Replayed, start: tuple[float, float], at: np.ndarray, drive: np.ndarray) -> np.ndarray:
    """Positions from a start on at samples by their numbers, which may leave some out."""
    model, force = replayed
    data, found = mujoco.MjData(model), []
    data.qpos[0], data.qvel[0] = start
    if model.nkey:  # as the page says: from the file's own key
        mujoco.mj_resetDataKeyframe(model, data, 0)
    for u in drive[at[0] : at[-1] + 1].tolist():
        found.append(float(data.qpos[0]))
        data.ctrl[:], data.qfrc_applied[0] = u, force(u)
        mujoco.mj_step(model, data, nstep=round(1.0 / (RATE * model.opt.timestep)))
    return np.array(found)[at - at[0]]


def missed_by(made: Recorded, form: str) -> tuple[float, float]:
    """The rms of a replay beside that of the fit."""
    fit = made.fit
    position = "x1" if any(each.quantity == "x1" for each in fit.traces) else "x2"
    number, trace = next((n, each) for n, each in enumerate(fit.traces) if each.quantity == position)
    at = np.round(trace.time * RATE).astype(int)
    start = (fit.values[f"x@{number}"], fit.values.get(f"v@{number}", 0.0))
    x = replay(FORMATS[form](fit), start, at, made.drive)
    return float(np.sqrt(np.mean((x - trace.measured) ** 2))), trace.tests.rms


FEW = {turning_on_a_spring}


def cases(seeds: int) -> list[Any]:
    """Every kind in every format; the formats that share MJCF's numbers with all kinds in `make test-slices`."""
    every = [(kind, form, seed) for kind in KINDS for form in FORMATS for seed in range(seeds)]
    quick = [seed == 0 and (form == "mjcf" or kind in FEW) for kind, form, seed in every]
    marks = [() if each else pytest.mark.sliced for each in quick]
    names = [f"{kind.__name__}-{form}-{seed}" for kind, form, seed in every]
    return [pytest.param(*each, marks=mark, id=name) for each, mark, name in zip(every, marks, names, strict=True)]


@pytest.mark.parametrize(("kind", "form", "seed"), cases(3))
def test_a_simulator_moves_as_the_recording_did(kind, form, seed):
    """The rms of its replay is at most twice that of the fit, whatever was recorded and exported."""
    replayed, fitted = missed_by(kind(seed), form)
    assert replayed <= 2.0 * fitted
    assert form != "mjcf" or of_mjcf(kind(seed).fit).model.nkey == 1


@pytest.mark.parametrize("seed", range(3))
def test_the_force_of_a_fit_in_force_is_what_mujoco_s_inverse_dynamics_asks_for(seed):
    """At the filtered motion of the recording, beside the filtered torque; but about reversals, where the filter rounds
    the sign of v."""
    x = moved(scattered(SERVO, seed), DRIVE, 0.0, seed)
    made = recorded("time_s,position_rad,torque_Nm", x, 0.05 * DRIVE)
    known = {"F_m": "F_p"}
    fit = fit_force("joint", made, fitted=["J", "b", "F_p", "load"], known=known)
    rows = filtered(made)
    model, asked = of_mjcf(fit).model, []
    data = mujoco.MjData(model)
    for state in zip(rows.x, rows.v, rows.acceleration, strict=True):
        data.qpos[0], data.qvel[0], data.qacc[0] = state
        mujoco.mj_inverse(model, data)
        asked.append(float(data.qfrc_inverse[0]))
    given = model.actuator_gear[0, 0] * (rows.u + model.actuator_biasprm[0, 0])
    assert np.median(np.abs(np.array(asked) - given)) <= 0.5 * fit.rms


# ---- what the files say ----


def test_what_a_simulator_reads_are_forces_and_their_intervals():
    found = quantities(air())
    friction = found["frictionloss"]
    assert friction.value == pytest.approx(air()["m_eff"].value * air()["f1"].value)
    names = [each.name for each in air().estimates]
    i, j, m, f = names.index("m_eff"), names.index("f1"), air()["m_eff"].value, air()["f1"].value
    c = air().covariance
    stderr = math.sqrt(f * f * c[i, i] + m * m * c[j, j] + 2.0 * m * f * c[i, j])
    assert friction.high - friction.value == pytest.approx(1.96 * stderr)
    assert friction.low < 0.004 < friction.high
    assert found["gear"].value == pytest.approx(0.05, rel=1e-15)  # the mass times an acceleration
    ends = found["damping"].low, found["damping"].high
    assert ends == pytest.approx((air()["b1"].low, air()["b1"].high), rel=1e-12)
    assert [each.unit for each in found.values()] == ["kg m^2", "N m s/rad", "N m", "N m/V", "V"]


def test_friction_that_may_be_0_has_0_as_its_lower_end():
    several = [each._replace(low=0.0) if each.name == "b1" else each for each in air().estimates]
    assert quantities(replace(air(), estimates=tuple(several)))["damping"].low == 0.0


def test_mujoco_reads_back_what_was_fitted():
    model, found = of_mjcf(air()).model, quantities(air())
    assert model.body_inertia[1, 2] == found["inertia"].value
    assert model.dof_damping.ravel()[0] == found["damping"].value
    assert model.dof_frictionloss[0] == found["frictionloss"].value
    assert model.actuator_gear[0, 0] == found["gear"].value
    hung = of_mjcf(decay()).model
    assert hung.jnt_stiffness.ravel()[0] == pytest.approx(0.4807, rel=1e-15)
    assert hung.qpos_spring[0] == pytest.approx(
        decay()["rest@0"].value, rel=1e-12
    )  # in radians: MJCF's default is degrees


def test_a_key_s_time_counts_from_the_first_sample_whatever_the_logger_s_zero():
    rows = np.stack([TIME + 100.0, angles(PENDULUM)], axis=1).tolist()
    text = "\n".join(["time_s,position_rad", *(",".join(map(repr, row)) for row in rows)])
    fit = fit_robot(decays=parse_recording(text, "late.csv"), known={"k": 0.4807}, **ALONE)
    found = re.search(r"start_0: late.csv from (\S+) s after its first sample on -->", exported(fit, "mjcf"))
    assert found is not None
    place = float(np.interp(float(found[1]), TIME, angles(PENDULUM)))
    assert of_mjcf(fit).model.key_qpos[0, 0] == pytest.approx(place, abs=2e-3)


@pytest.mark.parametrize(
    "name", ["a--b.csv", "a---b.csv", "-----", "a-->b.csv", "<a & b>-.csv", "a\"b'c.csv", "a\nb.csv"]
)
def test_a_recording_of_any_name_leaves_every_file_one_that_is_read(name):
    fit = air()
    named = replace(fit, traces=tuple(replace(each, label=name) for each in fit.traces))
    for form in ("mjcf", "urdf"):
        assert ElementTree.fromstring(exported(named, form)) is not None
    assert of_mjcf(named).model.nkey == 1
    assert of_python(exported(named, "isaac"))[0]["GEAR"] == pytest.approx(0.05, rel=1e-15)


def test_the_friction_of_what_slides_is_as_large_as_it_was():
    """19.6 N: of a link that weighs nothing MuJoCo takes a microNewton."""
    model = of_mjcf(sliding_in_air(0).fit).model
    data = mujoco.MjData(model)
    data.qvel[0] = 0.1
    mujoco.mj_step(model, data)
    assert -data.qfrc_constraint[0] == pytest.approx(model.dof_frictionloss[0], rel=1e-6)
    assert (model.body_mass[1], model.dof_armature[0]) == (quantities(sliding_in_air(0).fit)["inertia"].value, 0.0)


def test_the_time_constant_of_friction_is_two_time_steps():
    for kind in (turning_in_air, sliding_decay):
        model = of_mjcf(kind(0).fit).model
        assert model.dof_solref[0].tolist() == pytest.approx([2.0 * model.opt.timestep, 1.0])


def test_a_weight_that_is_known_moves_the_place_where_the_joint_rests():
    made = hanging_decay(0).fit
    rest, k, m = made["rest@0"].value, made.values["k"], made["m_s"].value
    assert of_mjcf(made).model.qpos_spring[0] == pytest.approx(rest - 9.81 * m / k)
    spring = quantities(made)["springref"]
    assert abs(spring.value - made.traces[0].measured[-50:].mean()) < 9.81 * 0.6 / 1200.0  # within its friction
    apart = made["rest@0"].high - made["rest@0"].low + 9.81 / k * (made["m_s"].high - made["m_s"].low)
    assert 0.0 < spring.high - spring.low < apart


def test_gravity_of_a_pendulum_is_no_spring_in_silence(tmp_path, capsys):
    path = tmp_path / "pendulum.csv"
    rows = np.stack([TIME, angles(PENDULUM)], axis=1).tolist()
    path.write_text("\n".join(["time_s,position_rad", *(",".join(map(repr, row)) for row in rows)]))
    out, torsion = tmp_path / "pendulum.xml", "stiffness is exported as a torsion spring; for a pendulum"
    ask = ["identify", "all", f"decay:{path}", "--known", "k=0.4807", "--export"]
    for form in FORMATS:
        assert cli.main([*ask, form, "--out", str(out)]) == 0
        assert torsion in capsys.readouterr().err
        assert torsion in out.read_text()
    assert torsion not in exported(air(), "mjcf") + exported(sliding_on_a_spring(0).fit, "mjcf")


def test_urdf_has_inertia_damping_and_friction_about_its_axis():
    text = exported(air(), "urdf")
    joint = ElementTree.fromstring(text).find("joint")
    assert joint.get("type") == "continuous"
    found = quantities(air())
    dynamics = {name: float(value) for name, value in joint.find("dynamics").attrib.items()}
    assert dynamics == {"damping": found["damping"].value, "friction": found["frictionloss"].value}
    model = mujoco.MjModel.from_xml_string(text)
    assert model.body_inertia[1] == pytest.approx([found["inertia"].value] * 3)
    assert (model.dof_damping.ravel()[0], model.dof_frictionloss[0]) == tuple(dynamics.values())


def test_isaac_lab_has_friction_as_an_effort():
    _, values = of_python(exported(decay(), "isaac"))
    found = quantities(decay())
    assert values == {
        "joint_names_expr": ["identified"], "damping": 0.0, "stiffness": pytest.approx(0.4807, rel=1e-15), "armature": found["inertia"].value,
        "friction": found["frictionloss"].value, "dynamic_friction": found["frictionloss"].value,
        "viscous_friction": found["damping"].value,
    }  # fmt: skip


def test_a_hopper_s_actuator_slides():
    step = hopform.identify.record(hopform.load_robot("hopper_c"), "step", seed=2)
    fit = fit_robot(steps=step, known={"m_eff": 25.0}, **ALONE)
    assert {word: each.unit for word, each in quantities(fit).items()} == {
        "inertia": "kg", "damping": "N s/m", "stiffness": "N/m", "springref": "m", "gear": "N/A", "frictionloss": "N",
    }  # fmt: skip
    joint = ElementTree.fromstring(exported(fit, "urdf")).find("joint")
    assert joint.get("type") == "prismatic"
    assert float(joint.find("limit").get("upper")) == pytest.approx(fit.traces[0].measured.max(), rel=1e-5)
    assert of_mjcf(fit).model.actuator_gear[0, 0] == pytest.approx(65.0, rel=0.01)


def test_the_command_writes_a_model_with_intervals_in_comments(tmp_path, capsys):
    path, out = tmp_path / "servo.csv", tmp_path / "servo.xml"
    rows = np.stack([TIME, np.degrees(angles(SERVO)), DRIVE], axis=1).tolist()
    path.write_text("\n".join(["time_s,position_deg,voltage_V", *(",".join(map(repr, row)) for row in rows)]))
    ask = ["identify", "all", f"air:{path}", "--known", "gamma2=-0.05"]
    assert cli.main([*ask, "--export", "mjcf", "--out", str(out)]) == 0
    assert "N m s/rad" in capsys.readouterr().out
    assert re.search(r"<!-- damping \S+ \[N m s/rad\] 95 % \S+ \.\. \S+ -->", out.read_text())
    assert cli.main([*ask, "--export", "mjcf"]) == 0
    assert capsys.readouterr().out == out.read_text()
    assert cli.main([*ask[:3], "--export", "urdf"]) == 2
    assert "motion fixes them only up to a factor" in capsys.readouterr().err
    assert cli.main([*ask, "--export", "urdf", "--json"]) == 2
    assert cli.main([*ask, "--out", str(out)]) == 2
    assert "a fit in rad is not a hopper's" in capsys.readouterr().err


# ---- friction at rest ----

HELD_BY_FRICTION = """
<mujoco>
  <option timestep="0.001" gravity="0 0 0"/>
  <worldbody>
    <body>
      <joint name="j" type="hinge" frictionloss="1"/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>
    </body>
  </worldbody>
  <actuator><motor joint="j"/></actuator>
</mujoco>
"""


def test_a_joint_under_half_of_its_friction_creeps_by_default_as_readme_and_page_say():
    model = mujoco.MjModel.from_xml_string(HELD_BY_FRICTION)
    data = mujoco.MjData(model)
    data.ctrl[0] = 0.5
    while data.time < 10.0:
        mujoco.mj_step(model, data)
    crept = f"by {data.qpos[0]:.2f} rad in 10 s"
    for page in ("README.md", "docs/reference/identification-options.md"):
        assert crept in (ROOT / page).read_text("utf-8")
