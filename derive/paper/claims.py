"""The register of what the paper claims in words: of its robots, its method and its controllers, each with a verdict
and numbers. Like the equations' it is one of the paper as long as the hopper that ships is the paper's.

A claim stands in this project's words, with the place where the paper makes it. Its numbers are those of the robots
that ship, whose parameters are this project's: the paper gives none. `tests/unit/test_paper_claims.py` computes each of
them with hopform and compares all digits that stand here; behind `<` or `>` stands a bound of its magnitude.

Not judged: what the paper says of other work, of robots in a plane, and of its plans.
"""

import pprint
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial

from .register import DIFFERENCE

_VERDICTS = {
    "reproduced": "the shipped robots do what the sentence says",
    "only mended": "not as printed; true with (14), (24), (26) or (27) mended, as the reason says",
    "depends on parameters": "true or not by parameters, currents or gains that the paper does not give",
    "reversed as printed": "with the equations as printed the opposite is true",
    "needs its hardware": "says something of machines and measurements, which a simulation cannot decide",
}
VERDICTS = {"not claimed": DIFFERENCE} if DIFFERENCE else _VERDICTS
"""The verdicts that there are, with what each means: none is claimed of another mechanism than the paper's."""


@dataclass(frozen=True)
class Number:
    """A number of a claim: what it is, its value as far as it is compared, `< 1e-9` where it is a bound, and its unit,
    `1` for none.
    """

    what: str
    value: str
    unit: str

    @property
    def with_unit(self) -> str:
        return self.value if self.unit == "1" else f"{self.value} {self.unit}"


@dataclass(frozen=True)
class Claim:
    """One claim of the paper: where it is made, what it says, the number printed with it, if any, a verdict, one of
    VERDICTS, what hopform computes, and why the verdict is what it is.
    """

    verdict: str
    name: str
    where: str
    says: str
    printed: str
    numbers: tuple[Number, ...]
    reason: str

    @property
    def sentence(self) -> str:
        """What is claimed, where, and the number that is printed with it."""
        return f"{self.says} ({self.where}{'; printed: ' if self.printed else ''}{self.printed})"

    @property
    def lines(self) -> list[str]:
        """The entry as lines of Python, texts in pieces that fit the line."""
        return f"{pprint.pformat(self, width=112)},".splitlines()


reproduced, mended, depends, reversed_, hardware = (partial(Claim, verdict) for verdict in _VERDICTS)


def _numbers(*each: tuple[str, str, str]) -> tuple[Number, ...]:
    return tuple(Number(*one) for one in each)


