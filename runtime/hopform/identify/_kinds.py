"""Kinds of recordings, and what a fit does before its least squares: read, check, segment, start.

A `Kind` (a drop over a held or a free actuator; a decay, a step response or the leg in the air, each as a slide) says
what these stages are for it; residuals are those of the rig that it names.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hopform import HopformError
from hopform._checks import mapping, nonnegative, real
from hopform._solver.choice import DEFAULT
from hopform._solver.package import Steps, records
from hopform.extend import items, positive, shown
from hopform.identify._estimation import Parameter
from hopform.identify._motion import Array, Known, Values
from hopform.identify._recordings import (
    HOPPER,
    Recording,
    Units,
    independent,
    mended,
    noise_of,
    quantum_of,
    read_recording,
    steps_of,
    units_of,
)
from hopform.identify._rigs import UNITS, Experiment, friction_of
from hopform.identify._rigs import Kind as Rig
from hopform.identify._search import Problem

File = str | Path
Recordings = Sequence[Recording | File] | Recording | File
"""One recording, several, or the files that hold them."""
MOST_RECORDINGS = 10_000
"""Recordings of a fit at most."""
MOST_KNOWN = 1000
"""Known values of a fit at most."""


class Cut(NamedTuple):
    """One motion out of a recording: times [s] from its beginning, its position [m], when it begins, its current; x1
    where it is recorded beside x2; letters of its beginning that are known; number: of its recording.
    """

    recording: Recording
    number: int
    label: str
    time: Array
    x: Array
    begin: float
    steps: Steps
    x1: Array | None = None
    still: Values = {}

    def mended(self) -> "Cut":
        """The motion without outliers, for the starts."""
        return self._replace(x=mended(self.x), x1=None if self.x1 is None else mended(self.x1))

    def independent(self) -> NDArray[np.bool_]:
        """Which samples are measurements of their own, of x1 or x2."""
        return independent(self.x) if self.x1 is None else independent(self.x) | independent(self.x1)

    def rests(self) -> list[str]:
        """What is left out of a motion that rests within one count of its encoder."""
        left = self.x.size - int(np.count_nonzero(self.independent()))
        said = f"{self.label}: {left} of {self.x.size} samples repeat others, at rest within one count of the encoder"
        return [f"{said}; the fit leaves them out"] if left else []


@dataclass(frozen=True)
class Group:
    """The recordings of one kind on their way through the stages: what is known of them, what is to be said; scale:
    whether something known fixes that of all forces; loss: of the fit.
    """

    kind: "Kind"
    recordings: Sequence[Recording]
    units: Units
    known: Values
    statements: tuple[str, ...] = ()
    scale: bool = True
    cuts: Sequence[Cut] = ()
    loss: str = "linear"

    @property
    def masses(self) -> list[float]:
        """What each motion carries beside the body [kg]."""
        return [cut.recording.added_mass for cut in self.cuts]


def cuts_of(
    recording: Recording, number: int, spans: Sequence[tuple[int, int]], x: Array, x1: Array | None = None,
    driven: bool | None = None,
) -> list[Cut]:  # fmt: skip
    """Spans of a recording as its motions, under its current if it has one, or if it is said to be driven: such a motion
    may begin at rest.
    """
    cuts, driven = list[Cut](), recording.has_current() if driven is None else driven
    for part, (begin, end) in enumerate(spans, 1):
        still = (
            {"v": 0.0} if (driven or "target" in recording.columns) and _rests_at_first(mended(x[begin:end])) else {}
        )
        label, at = recording.source + (f", part {part}" if len(spans) > 1 else ""), float(recording.time[begin])
        under = steps_of(recording, begin, end) if driven else ((0.0, 0.0),)
        beside = None if x1 is None else x1[begin:end]
        cuts.append(
            Cut(recording, number, label, recording.time[begin:end] - at, x[begin:end], at, under, beside, still)
        )
    return cuts


def _rests_at_first(x: Array) -> bool:
    """Whether a recording starts at rest: its first samples differ by noise alone."""
    noise = max(noise_of(x), quantum_of(x), 1e-12)
    return float(np.ptp(x[:10])) <= 8.0 * noise and float(np.ptp(x[:10])) < 0.02 * float(np.ptp(x))


Guess = dict[str, float]
"""Where letters, or parameters by their names, start."""


@dataclass(frozen=True, eq=False)
class Kind:
    """A kind of recording: the rig, which position is fitted, what its motion depends on, letters that are never fitted
    with their values where these are not given, over how much of a recording a fit is followed at first, and then.
    """

    rig: Rig
    position: Literal["x1", "x2"]
    every: tuple[str, ...]
    defaults: Values = field(default_factory=dict[str, float])
    parts: tuple[float, ...] = (1.0,)

    @property
    def letters(self) -> tuple[str, ...]:
        """Letters that are fitted unless they are known, but for those of the beginning of a motion."""
        return tuple(letter for letter in self.every if letter not in (*_OWN, *self.defaults))

    @property
    def driven(self) -> bool:
        """Whether a current moves it."""
        return "gamma2" in self.letters

    @property
    def uses(self) -> tuple[str, ...]:
        """What it takes of a recording: x1, x2, the current u."""
        return (self.position, *(("u",) if self.driven else ()), *(("x1",) if self.rig == "free" else ()))

    def check(self, group: Group, scaled: bool) -> Group:
        """The group with what fixes its scale; HopformError for what cannot be of this kind. scaled: by others."""
        return group

    def segment(self, group: Group, first: int) -> Group:
        """The group with its motions; the first recording has the number `first` in names of parameters."""
        return group

    def start(self, group: Group) -> list[list[Guess]]:
        """Where each motion starts, letter by letter: several guesses, the most trusted first."""
        return [[]]

    def bounded(self, parameter: Parameter, letter: str, cut: Cut, known: Values) -> Parameter:
        """A parameter within what is known of its motion."""
        return parameter

    def further(self, starts: Sequence[Guess]) -> list[Guess]:
        """All starts from those of the guesses, by the names of parameters."""
        return list(starts)

    def experiment(self, cut: Cut, names: Mapping[str, str], constants: Values) -> Experiment:
        """A motion as what is predicted of it."""
        kept = cut.independent()
        return Experiment(cut.label, self.rig, cut.time[kept], cut.x[kept], names, constants, cut.steps,
                          cut.recording.added_mass, cut.begin)  # fmt: skip

    def posed(self, group: Group, first: int) -> Problem:
        """The least-squares problem of the motions, the first of which has the number `first`."""
        clean, tries = [cut.mended() for cut in group.cuts], self.start(group)
        apart, numbers = len(set(group.masses)) > 1, range(first, first + len(clean))
        names = [
            {letter: _name(letter, n, cut.number if apart else None) for letter in (*self.letters, *_OWN)
             if letter in self.every and letter in guess.keys() - group.known.keys() - cut.still.keys()}
            for n, cut, guess in zip(numbers, clean, tries[0], strict=True)
        ]  # fmt: skip
        starts, parameters = [_by_name(guesses, names) for guesses in tries], dict[str, Parameter]()
        for cut, by_letter in zip(clean, names, strict=True):
            for letter, name in by_letter.items():
                parameter = _parameter(letter, name, starts[0][name], cut.x, group.units)
                parameters.setdefault(name, self.bounded(parameter, letter, cut, group.known))
        starts[0] = {name: each.start for name, each in parameters.items()}
        experiments = list[Experiment]()
        for cut, by_letter in zip(group.cuts, names, strict=True):
            experiments.append(self.experiment(cut, by_letter, {**group.known, **cut.still}))
            if cut.x1 is not None:
                beside = cut.x1[cut.independent()]
                experiments.append(replace(experiments[-1], label=f"{cut.label}, x1", measured=beside, of="x1"))
        return Problem(
            "drop", self.position, tuple(experiments), tuple(parameters.values()), tuple(self.further(starts)),
            {name: value for name, value in group.known.items() if math.isfinite(value)},
            (*group.statements, *(note for cut in group.cuts for note in cut.rests())),
            tuple(f"{each.source}: {note}" for each in group.recordings for note in each.notes),
            parts=self.parts, units=group.units, scale=group.scale, loss=group.loss, files=files_of(group.recordings), friction=FRICTION,
        )  # fmt: skip


def scale_of_body(group: Group) -> Group:
    """The group with the parameter that sets the scale of all forces of a body: weighed masses that were added, what is
    known, or m_s as 1 kg, or 1 kg m^2.
    """
    known = group.known
    if len({each.added_mass for each in group.recordings}) > 1 or "m_s" in known:
        return group
    if "k" in known:
        return replace(group, statements=("m_s follows from the known k",))
    forces = sorted({"m_eff", "gamma2"} & set(known))
    if forces:
        return replace(group, statements=(f"the scale of all forces is that of the known {' and '.join(forces)}",))
    per = f"motion alone fixes k/m_s and b2/m_s: k and b2 are per {group.units.of('kg')} of m_s"
    statement = f"{per}; weigh the body (known m_s), or record again with a weighed mass added"
    return replace(group, known={**known, "m_s": 1.0}, statements=(statement,), scale=False)


def files_of(recordings: Sequence[Recording]) -> tuple[str, ...]:
    """Recordings as a robot's file names them."""
    return tuple(f"{each.source} sha256 {each.digest}" if each.digest else each.source for each in recordings)


