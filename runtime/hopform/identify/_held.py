"""The hopper's body and its actuator apart from each other, each as the slide that ships, in the letters of the hopper:
recordings that share parameters with its drops.

| role | what moves | m | k | b | F | k_f | load | x_0 |
|---|---|---|---|---|---|---|---|---|
| decay | the body, fixed to its spring, whose foot is held | m_s + added | k | b2 | m f2 | none | -m g | rest |
| step | the actuator on its spring, the body held | m_eff | k | b1 | m f1 | -gamma2 | 0 | rest |
| air | the actuator, the leg in the air | m_eff | 0 | b1 | m f1 | -gamma2 | -gamma2 offset | none |

`offset` is a constant load as a drive. Where positions are angles, masses are moments of inertia and forces are torques;
the slide's equation stays as it is.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from hopform._solver.package import Steps
from hopform.identify import _motion as motion
from hopform.identify._estimation import Parameter
from hopform.identify._kinds import Cut, Group, Guess, Kind, cuts_of, scale_of_body
from hopform.identify._models import Model, Modelled, Search, begin_of_search
from hopform.identify._motion import Array, Values
from hopform.identify._recordings import Recording, known_spans, mended, noise_of, quantum_of
from hopform.identify._rigs import POWERS, Experiment, Moved, Rates
from hopform.identify._segments import decays

_MOST_RANGE = {"m": 3.0, "rad": 12.0}
"""From end to end: no spring of a hopper is longer, no spring of a joint turns by more."""


class _Slide(Model):
    """What is known of the slide, which a process that reads a pickle loads by itself."""

    def __reduce__(self) -> Any:
        return slide, ()


@cache
def slide() -> Model:
    """The same, once."""
    return _Slide(motion.slide())


@dataclass(frozen=True)
class Held(Modelled):
    """A recording of the body or of the actuator alone, `kind` its role; its letters are the hopper's."""

    @property
    def powers(self) -> Mapping[str, int]:
        return POWERS

    @property
    def own_letters(self) -> tuple[str, ...]:
        return LETTERS[self.kind]

    def robot(self, at: Values) -> Any:
        mass, viscous, coulomb = _NAMES[self.kind]
        m = at[mass] + self.added_mass
        values = {"m": m, "k": at.get("k", 0.0), "x_0": at.get("rest", 0.0), "b": at[viscous], "F": m * at[coulomb]}
        values |= {"k_f": -at["gamma2"], "load": -at["gamma2"] * at.get("offset", 0.0)} if "gamma2" in at else {
            "k_f": 1.0, "load": -m * at["g"],
        }  # fmt: skip
        return self.model.robot({**_defaults(), **values})

    def words(self, values: Values) -> dict[str, float]:
        """What a simulator calls the numbers of what moves, without a mass that was added."""
        words = self.model.words(replace(self, added_mass=0.0).robot(self.letters(values)))
        return words if "gamma2" in self.own_letters else {n: each for n, each in words.items() if n != "gear"}

    def moved(self, at: Values, steps: Steps, time: Array) -> tuple[Moved, Rates]:
        (states, by), rates = super().moved(at, steps, time)
        mass, viscous, coulomb = _NAMES[self.kind]
        m = at[mass] + self.added_mass
        of_mass = by["m"] + at[coulomb] * by["F"]
        rows = {"k": by["k"], "rest": by["x_0"], viscous: by["b"], coulomb: m * by["F"], "x": by["x"], "v": by["v"]}
        if "gamma2" in at:
            drive = -by["k_f"] - at.get("offset", 0.0) * by["load"]
            rows |= {mass: of_mass, "gamma2": drive, "offset": -at["gamma2"] * by["load"]}
        else:
            rows |= {mass: of_mass - at["g"] * by["load"], "g": -m * by["load"]}
        return (states, {letter: row for letter, row in rows.items() if letter in at}), rates

    def _columns(self, at: Values) -> dict[str, int]:
        """All of the slide's, of which the hopper's letters are made."""
        columns = self.model.columns
        return {name: columns[name] for name in _SLIDE} | {"x": columns["x1"], "v": columns["v1"]}


LETTERS = {
    "decay": ("m_s", "k", "b2", "f2", "g", "rest", "x", "v"),
    "step": ("m_eff", "k", "b1", "f1", "gamma2", "rest", "x", "v"),
    "air": ("m_eff", "b1", "f1", "gamma2", "offset", "x", "v"),
}
"""What a recording of each role depends on."""
_NAMES = {"decay": ("m_s", "b2", "f2"), "step": ("m_eff", "b1", "f1"), "air": ("m_eff", "b1", "f1")}
"""Mass, viscous and Coulomb friction."""
_SLIDE = ("m", "k", "b", "F", "k_f", "load", "x_0")


def _defaults() -> dict[str, float]:
    return {name: float(each["default"]) for name, each in slide().parameters.items()}


