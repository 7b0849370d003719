"""An actuator's fit in the words of simulators: MJCF (MuJoCo), URDF, Isaac Lab.

| word | of the fit | linear, rotary |
|---|---|---|
| inertia | m, all that moves | kg, kg m^2 about the axis |
| damping | b | N s/m, N m s/rad |
| frictionloss | m f | N, N m |
| gear | -gamma2, force per drive | N/A, N m/A; per V, N, N m as recorded |
| stiffness | k | N/m, N m/rad |
| springref | where the joint rests: rest, less m g/k of a known g | m, rad |
| bias | offset, a constant load as a drive | A, or as recorded |

MuJoCo's friction is a soft constraint, scaled by the inertia of the link without its armature: a slide whose link
weighs nothing has no friction. So the link has what moves. The constraint's time constant is two time steps, the least
that MuJoCo allows: it raises a smaller one to that, and its default of 0.02 s lets a joint creep.
"""

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hopform import HopformError
from hopform._checks import instance, word
from hopform._texts import comment_of_xml, line
from hopform.identify._fits import Fit
from hopform.identify._held import Held
from hopform.identify._models import Model
from hopform.identify._motion import Array, Values

NAME = "identified"
_G = 9.81
"""[m/s^2] gravity in the file of a pendulum, whose weight follows from its m g l."""
_TINY = 1e-9
"""[kg, kg m^2] what a link has that must have some: a mass on its axis if it turns, an inertia if it slides."""
_STEP = 1e-4
"""[s] time step of an MJCF file. At 0.5 ms a servo at 20 rad/s misses its recording by 7 times the encoder's noise."""


class Quantity(NamedTuple):
    """A number of a simulator with its 95 % interval, NaN where it was known, infinite without one, and its unit."""

    value: float
    low: float
    high: float
    unit: str

    def said(self) -> str:
        """Unit and interval, for a comment."""
        if math.isnan(self.low):
            return f"[{self.unit or '1'}] known"
        given = math.isfinite(self.high - self.low)
        return f"[{self.unit or '1'}] {f'95 % {self.low:.6g} .. {self.high:.6g}' if given else 'no interval'}"


def simulator_file(fit: Fit, form: str) -> str:
    """The file of a simulator for a fit of one mass: a joint, an actuator, a body on its spring; its comments have the
    intervals.

    form: mjcf (MuJoCo), urdf, isaac (Isaac Lab). A model's fit with gravity's sine becomes a link with its weight, in
    mjcf alone. Raises HopformError for a fit that does not fix its forces or that misses what a simulator needs.
    """
    return exported(instance("fit", fit, Fit, "a fit of recordings"), word("form", form, tuple(_FORMATS)))


def exported(fit: Fit, form: str) -> str:
    """A text in one of `_FORMATS`; HopformError for a fit that is of no actuator, or that misses what a simulator
    needs.
    """
    if not fit.scale:
        scale = "give --known gamma2, k or a mass"
        raise HopformError(f"--export needs forces in N or N m, and motion fixes them only up to a factor: {scale}")
    return _FORMATS[form](fit, quantities(fit))


def quantities(fit: Fit) -> dict[str, Quantity]:
    """What of `exported`'s words a fit has, from energy and accelerations of what moves. A word that one estimate alone
    gives has its interval; others have theirs to first order.
    """
    words, values = _words(fit), {each.name: each.value for each in fit.estimates}
    at, slopes = words(values), dict[str, list[float]]()
    for estimate in fit.estimates:
        step = 1e-6 * max(abs(estimate.value), 1e-3)
        ends = [words({**values, estimate.name: estimate.value + side * step}) for side in (1.0, -1.0)]
        for name in at:
            slope = (ends[0][name] - ends[1][name]) / (2.0 * step)
            felt = abs(slope * step) > _FELT * abs(at[name]) or (at[name] == 0.0 and slope != 0.0)
            slopes.setdefault(name, []).append(slope if felt else 0.0)
            if felt and estimate.method == "not identifiable":
                raise HopformError(
                    f"--export needs {estimate.name}, which these recordings do not identify: see the notes"
                )
    return {name: _spread(fit, value, np.array(slopes[name]), fit.units.of(_UNITS[name])) for name, value in at.items()}


_FELT = 1e-12
"""Share of a word that a millionth of an estimate moves at least: else it is rounding."""
_UNITS = {
    "inertia": "kg", "damping": "N s/m", "gear": "N/A", "bias": "A", "stiffness": "N/m", "springref": "m", "frictionloss": "N",
}  # fmt: skip