Given = Mapping[Kind, Recordings]
"""Recordings, or their files, by their kind."""


def read_several(recordings: Recordings, name: str) -> tuple[Recording, ...]:
    """One recording, several or none, as several, those of files read; HopformError for what is no recording."""
    if hasattr(recordings, "to_csv"):
        what = "recordings, as read_recording gives them, or their files"
        raise HopformError(f"{name} must be {what}, got a table: write it by to_csv(path, index=False)")
    one = isinstance(recordings, Recording | File)
    several: list[Any] = [recordings] if one else items(name, recordings, "recordings", MOST_RECORDINGS)
    several_read = [read_recording(each) if isinstance(each, File) else each for each in several]
    for n, recording in enumerate(several_read):
        if not isinstance(recording, Recording):
            what = "a Recording, as read_recording gives it, or a file of one"
            raise HopformError(f"{name}[{n}] must be {what}, got {shown(recording)}")
    return tuple(several_read)


def read_some(recordings: Recordings) -> tuple[Recording, ...]:
    """The same; HopformError for none."""
    several = read_several(recordings, "recordings")
    if not several:
        raise HopformError("a fit needs at least one recording, got none")
    return several


def check(given: Mapping[Kind, Sequence[Recording]], known: Known = None, loss: str = "linear") -> list[Group]:
    """Each kind with its units, with what is known of it, and with what fixes its scale. A spring that a body shows
    gives the scale of step responses against it.
    """
    allowed = tuple(dict.fromkeys(letter for kind in given for letter in (*kind.letters, *kind.defaults)))
    named = mapping("known", known, MOST_KNOWN)
    some = {kind: [each.whole(*kind.uses) for each in several] for kind, several in given.items() if several}
    if not some:
        raise HopformError("a fit needs at least one recording, got none")
    shared = any("k" in kind.letters and kind.position == "x2" for kind in some) or "k" in named
    scaled = shared and any(kind.rig == "step" for kind in some)
    groups = list[Group]()
    for kind, several in some.items():
        units = units_of(several, kind.position, driven=kind.driven)
        values = checked_known(named, allowed, units)
        values_of_kind = {name: value for name, value in values.items() if name in (*kind.letters, *kind.defaults)}
        groups.append(kind.check(Group(kind, several, units, {**kind.defaults, **values_of_kind}, loss=loss), scaled))
    if len({each.units.position for each in groups}) > 1:
        raise HopformError("recordings in m and in rad are of two mechanisms: fit them apart")
    return groups