_CLAIMS = (
    # ---- I, the actuator ----
    reproduced(
        "brief_contact", "I", "Contact with the ground is so brief that feedback alone comes too late.", "< 0.25 s",
        _numbers(
            ("contact of hopper_c after a drop from 20 cm at 0 A", "0.185", "s"),
            ("the same at 3 A", "0.188", "s"),
            ("longest, drops from 2 to 36 cm at 0 to 3 A", "0.259", "s"),
            ("longest of hopper_b, the same drops at 0 to 10 V", "0.297", "s"),
        ),
        "Of these only drops from 2 cm stay longer than 0.25 s. Contact lasts a little more "
        "than half a period of the body on its spring, which the paper does not give.",
    ),
    reproduced(
        "limited_actuator", "I, Fig. 2",
        "The actuator's speed is limited: the length of the leg can be set neither at once nor with a constant "
        "acceleration.", "",
        _numbers(
            ("largest speed of hopper_c, standing, 3 A for 120 ms", "0.456", "m/s"),
            ("speed at which motor and viscous friction balance", "1.30", "m/s"),
            ("x1 after the 120 ms", "32.0", "mm"),
            ("the same with the first acceleration kept", "42.1", "mm"),
        ),
        "Spring and friction hold the actuator back long before the speed at which motor and viscous friction balance.",
    ),
    reproduced(
        "compressing_at_takeoff", "I, III-D, Fig. 3",
        "The actuator still compresses the spring when the stance ends.", "",
        _numbers(
            ("velocity of x1 at take-off, hopper_c, steady at 3 A", "0.355", "m/s"),
            ("x1 at take-off", "37.2", "mm"),
            ("its largest, in the flight behind", "43.5", "mm"),
            ("velocity of x1 at take-off, steady at 1.5 A", "0.177", "m/s"),
        ),
        "True in steady hopping under every constant current, which takes 1.4 A. Without current the actuator stands "
        "on its stop.",
    ),
    # ---- II, the initial model and the first controller ----
    hardware(
        "one_model", "II", "One model describes both machines, whose drives differ.", "",
        _numbers(("parameters in which hopper_b differs from hopper_c", "5", "1")),
        "Both shipped robots are values for one model, of a ball screw and of a cable, so they cannot contradict. The "
        "paper has no measurements that would.",
    ),
    reproduced(
        "initial_passive", "II, Fig. 4",
        "The first model, (1), (2), matches a drop without input fairly, and errs for small hops.", "",
        _numbers(
            ("rms of x2 over the first 0.5 s of hopper_b's drop from 12 cm, viscous friction fitted", "0.8", "mm"),
            ("rms of x2 from 2 to 2.5 s", "6.5", "mm"),
            ("noise of the recording", "0.2", "mm"),
        ),
        "On synthetic recordings, made with dry friction. A body with viscous friction alone still hops while the "
        "recorded one rests.",
    ),
    reproduced(
        "initial_actuated", "II, Fig. 4", "No parameters make the first model match the actuator.", "",
        _numbers(
            ("rms of x1 in a step of 4 V, hopper_b, b1 fitted", "1.77", "mm"),
            ("rms of x1, m_eff, b1, gamma2 and k fitted", "0.81", "mm"),
            ("rms of x1 with (3), (4) and the robot's own values", "0.19", "mm"),
        ),
        "On a synthetic recording, made with dry friction. Four times the noise is left by the best fit.",
    ),
    reproduced(
        "rise_time", "II, Fig. 6", "Under feedback alone the apex follows a new reference late.", "",
        _numbers(
            ("first controller, error of the 6th hop after a step up from 16 to 20 cm", "-2.2", "mm"),
            ("exact controller, error of the 3rd hop after it", "-4.9", "mm"),
            ("exact controller, error of the 4th hop after it", "< 1e-6", "mm"),
            ("first controller, error of the 2nd hop after a step down to 14 cm", "10.6", "mm"),
            ("exact controller, error of the 1st hop after it", "< 1e-6", "mm"),
        ),
        "The magnitudes of bounds are meant. Upwards most of the delay is the motor's: three hops pass at 10 V under "
        "either controller. Downwards the exact controller is there with the first hop, the first controller is not.",
    ),
    reproduced(
        "first_on_uneven", "II, Fig. 7", "The first controller cannot hold the height on uneven ground.", "",
        _numbers(
            ("scatter of hopper_b's apexes on even ground, gains of Fig. 7", "0.35", "mm"),
            ("the same over heights of +-3 cm", "6.99", "mm"),
            ("scatter on even ground, default gains", "0.49", "mm"),
            ("the same over heights of +-3 cm", "2.36", "mm"),
        ),
        "The desired hop height is 16 cm; the first three hops are not counted. How much it errs depends on gains that "
        "the paper does not give: 200 V/m and 10 V s/m in Fig. 7, 60 V/m and 3 V s/m by default, under which it errs less.",
    ),
    reproduced(
        "blind_to_actuator", "II",
        "A controller that neglects the actuator's state at touchdown always errs on uneven ground.", "",
        _numbers(
            ("apex of hopper_c with x1 = 1 cm at touchdown, less that with x1 = 0, drop of 20 cm at 2 A", "10.0", "mm"),
            ("apex with x1' = 0.1 m/s at touchdown, less that with 0", "26.9", "mm"),
        ),
        "(3), (4) depend on x2 - x1 alone while no stop is met: what the actuator is displaced by at touchdown is "
        "added to the apex.",
    ),
    hardware(
        "first_experiment", "II, Fig. 8",
        "Experiments, too, show that the first controller does not hold the height accurately.", "",
        _numbers(
            ("settled error of hopper_b's apexes, rms, without errors", "3.0", "mm"),
            ("with noise of the sensors", "4.6", "mm"),
            ("with 3 % less force than asked for", "9.1", "mm"),
            ("with a tick of 1 kHz and 2 ms of delay", "6.5", "mm"),
            ("with all of these", "19.0", "mm"),
        ),
        "A simulation of sensors, motor and clock that err stands for the experiment. Noise of the sensors costs "
        "least.",
    ),
    # ---- III-B, the improved model ----
    reproduced(
        "improved_fit", "III-B, Fig. 10",
        "The improved model, (3), (4), matches the actuator far better than (1), (2).", "",
        _numbers(
            ("rms of x1 in a step of 1.5 A, hopper_c, (1), (2) fitted", "8.83", "mm"),
            ("the same with (3), (4)", "0.20", "mm"),
            ("rms of x2 in a drop, (1), (2) fitted", "3.86", "mm"),
            ("the same with (3), (4)", "0.20", "mm"),
        ),
        "On synthetic recordings, which are of (3), (4) with noise of 0.2 mm: how near (3), (4) come to a machine they "
        "cannot tell.",
    ),
    reproduced(
        "rest_by_dry_friction", "III-B", "Dry friction gives the height at which the body comes to rest.", "",
        _numbers(
            ("rest of hopper_c's body after a drop from 12 cm, over its weight's", "1.496", "mm"),
            ("largest that dry friction holds, m_s f2/k", "1.500", "mm"),
        ),
        "The body sticks anywhere within m_s f2/k of the height at which the spring carries it; without dry friction "
        "only there.",
    ),
    depends(
        "friction_from_threshold", "III-B, Fig. 9",
        "A current that rises slowly until the actuator moves measures its dry friction.", "",
        _numbers(
            ("current that moves hopper_c's actuator, spring unloaded", "0.30", "A"),
            ("f1 by (5) of that", "0.78", "m/s^2"),
            ("current that moves it, standing on its leg", "0.75", "A"),
            ("f1 by (5) of that", "1.96", "m/s^2"),
        ),
        "True with the spring unloaded; the paper does not say whether it was. Standing, half the difference of the "
        "currents that move it up and down is right. What is measured is the friction at rest.",
    ),
    depends(
        "impact_for_foot", "III-B", "A fixed share of energy lost at each impact stands for the foot's mass.", "5 %",
        _numbers(
            ("kinetic energy that a foot of 5 % of the body's mass takes at touchdown", "4.8", "%"),
            ("apex after a drop from 20 cm without other losses, impact_loss 5 %", "19.0", "cm"),
            ("the same with that foot, stopped at touchdown and picked up at take-off", "18.1", "cm"),
        ),
        "The paper does not give the foot's mass. The model has the impact at touchdown alone; a foot costs as much "
        "again where the body picks it up.",
    ),
    depends(
        "lower_bound", "III-B, Fig. 11", "The curve without actuation is the lower bound of the reachable apexes.", "",
        _numbers(
            ("apex of hopper_c after a drop from 20 cm at 0 A", "11.82", "cm"),
            ("lowest apex of all currents up to 3 A", "11.59", "cm"),
            ("its current", "1.375", "A"),
        ),
        "At 0 A the actuator stands on its stop. A small current frees it and brakes the body, so the bound lies "
        "lower; how much lower is a matter of friction and current.",
    ),
    depends(
        "upper_bound", "III-B, Fig. 11",
        "The upper bound is the largest compression that the stroke allows.", "1 to 2 cm",
        _numbers(
            ("heights up to which the stroke limits hopper_c, x1 kept 1.5 cm off its stop", "6.5", "cm"),
            ("largest current without the stop from 2 cm", "2.31", "A"),
        ),
        "From higher drops the limit of the current comes first.",
    ),
    hardware(
        "bound_of_hardware", "III-B, Fig. 11", "The improved model has the bounds that are measured.", "",
        _numbers(
            ("apex of hopper_c after a drop from 20 cm at 3 A", "22.33", "cm"),
            ("its distance from the same to 50 digits", "< 1e-13", "cm"),
        ),
        "The bounds are those of the model to rounding; whether they are the robot's only the robot can tell.",
    ),
    # ---- III-C, the analytical solution ----
    reproduced(
        "exact_solution", "abstract, III-C, V",
        "The motion has an analytical solution, which is exact, and a new one continues it from any point.", "",
        _numbers(
            ("largest error of x1, x2 at take-off, hopper_c, 20 cm, 0, 0.75, 1.5 and 3 A", "< 1e-14", "m"),
            ("x2 at take-off with a new start at 60 ms, less that without, 0.75 A", "< 1e-14", "m"),
        ),
        "Against a solution to 50 digits that shares nothing with the closed form. Exact for currents that change in "
        "steps, assumption A.",
    ),
    depends(
        "signs_of_v2", "III-C, assumption B", "The body moves down during compression, and up during expansion.", "",
        _numbers(
            ("the body of hopper_c turns, drop of 20 cm at 3 A", "84.39", "ms"),
            ("the spring is shortest", "89.74", "ms"),
            ("x2' there, upwards", "0.209", "m/s"),
            ("reversals of the body in the last stance of a passive drop, before it sticks", "5", "1"),
        ),
        "The spring is shortest where x1' = x2', so the assumption needs an actuator at rest, as at 0 A. A body may "
        "also turn more than once, and stick.",
    ),
    depends(
        "pieces", "III-C", "A stance needs one more piece for each time that x1' crosses zero.", "N",
        _numbers(
            ("crossings of x1' at 0.75 A, hopper_c, 20 cm", "0", "1"),
            ("pieces of that stance", "6", "1"),
        ),
        "True without dry friction of the actuator and without stops. With them it also sticks, slips and meets its "
        "stop.",
    ),
    mended(
        "agrees_with_numbers", "III-C", "The analytical solution agrees with numerical ones.", "",
        _numbers(
            ("largest distance from an integrator's x1, x2 at take-off, hopper_c, 20 cm at 3 A", "< 1e-10", "m"),
            ("x2 at the end of compression by (14) as printed, less the right one", "13", "cm"),
        ),
        "With (14) mended. As it is printed no step of an integrator is small enough.",
    ),
    depends(
        "easy_coefficients", "III-C", "The coefficients follow easily from partial fractions.", "",
        _numbers(
            ("error of (18) in double precision at 0.1 s, hopper_c at 3 A", "< 1e-13", "m"),
            ("the same with b1 = b2 = 1e-6 N s/m", "> 1e-2", "m"),
        ),
        "They do where poles are distinct and far from 0. Near multiple poles they grow without bound and cancel.",
    ),
    reproduced(
        "fast", "I, V", "Analytical solutions are fast to compute.", "",
        _numbers(
            ("closed forms of a stance, hopper_c, 20 cm at 3 A", "2", "1"),
            ("evaluations of (3), (4) by an integrator of order 8 at 1e-9", "> 100", "1"),
        ),
        "Times on processors stand in docs/evidence/benchmark.md and firmware-costs.md.",
    ),
    # ---- III-D, energy ----
    reproduced(
        "takeoff_velocity", "III-D", "The body's velocity at take-off tells neither the state nor the energy.", "",
        _numbers(
            ("apex of hopper_c that takes off at 1.5 m/s, 0 A", "11.5", "cm"),
            ("the same at 3 A", "17.0", "cm"),
            ("energy k x1^2/2 at take-off, 3 A", "1.83", "J"),
        ),
        "What differs is x1: the body is higher by as much.",
    ),
    reproduced(
        "compression_alone", "III-D", "The compression of the spring alone does not tell the apex.", "",
        _numbers(
            ("apex of hopper_c after a compression of 10 cm at 0 A", "7.8", "cm"),
            ("the same at 3 A", "16.7", "cm"),
        ),
        "Drops from 14.0 and 9.6 cm lead to the same compression.",
    ),
    mended(
        "exact_apex", "III-D, IV, assumption A",
        "The energy of the body tells the apex exactly, given the current.", "",
        _numbers(
            ("apex at which (27) is zero, less the apex, hopper_c, 20 cm at 3 A", "3.20", "cm"),
            ("the same with (27) mended", "< 1e-12", "cm"),
        ),
        "With (27) mended: at take-off k x1^2/2 stays behind, which the AED counts.",
    ),
    reproduced(
        "ideal_energy", "III-D, Fig. 12", "Without losses the energy of the hopper stays constant.", "",
        _numbers(("variation of ideal's energy over 5 hops, relative", "< 1e-14", "1")),
        "Friction and impact are off, the actuator is locked.",
    ),
    mended(
        "aed_is_the_change", "III-D, Fig. 13",
        "The AED, computed beforehand, is what the body's energy changes by.", "",
        _numbers(
            ("largest difference over hopper_c's passive drop from 20 cm", "< 1e-12", "J"),
            ("(24) as printed at the first take-off, less the change", "3.82", "J"),
        ),
        "With (24) mended; as printed the losses of a passive drop add energy.",
    ),
    reproduced(
        "losses", "III-D, Fig. 13", "Energy drops at once at impact; friction in stance takes even more.", "",
        _numbers(
            ("lost at the first impact, hopper_c, passive drop from 20 cm", "0.294", "J"),
            ("lost in the stance behind", "2.114", "J"),
        ),
        "An impact takes 5 % of the kinetic energy. After five touchdowns the hopper rests.",
    ),
    reproduced(
        "steady_hopping", "III-D, Fig. 14",
        "Under 3 A the energy is higher, and hopping settles at a steady height.", "3 A",
        _numbers(
            ("steady apex of hopper_c at 3 A", "25.22", "cm"),
            ("the same at 1.5 A", "2.93", "cm"),
            ("hops before it stops at 0.75 A", "5", "1"),
        ),
        "The height depends on the robot. From 1.4 A on hopper_c hops on, below it comes to rest.",
    ),
    reproduced(
        "minima_of_energy", "III-D, Fig. 14",
        "Energy is added in U-shaped minima between the plateaus of the flights.", "",
        _numbers(
            ("energy of hopper_c's body at touchdown, steady at 3 A", "18.83", "J"),
            ("its minimum in stance", "16.67", "J"),
            ("at take-off", "20.02", "J"),
        ),
        "The energy has the spring as in (23), without the actuator's share.",
    ),
    mended(
        "current_that_holds", "III-D", "The AED gives the current that keeps the height.", "",
        _numbers(
            ("current after which hopper_c returns to 20 cm", "2.736", "A"),
            ("error of that apex", "< 1e-9", "cm"),
            ("current by (26), (27) as printed", "2.57", "A"),
            ("error of that apex", "-1.41", "cm"),
        ),
        "With (27) mended.",
    ),
    # ---- IV, V, the energy-based controller ----
    hardware(
        "ground_is_known", "IV, assumption B, Fig. 15",
        "Impacts are easy to detect, so the ground's height is known at touchdown.", "",
        _numbers(
            ("delay of a detector, 1 kHz, noise of 0.12 of the signal's step", "2.5", "ms"),
            ("false alarms", "< 1e-9", "1/s"),
            ("error of the ground's height by that delay, drop from 20 cm", "5.0", "mm"),
            ("cost of a current that comes 5 ms late", "-8.5", "mm"),
        ),
        "How noisy the sensor is the paper does not say; the signal here is synthetic.",
    ),
    reproduced(
        "simple", "IV", "The controller needs neither the data nor the tuning of the first one.", "",
        _numbers(
            ("stances of which the first controller's maps are measured", "7320", "1"),
            ("its gains", "2", "1"),
            ("stances solved for one current of the exact controller", "8", "1"),
        ),
        "It needs a model instead: 7 parameters, which have to be identified.",
    ),
    depends(
        "gentle_return", "IV", "A PD law returns x1 to its origin gently, before the next stance.", "50 ms before",
        _numbers(
            ("least x1 50 ms before touchdown, hopper_c in Fig. 16", "1.26", "mm"),
            ("most x1 there", "3.45", "mm"),
            ("most x1 at touchdown", "2.37", "mm"),
            ("most of a flight that the motor is at its limit", "27.8", "%"),
        ),
        "The gains are placed for that: 1 % of a step would be left 50 ms before. The limit of the motor and dry "
        "friction leave more. What is left is handed on to the next stance, where the exact controller counts it.",
    ),
    mended(
        "precise_on_rough", "II, V", "The energy-based controller holds the height precisely on rough ground.", "",
        _numbers(
            ("error of hopper_c's apexes in Fig. 17, rms, as printed", "28.3", "mm"),
            ("its mean", "-26.2", "mm"),
            ("rms with (26) mended alone", "15.8", "mm"),
            ("rms with the spring coordinate of (27) alone", "18.3", "mm"),
            ("rms with both, on the grid of 0.01 A", "0.2", "mm"),
            ("rms of the exact controller", "< 1e-6", "mm"),
        ),
        "With (26), (27) mended. As printed every apex is too low: (27) counts energy that stays in the spring.",
    ),
    mended(
        "even_equals_uneven", "IV, Figs. 16, 17", "On even and on uneven ground it is equally accurate.", "",
        _numbers(
            ("error of hopper_c's apexes on even ground, rms, as printed", "15.5", "mm"),
            ("the same on uneven ground", "28.3", "mm"),
            ("exact controller on even ground", "< 1e-6", "mm"),
            ("exact controller on uneven ground", "< 1e-6", "mm"),
        ),
        "With (26) mended: as printed a step down counts as one up, and either by half.",
    ),
    reversed_(
        "significant_improvement", "IV", "It is a significant improvement over the first controller.", "",
        _numbers(
            ("error of hopper_b's apexes, rms, as printed, 16 cm over heights of +-3 cm", "27.2", "mm"),
            ("first controller, gains of Fig. 7", "7.5", "mm"),
            ("first controller, default gains", "3.6", "mm"),
            ("exact controller", "< 1e-6", "mm"),
        ),
        "As printed it errs several times more than the first controller, with (26), (27) mended by less than anything "
        "that can be measured. The paper gives no gains. Those of Fig. 7, here, are not the first controller's best.",
    ),
    reproduced(
        "limits_in_the_model", "V", "A feedforward controller needs a model with the actuator's limits.", "",
        _numbers(
            ("error of hopper_c's apexes in Fig. 17, rms, no friction of the actuator in the model", "53.9", "mm"),
            ("with all of the model", "< 1e-6", "mm"),
        ),
        "b1 = f1 = 0 in the model of the controller; the robot has them.",
    ),
    reproduced(
        "both_frictions", "V", "Viscous and dry friction in the model improve control importantly.", "",
        _numbers(
            ("error of hopper_c's apexes in Fig. 17, rms, without dry friction in the model", "33.45", "mm"),
            ("without viscous friction in the model", "58.27", "mm"),
            ("with both", "< 1e-6", "mm"),
        ),
        "Every other parameter is right. A model without friction asks for too little, so that apexes are too low.",
    ),
)  # fmt: skip
CLAIMS = tuple(
    replace(claim, verdict="not claimed", numbers=(), reason=DIFFERENCE) if DIFFERENCE else claim for claim in _CLAIMS
)
"""The claims in the order of the paper's sections."""


def tallies() -> Iterator[tuple[str, str, int]]:
    """A row per verdict: what it means, and how many claims have it."""
    counts = Counter(claim.verdict for claim in CLAIMS)
    return ((verdict, meaning, counts[verdict]) for verdict, meaning in VERDICTS.items())