def _words(fit: Fit) -> Callable[[Values], dict[str, float]]:
    """The words of a fit under values of its estimates: of a model by its robot, of the hopper's actuator, or of its body
    on a spring, by their motions. HopformError for a fit of no single mass.
    """
    if fit.base is not None:
        model = Model(fit.base.solver)
        if len(model.masses) > 1:
            raise HopformError("a simulator's file takes the fit of one mass")

        def of_robot(values: Values) -> dict[str, float]:
            several = dict[str, list[float]]()
            for name, value in values.items():
                several.setdefault(name.partition("@")[0], []).append(value)
            ours = {name: sum(each) / len(each) for name, each in several.items() if name in model.parameters}
            return model.words(
                fit.base.parameters._replace(**ours, **{n: ours[other] for n, other in fit.tied.items()})
            )

        return of_robot
    moving = [each for each in (fit.solution.experiments if fit.solution else ()) if isinstance(each, Held)]
    some = [each for each in moving if each.driven] or [each for each in moving if "length" not in fit.values]
    if not some:
        raise HopformError("--export takes the fit of an actuator or a joint: a decay, step, air or force recording")

    def of_motions(values: Values) -> dict[str, float]:
        several = dict[str, list[float]]()
        for experiment in some:
            for name, value in experiment.words(values).items():
                several.setdefault(name, []).append(value)
        return {name: sum(each) / len(each) for name, each in several.items()}

    return of_motions


def _swings(fit: Fit) -> bool:
    """Whether gravity's sine is the spring."""
    return fit.solution is not None and fit.solution.experiments[0].swings


def notes(fit: Fit) -> list[str]:
    """What a file cannot say in its words: whether the stiffness of what turns is a spring's or gravity's."""
    if fit.units.position != "rad" or "stiffness" not in quantities(fit) or _swings(fit):
        return []
    gravity = "for a pendulum, whose m g l it is, leave it out and give the link its mass m at the lever l"
    return [f"stiffness is exported as a torsion spring; {gravity}"]


def _spread(fit: Fit, value: float, slope: Array, unit: str) -> Quantity:
    """A function of the estimates, of which slope has the derivatives: its interval to first order."""
    alone = np.flatnonzero(slope)
    if alone.size == 1 and fit.estimates[int(alone[0])].method != "not explained":
        one, by = fit.estimates[int(alone[0])], float(slope[alone[0]])
        share = value / one.value if one.value and math.isclose(value, by * one.value, rel_tol=1e-8) else 0.0
        low, high = sorted(share * end if share else value + by * (end - one.value) for end in (one.low, one.high))
        return Quantity(value, low, high, unit)
    spread = np.where(np.isfinite(fit.covariance), fit.covariance, 0.0)
    half = 1.96 * math.sqrt(max(float(slope @ spread @ slope), 0.0)) if slope.any() else math.nan
    if any(each.method == "not explained" for each, own in zip(fit.estimates, slope, strict=True) if own):
        half = math.inf
    return Quantity(value, value - half, value + half, unit)


def _head(fit: Fit, by_word: Mapping[str, Quantity]) -> list[str]:
    """What the numbers come from, and each with unit and interval."""
    white = all(trace.tests.white for trace in fit.traces)
    sources = ", ".join(Path(trace.label).name for trace in fit.traces)
    lines = [f"identified by hopform from {sources}; residuals {'' if white else 'NOT '}white"]
    lines += [f"{word} {each.value:.9g} {each.said()}" for word, each in by_word.items()]
    lines += ["inertia is that of all that moved: put it into the link or the joint's armature, not into both"]
    if not _swings(fit):
        lines += ["there is no gravity in this file: springref and bias hold the load of the recording"]
    return lines + notes(fit)


def _xml(lines: list[str]) -> list[str]:
    """Comments of XML, which hold no two hyphens in a row."""
    return [f"  <!-- {comment_of_xml(each)} -->" for each in lines]


def _inertial(fit: Fit, by_word: Mapping[str, Quantity]) -> tuple[str, str]:
    """Mass and moment of inertia of the link: it has all that moves."""
    moving = repr(by_word["inertia"].value)
    return (repr(_TINY), moving) if fit.units.position == "rad" else (moving, repr(_TINY))


def _mjcf(fit: Fit, by_word: Mapping[str, Quantity]) -> str:
    """A link on its joint. `angle` is set, since springref would be in degrees without; the bias acts through gear."""
    kind = "slide" if fit.units.position == "m" else "hinge"
    spring = () if _swings(fit) else ("stiffness", "springref")
    attributes = [word for word in ("damping", "frictionloss", *spring) if word in by_word]
    words = "".join(f' {word}="{by_word[word].value!r}"' for word in attributes)
    mass, inertia = _inertial(fit, by_word)
    place, pull, turned = "0 0 0", "0 0 0", ""
    if _swings(fit):  # a point mass at half of the radius of gyration's lever, so that both m l^2 and the rest are > 0
        lever = 0.5 * _G * by_word["inertia"].value / by_word["stiffness"].value
        weight = by_word["stiffness"].value / (_G * lever)
        place, pull, mass = f"0 {-lever!r} 0", f"0 {-_G!r} 0", repr(weight)
        inertia = repr(by_word["inertia"].value - weight * lever**2)
        turned = f' euler="0 0 {-by_word["springref"].value!r}"'
    more = ["solreffriction is two time steps; MuJoCo raises it to two of a longer step, with which friction creeps"]
    lines = [
        f'<mujoco model="{NAME}">', *_xml([*_head(fit, by_word), *more]), '  <compiler angle="radian"/>',
        f'  <option timestep="{_STEP}" integrator="RK4" gravity="{pull}"/>', "  <worldbody>",
        f'    <body name="{NAME}"{turned}>',
        f'      <joint name="{NAME}" type="{kind}" axis="0 0 1"{words} solreffriction="{2.0 * _STEP} 1"/>',
        f'      <inertial pos="{place}" mass="{mass}" diaginertia="{inertia} {inertia} {inertia}"/>', "    </body>",
        "  </worldbody>",
    ]  # fmt: skip
    if "gear" in by_word:
        bias = f' biastype="affine" biasprm="{by_word["bias"].value!r} 0 0"' if "bias" in by_word else ""
        gear = f'<general name="{NAME}" joint="{NAME}" gear="{by_word["gear"].value!r}" gainprm="1"{bias}/>'
        lines += ["  <actuator>", f"    {gear}", "  </actuator>"]
    return "\n".join([*lines, *_keyframe(fit, by_word), "</mujoco>", ""])