def problem_of(given: Given, known: Known = None, loss: str = "linear") -> Problem:
    """The least-squares problem of recordings by their kind: read, checked, cut into motions, with the starts that
    these show; of several kinds that of a robot.
    """
    several = [group.kind.posed(group, first) for group, first in cuts_by_kind(given, known, loss)]
    return _merged(several) if len(given) > 1 else several[0]


def cuts_by_kind(given: Given, known: Known = None, loss: str = "linear") -> Iterator[tuple[Group, int]]:
    """The recordings of each kind, checked and cut into motions, with the number of the first one."""
    motions = 0
    for group in check({kind: read_several(some, "recordings") for kind, some in given.items()}, known, loss):
        segmented = group.kind.segment(group, motions)
        yield segmented, motions
        motions += len(segmented.cuts)


FRICTION = friction_of(DEFAULT)
"""Kinds of friction of the hopper."""
_OWN = ("rest", "x", "v", "x1", "v1")
"""Letters of the beginning of a motion."""
_SCALED: tuple[str, ...] = ("m_eff", "k", "b1", "gamma2")
"""Motion and current fix these only up to one common factor."""
_DOMAINS = {each.name: each.domain for each in records.ROBOT_FIELDS}
_CHECKS = {"positive": positive, "nonnegative": nonnegative, "fraction": nonnegative}
"""What a known value of a domain must be."""


def _name(letter: str, motion: int, recording: int | None) -> str:
    """The parameter of a letter: where a motion begins is its own; under a mass that is added, friction is that of a
    recording.
    """
    if letter in _OWN:
        return f"{letter}@{motion}"
    return f"{letter}@{recording}" if recording is not None and letter in ("b2", "f2") else letter