@dataclass(frozen=True, eq=False)
class HeldKind(Kind):
    """A role of `LETTERS`."""

    def check(self, group: Group, scaled: bool) -> Group:
        """With what fixes the scale: something known, masses that were added, or a spring that other recordings show."""
        if self.rig == "decay":
            return scale_of_body(group)
        known = dict(group.known)
        if group.units.drive == group.units.force:
            known.setdefault("gamma2", -1.0)
        if scaled or {"m_eff", "k", "gamma2"} & set(known):
            return replace(group, known=known)
        statement = (
            "motion and current fix m_eff, k, b1, gamma2 only up to a common factor: they are per "
            f"{group.units.of('kg')} of m_eff; give a weighed mass, the stiffness or the force constant as known"
        )
        return replace(group, known={**known, "m_eff": 1.0}, statements=(statement,), scale=False)

    def segment(self, group: Group, first: int) -> Group:
        """With each decay as a motion, or each part of a recording in which the current is known."""
        cuts = list[Cut]()
        for n, recording in enumerate(group.recordings, first):
            x = recording.position("x1") if self.rig == "air" else recording.oscillation(self.position)
            if self.driven:
                recording.driving_current()
            spans = known_spans(recording) if self.driven else _decays(recording, x)
            cuts += cuts_of(recording, n, spans, x, driven=self.driven)
        return replace(group, cuts=cuts)

    def start(self, group: Group) -> list[list[Guess]]:
        """Least squares of the slide's accelerations through each filter."""
        known, cuts = group.known, group.cuts
        mass, viscous, _ = _NAMES[self.rig]
        held = {"m": known.get(mass), "k": known.get("k"), "b": known.get(viscous), "x_0": known.get("rest")}
        held |= {"k_f": -known["gamma2"] if "gamma2" in known else None} if self.driven else {"k_f": 1.0, "load": 0.0}
        if self.rig == "air":
            held |= {"k": 0.0, "x_0": 0.0, "load": None}
        elif self.driven:
            held |= {"load": 0.0}
        given = {name: float(each) for name, each in held.items() if each is not None}
        added = any(group.masses)
        if not added and not {"m", "k", *(["k_f"] if self.driven else [])} & given.keys():
            given["m"] = 1.0 if self.driven else 0.2 * known.get("m_eff", 5.0)
        names = [name for name in _SLIDE if name not in given]
        apart = {"x_0", *(("b", "F") if len(set(group.masses)) > 1 else ())}
        letters = {cut.number: {n: f"{n}@{cut.number}" if n in apart else n for n in names} for cut in cuts}
        free = {
            name: begin_of_search(slide(), letter, None) for each in letters.values() for letter, name in each.items()
        }
        search = Search(slide(), cuts, letters, "m" if added else "", False)
        tries = search.starts({**_defaults(), **given}, free)[0]
        return [[self._guess({**given, **{n: some[name] for n, name in letters[cut.number].items()}}, cut.mended()) for cut in cuts]
                for some in tries]  # fmt: skip

    def _guess(self, at: Values, cut: Cut) -> Guess:
        """The hopper's letters of the slide's, and where a motion begins."""
        mass, viscous, coulomb = _NAMES[self.rig]
        x, f = cut.x[:5], max(at["F"], 0.0) / (at["m"] + cut.recording.added_mass)
        guess = {mass: at["m"], "k": max(at["k"], 1e-3), viscous: at["b"], coulomb: f, "rest": at["x_0"]}
        guess |= {"gamma2": -at["k_f"], "offset": at["load"] / at["k_f"] if at["k_f"] else 0.0}
        return guess | {"x": float(np.median(x)), "v": float(np.polyfit(cut.time[:5], x, 1)[0])}

    def bounded(self, parameter: Parameter, letter: str, cut: Cut, known: Values) -> Parameter:
        """A recording that begins at rest begins within the noise of what is measured there, whatever the fit would
        gain.
        """
        if letter != "x" or "v" not in cut.still:
            return parameter
        wide = 8.0 * max(noise_of(cut.x), quantum_of(cut.x), 1e-9)
        return parameter._replace(low=parameter.start - wide, high=parameter.start + wide)

    def experiment(self, cut: Cut, names: Mapping[str, str], constants: Values) -> Experiment:
        kept = cut.independent()
        return Held(cut.label, self.rig, cut.time[kept], cut.x[kept], names, constants, cut.steps, cut.recording.added_mass,
                    cut.begin, of=self.position, model=slide())  # fmt: skip


def _decays(recording: Recording, x: Array) -> list[tuple[int, int]]:
    """The decays of a recording; HopformError for one that no spring can have."""
    unit = recording.units("x2", driven=False).position
    if float(np.ptp(x)) > _MOST_RANGE[unit]:
        most = f"at most {_MOST_RANGE[unit]:g} {unit} is allowed of a body on its spring"
        message = f"moves over {np.ptp(x):.3g} {unit}; {most}: is its unit right?"
        raise recording.error_of("x2", message, int(np.abs(x - np.median(x)).argmax()))
    return decays(recording, mended(x))


HELD = {
    "decay": HeldKind("decay", "x2", LETTERS["decay"], {"g": 0.0}, (0.3, 1.0)),
    "step": HeldKind("step", "x1", LETTERS["step"], {}, (0.35, 1.0)),
    "air": HeldKind("air", "x1", LETTERS["air"], {}, (0.35, 1.0)),
}
"""The kinds by their roles."""