def _keyframe(fit: Fit, by_word: Mapping[str, Quantity]) -> list[str]:
    """Where each motion of the recordings begins by the fit, as a key to replay it from."""
    place, speed, position = "x", "v", "x1" if "gear" in by_word else "x2"
    if fit.base is not None:
        mass = Model(fit.base.solver).masses[0]
        place, speed, position = mass.coordinate, mass.velocity, f"x{mass.number}"
    keys = list[str]()
    for n, trace in enumerate(fit.traces):
        if trace.quantity == position and f"{place}@{n}" in fit.values:
            q, v = fit.values[f"{place}@{n}"], fit.values.get(f"{speed}@{n}", 0.0)
            keys += [
                f"  {each}"
                for each in _xml([f"start_{n}: {trace.label} from {trace.time[0]:.6g} s after its first sample on"])
            ]
            keys.append(f'    <key name="start_{n}" qpos="{q!r}" qvel="{v!r}"/>')
    return ["  <keyframe>", *keys, "  </keyframe>"] if keys else []


def _urdf(fit: Fit, by_word: Mapping[str, Quantity]) -> str:
    """A link on its joint. URDF has no gear, stiffness, springref and bias."""
    _refuse_pendulum(fit)
    rotary, (mass, inertia) = fit.units.position == "rad", _inertial(fit, by_word)
    places = np.concatenate([trace.measured for trace in fit.traces])
    limit = f'    <limit lower="{places.min():.6g}" upper="{places.max():.6g}" effort="1e9" velocity="1e9"/>'
    damping, friction = by_word["damping"].value, by_word["frictionloss"].value
    lines = [
        '<?xml version="1.0"?>', f'<robot name="{NAME}">', *_xml(_head(fit, by_word)),
        *_xml(["this format has no element for gear, stiffness, springref, bias and gravity",
               *([] if rotary else ["the limits are the range of the recordings; effort and velocity are not limited"])]),
        '  <link name="base"/>', f'  <link name="{NAME}_link">', "    <inertial>", f'      <mass value="{mass}"/>',
        f'      <inertia ixx="{inertia}" ixy="0" ixz="0" iyy="{inertia}" iyz="0" izz="{inertia}"/>',
        "    </inertial>", "  </link>",
        f'  <joint name="{NAME}" type="{"continuous" if rotary else "prismatic"}">', '    <parent link="base"/>',
        f'    <child link="{NAME}_link"/>', '    <axis xyz="0 0 1"/>', *([] if rotary else [limit]),
        f'    <dynamics damping="{damping!r}" friction="{friction!r}"/>', "  </joint>", "</robot>", "",
    ]  # fmt: skip
    return "\n".join(lines)


def _refuse_pendulum(fit: Fit) -> None:
    if _swings(fit):
        raise HopformError(
            "a pendulum's gravity is the weight of a link: mjcf writes it, the other forms have a joint alone"
        )


def _isaac(fit: Fit, by_word: Mapping[str, Quantity]) -> str:
    """An actuator of Isaac Lab (from 2.3 on), whose friction is an effort, and whose units are those of the fit."""
    _refuse_pendulum(fit)
    friction, loose = by_word["frictionloss"], Quantity(0.0, math.nan, math.nan, "none")
    numbers = {"stiffness": by_word.get("stiffness", loose), "armature": by_word["inertia"]}
    numbers |= {"friction": friction, "dynamic_friction": friction, "viscous_friction": by_word["damping"]}
    lines = [f"# {line(each)}" for each in _head(fit, by_word)]
    lines += ["# the effort of the joint is GEAR (drive + BIAS); its spring has the position target SPRINGREF", ""]
    lines += ["from isaaclab.actuators import ImplicitActuatorCfg", ""]
    lines += [f"{word.upper()} = {by_word[word].value!r}" for word in ("gear", "bias", "springref") if word in by_word]
    lines += [f"{NAME.upper()} = ImplicitActuatorCfg(", f'    joint_names_expr=["{NAME}"],', "    damping=0.0,"]
    return "\n".join([*lines, *(f"    {word}={each.value!r}," for word, each in numbers.items()), ")", ""])


_FORMATS: Mapping[str, Callable[[Fit, Mapping[str, Quantity]], str]] = {"mjcf": _mjcf, "urdf": _urdf, "isaac": _isaac}