def _by_name(guesses: Sequence[Guess], names: Sequence[Mapping[str, str]]) -> Guess:
    """Where each parameter starts: the median over the motions that share it."""
    by_name = dict[str, list[float]]()
    for guess, by_letter in zip(guesses, names, strict=True):
        for letter, name in by_letter.items():
            by_name.setdefault(name, []).append(guess[letter])
    return {name: float(np.median(values)) for name, values in by_name.items()}


def _parameter(letter: str, name: str, value: float, x: Array, units: Units) -> Parameter:
    scales = dict.fromkeys(("rest", "x", "x1", "length"), 0.1 * float(np.ptp(x))) | {"impact_loss": 0.1, "offset": 0.1}
    scale = float(np.ptp(x)) if letter in ("v", "v1") else scales.get(letter, max(abs(value), 0.1))
    return Parameter(name, units.of(UNITS[letter]), value, scale, _DOMAINS.get(letter, "real"),
                     profiled=letter not in _OWN, own=letter in _OWN)  # fmt: skip


def _merged(problems: Sequence[Problem]) -> Problem:
    """One problem of several: parameters of one name are one, those fitted first give the starts.

    Each problem's other starts are tried beside the first of all the rest.
    """
    parameters, known = dict[str, Parameter](), dict[str, float]()
    first, others = Guess(), list[Guess]()
    for problem in problems:
        starts_by_name = {p.name: p.start for p in problem.parameters}
        shared = next(
            (name for name in ("k", "m_eff") if name in parameters and starts_by_name.get(name, 0.0) > 0.0), None
        )
        factor = parameters[shared].start / starts_by_name[shared] if shared and problem.quantity == "x1" else 1.0
        factors = {
            name: factor if name in _SCALED else 1.0 for each in (starts_by_name, *problem.starts) for name in each
        }
        for p in problem.parameters:
            by = factors[p.name]
            parameters.setdefault(p.name, p._replace(start=p.start * by, scale=max(p.scale * by, 1e-12)))
        some = problem.starts
        new = [{name: value * factors[name] for name, value in each.items() if name not in first} for each in some]
        others += [each for each in new[1:] if each != new[0]]
        first |= new[0]
        known |= problem.known
    known = {name: value for name, value in known.items() if name not in parameters}
    experiments = [each for problem in problems for each in problem.experiments]
    statements = dict.fromkeys(each for p in problems for each in p.statements)
    return Problem(
        "robot", "x1, x2", tuple(experiments), tuple(parameters.values()),
        (first, *(first | each for each in others)), known, (*statements, *_missing(parameters, known)),
        tuple(each for p in problems for each in p.warnings),
        parts=max((p.parts for p in problems), key=len),
        units=next((each.units for each in problems if each.quantity == "x1"), problems[0].units),
        scale=all(p.scale for p in problems), loss=problems[0].loss,
        files=tuple(dict.fromkeys(each for p in problems for each in p.files)), friction=FRICTION,
    )  # fmt: skip


def _missing(names: Iterable[str], known: Values) -> list[str]:
    """Parameters that no recording identifies, with one that would."""
    has = {name.partition("@")[0] for name in names} | set(known)
    statements = list[str]()
    if "b2" not in has:
        statements.append("nothing was recorded of the body: a drop test gives k/m_s, b2, f2, L0 + c and impact_loss")
    elif "length" not in has:
        fixed = "L0 + c and impact_loss cannot be identified from a body that is fixed to its spring"
        statements.append(f"{fixed}: drop it onto the ground")
    if "b1" not in has:
        statements.append("nothing was recorded of the actuator: a step response gives m_eff, b1, f1 and gamma2")
    return statements


def checked_known(known: Known, allowed: Sequence[str], units: Units = HOPPER) -> dict[str, float]:
    """The known values; HopformError for a name that is no parameter here or a value that is out of its domain."""
    values = dict[str, float]()
    for name, value in mapping("known", known, MOST_KNOWN).items():
        if not isinstance(name, str) or name not in allowed:
            message = f"known: unknown parameter {shown(name)}; this fit has {', '.join(allowed)}"
            raise HopformError(message)
        unit = units.of(UNITS[name])
        number = real(f"known: {name}", value, unit or "1")
        if not (math.isfinite(number) or name in ("x1_min", "x1_max")):
            raise HopformError(f"known: {name} must be a finite number in {unit or '1'}, got {number!r}")
        values[name] = _CHECKS.get(_DOMAINS.get(name, "real"), real)(f"known: {name}", number, unit)
    return values
