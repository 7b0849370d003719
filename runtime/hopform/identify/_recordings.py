"""Recordings: a CSV with named columns and units, read into SI units, and what its samples show by themselves.

The first line names the columns, each with its unit: `time_s,x_mm,current_A`, `time (s),x [mm]`, or a line of units
below it. Columns are separated by commas, semicolons, tabs or bars. Lines that begin with # are remarks. Every fault is
one line with file, line, column. Only the time is judged here; any other column is judged when a fit asks for it, so
that one which no fit uses may hold anything.

A rotary recording has its position as an angle. Then masses are moments of inertia about its axis [kg m^2], forces are
torques [N m], lengths are angles [rad]; the equations of motion stay as they are.
"""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from hashlib import sha256
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hopform import HopformError
from hopform._checks import number_of
from hopform._errors import printable
from hopform._files import name_of, path_of, read_text, rows_of
from hopform._show import Arrays, Curve, Shown, span
from hopform._solver.package import Steps, records
from hopform.extend import Card, finite, shown
from hopform.identify._motion import Array

COLUMNS: dict[str, tuple[str, float]] = {
    "s": ("time", 1.0), "ms": ("time", 1e-3), "us": ("time", 1e-6), "ns": ("time", 1e-9),
    "m": ("length", 1.0), "cm": ("length", 1e-2), "mm": ("length", 1e-3), "um": ("length", 1e-6),
    "rad": ("angle", 1.0), "mrad": ("angle", 1e-3), "deg": ("angle", math.pi / 180.0), "rev": ("angle", 2.0 * math.pi),
    "A": ("current", 1.0), "mA": ("current", 1e-3),
    "V": ("voltage", 1.0), "mV": ("voltage", 1e-3),
    "N": ("force", 1.0), "kN": ("force", 1e3),
    "Nm": ("torque", 1.0), "mNm": ("torque", 1e-3),
}  # fmt: skip
"""Units after the last underscore of a column's name: the quantity, and the multiple of its SI unit."""
COUNTS = re.compile(r"([0-9]+(?:\.[0-9]+)?)per(rev|rad|deg|m|mm)")
"""The unit of an encoder's counts: how many a turn, or a length, has."""
OTHER = "other"
"""The quantity of a column in the unit that a model's file gives its input, which is none of those above."""
DRIVES = {"current": "A", "voltage": "V", "force": "N", "torque": "N m", OTHER: ""}
"""What may drive a motion, with its SI unit."""
SI = {"time": "s", "length": "m", "angle": "rad", **DRIVES, "": ""}
"""The SI units of what a column may hold; of one that no fit uses, none."""
_ROTARY = {
    "kg": "kg m^2", "N/m": "N m/rad", "N s/m": "N m s/rad", "m/s^2": "rad/s^2", "m": "rad", "m/s": "rad/s", "N": "N m",
}  # fmt: skip


def unit_of(text: str) -> tuple[str, float] | None:
    """The quantity of a column's unit and the multiple of its SI unit; None for one that is not known."""
    if (counts := COUNTS.fullmatch(text)) and float(counts[1]) > 0.0:
        quantity, factor = COLUMNS[counts[2]]
        return quantity, factor / float(counts[1])
    return COLUMNS.get(text)


class Units(NamedTuple):
    """The SI units of a position, m or rad, and of what drives it."""

    position: str = "m"
    drive: str = "A"

    @property
    def force(self) -> str:
        """N, or N m about an axis."""
        return "N" if self.position == "m" else "N m"

    def of(self, unit: str) -> str:
        """The unit of a parameter whose unit is `unit` in a hopper, which moves in m by A."""
        if unit == "N/A":
            return f"{self.force}/{self.drive}" if self.drive != self.force else ""
        if unit == "A":
            return self.drive
        return unit if self.position == "m" else _ROTARY.get(unit, unit)

    def shown(self, quantity: str) -> tuple[str, float]:
        """The unit in which people are shown a quantity of a `Trace`, and its factor."""
        if quantity in ("x1", "x2"):
            return f"m{self.position}", 1e3
        return self.force if quantity == "force" else self.drive, 1.0


HOPPER = Units()


TIMES = ("time", "t")
TITLES = {
    "x1": ("x1", "actuator", "x", "position", "pos"), "x2": ("x2", "height", "body", "x", "position", "pos"),
    "u": ("current", "u", "i", "drive_current", "drive_voltage", "voltage", "torque", "force"),
    "target": ("target", "goal", "command", "setpoint", "reference", "desired", "target_position", "goal_position",
               "commanded_position", "desired_position", "position_target", "position_command", "ref", "cmd"),
}  # fmt: skip
"""Names of the columns of both positions, of the current and of a law's target, the one to be taken first."""
_NAMED = {*TIMES, *TITLES["x1"], *TITLES["x2"], *TITLES["u"], *TITLES["target"]} - {"torque", "force"}
"""Names of columns that need a unit where a fit uses them; `torque_on` is none."""
UNUSED = ""
"""The quantity of a column that no fit uses."""
FEWEST = 20
_LEAST_WAY = 5e-4
"""[m or rad] what no motion is smaller than, beyond noise and quantum: else a unit is wrong."""
_MOST_WAY = {"length": 10.0, "angle": 1e4}
"""[m, rad] what no position and no motion is larger than."""
_HALF_PERIODS = {"x1": (1e-3, 50.0), "x2": (1e-3, 5.0)}
"""[s] what the half period of a hopper or a joint lies between, else the unit of time is wrong: of x2 that of its
spring, of x1 maybe that of a slow drive."""
_DRIVEN_BY = {
    "current": (0.01, 300.0), "voltage": (0.01, 1000.0), "force": (0.01, 1e5), "torque": (1e-5, 1e4), OTHER: (0.0, math.inf),
}  # fmt: skip
"""[A, V, N, N m] the same of what drives it; of another quantity nothing is known."""


def fault(source: str, message: str, line: int | None, column: str | None = None) -> HopformError:
    """An error that says where it is."""
    places = [source, *([f"line {line}"] if line else []), *([f"column {column!r}"] if column else [])]
    return HopformError(f"{', '.join(places)}: {message}")


class Column(NamedTuple):
    """A column in SI units: its name in the file, its quantity, its place, its values."""

    title: str
    quantity: str
    place: int
    values: Array


@dataclass(frozen=True, repr=False, eq=False)
class Recording(Shown):
    """A recording: times [s] that increase, and columns in SI units by their names without the unit.

    A sample that the file leaves empty is NaN until `whole` leaves it out. lines: of the samples in the file; head: of
    the names. added_mass [kg]: what the body carried beside itself. remarks: lines that begin with #. unfit: why a
    column is none of `columns`, raised where a fit asks for it.
    """

    source: str
    time: Array
    columns: Mapping[str, Column]
    lines: Sequence[int] = (2,)
    added_mass: float = 0.0
    notes: tuple[str, ...] = field(default=(), compare=False)
    remarks: tuple[str, ...] = ()
    head: int = 1
    digest: str = field(default="", compare=False)
    """SHA-256 of the text that it was read from"""
    unfit: Mapping[str, HopformError] = field(default_factory=dict[str, HopformError], compare=False)
    others: Mapping[str, Column] = field(default_factory=dict[str, Column], compare=False)
    """columns of numbers whose unit is not known here, by their names with it"""

    @property
    def line(self) -> int:
        """That of the first sample in the file."""
        return self.line_of(0)

    def line_of(self, sample: int) -> int:
        """The line of a sample in the file; of a recording that was made, the one that `to_csv` gives it."""
        last = len(self.lines) - 1
        return self.lines[min(sample, last)] + max(sample - last, 0)

    def whole(self, *quantities: str) -> "Recording":
        """The same where each of x1, x2 or the current u that is recorded has a number, with a note of what is left out;
        HopformError for too few such samples.
        """
        return self.of_columns([column for each in quantities if (column := self.found(each)) is not None])

    def of_columns(self, used: Sequence[Column]) -> "Recording":
        """The same where each of these columns has a number."""
        empty = [(column.title, np.isnan(column.values)) for column in used]
        kept = ~np.any([np.zeros(self.time.size, dtype=bool), *(gone for _, gone in empty)], axis=0)
        if bool(kept.all()):
            return self
        titles = ", ".join(title for title, gone in empty if gone.any())
        first, left = int(np.argmin(kept)), int(np.count_nonzero(kept))
        note = f"{kept.size - left} of {kept.size} samples without a number in {titles}, so left out"
        if left < FEWEST:
            raise self.error(f"{note}: at least {FEWEST} must have one in each", self.line_of(first))
        columns, others = (
            {name: each._replace(values=each.values[kept]) for name, each in several.items()}
            for several in (self.columns, self.others)
        )
        lines = [self.line_of(n) for n in np.flatnonzero(kept).tolist()]
        notes = (*self.notes, f"{note}, the first in line {self.line_of(first)}")
        return replace(self, time=self.time[kept], columns=columns, others=others, lines=lines, notes=notes)

    def _card(self) -> Card:
        rate = (self.time.size - 1) / float(np.ptp(self.time)) if self.time.size > 1 else 0.0
        given = [("samples", self.time.size), ("time", span(self.time)), ("rate", f"{rate:.5g} Hz")]
        given += [("added mass", f"{self.added_mass:g} kg")] if self.added_mass else []
        rows = [(f"{name} [{SI[each.quantity]}]", span(each.values)) for name, each in sorted(self.columns.items())]
        return Card(f"Recording {self.source}", given, rows)

    def _curve(self) -> Curve:
        name, column = next(iter(self.columns.items()))
        return f"{name} [{SI[column.quantity]}] over time [s]", self.time, column.values

    def _arrays(self) -> Arrays:
        columns = {name: (("time",), each.values, {"units": SI[each.quantity]}) for name, each in self.columns.items()}
        return {"time": (("time",), self.time), **columns}

    def position(self, of: str) -> Array:
        """The measured x1 or x2 [m]; HopformError if there is none, or if it cannot be one."""
        column = self.column_of(of)
        values, reach = column.values, float(np.ptp(column.values))
        if reach == 0.0:
            raise self.error("is constant: nothing moves", self.line, column)
        unit, most = SI[column.quantity], _MOST_WAY[column.quantity]
        allowed, small = f"{1e3 * _LEAST_WAY:g} m{unit} to {most:g} {unit}", f"{1e3 * reach:.2g} m{unit}"
        if float(np.abs(values).max()) > most:
            raise self._beyond(column, f"a position is within {most:g} {unit}")
        if not _LEAST_WAY <= reach <= most:
            seen = f"{reach:.3g} {unit}" if reach > most else small
            raise self.error(f"moves by {seen} in all; a fit can use {allowed}: is its unit right?", self.line, column)
        noise = max(noise_of(values), quantum_of(values))
        if float(np.std(values)) < 3.0 * noise:
            message = f"does not move beyond its noise of {noise:.2g} {unit}: let it move further"
            raise self.error(message, self.line, column)
        return values

    def oscillation(self, of: str) -> Array:
        """The same of what oscillates on a spring; HopformError if its half periods are those of no hopper."""
        values, (least, most) = self.position(of), _HALF_PERIODS[of]
        half = half_period(self.time, values)
        if not least <= half <= most and not math.isnan(half):
            seen, allowed = f"oscillates with half periods of {half:.3g} s", f"{least:g} to {most:g} s are allowed"
            raise self.error(f"{seen}, {allowed}: is the unit of time right?", self.line, self.column_of(of))
        return values

    def current(self) -> Array:
        """The measured current [A], or what else drives: a voltage [V], a force [N], a torque [N m]."""
        column = self.column_of("u")
        reach, (least, most) = float(np.abs(column.values).max()), _DRIVEN_BY[column.quantity]
        if reach > 0.0 and not least <= reach <= most:
            raise self._beyond(column, f"a drive reaches {least:g} to {most:g} {SI[column.quantity]}")
        return column.values

    def driving_current(self) -> Array:
        """The same; HopformError if it never changes, so that nothing of the motor can be identified."""
        values = self.current()
        if float(np.ptp(values)) == 0.0:
            raise self.error_of("u", f"is constant at {values[0]:.6g}: record its step too")
        return values

    def with_late_current(self, delay: float) -> "Recording":
        """The same with its current later by a delay [s], the first one before, linear between samples."""
        column = self.column_of("u")
        late = column._replace(values=np.interp(self.time - delay, self.time, column.values))
        return replace(self, columns={name: late if each is column else each for name, each in self.columns.items()})

    def has_current(self) -> bool:
        return self.found("u") is not None

    def named(self, name: str) -> Column | None:
        """The column of a coordinate or an input by its name, or None; HopformError for one that cannot be read."""
        if (key := name.lower()) in self.unfit:
            raise self.unfit[key]
        return self.columns.get(key)

    def in_unit(self, name: str, unit: str) -> Column | None:
        """The column of a name in a unit that is not known here, or None."""
        key = f"{name}_{unit.replace(' ', '')}".lower()
        column = self.others.get(key) or self.columns.get(name.lower())
        is_own = column is not None and column.quantity in (UNUSED, OTHER) and _spelt(column.title).lower() == key
        return column._replace(quantity=OTHER) if column is not None and is_own else None

    def found(self, of: str) -> Column | None:
        """The column of x1, x2 or the current u, or None; HopformError for one that cannot be read."""
        name = next((name for name in TITLES[of] if name in self.columns or name in self.unfit), "")
        if name in self.unfit:
            raise self.unfit[name]
        return self.columns.get(name)

    def column_of(self, of: str) -> Column:
        """The column of the measured x1, x2 or current u; HopformError if there is none."""
        what, quantities = ("a current", DRIVES) if of == "u" else (f"a position {of}", _MOST_WAY)
        column = self.found(of)
        if column is None:
            advice = f"one must be named {' or '.join(TITLES[of])}, with its unit"
            raise self.error(f"no column is {what}: {advice}; there are {self.titled()}", self.head)
        if column.quantity not in quantities:
            raise self.error(f"is to be {what}, but its unit is that of a {column.quantity}", self.head, column)
        return column

    def titled(self) -> str:
        """The names of its columns, and what was left out, as a list in an error."""
        left_out = [note for note in self.notes if note.startswith(_LEFT_OUT)]
        return "; ".join([", ".join(column.title for column in self.columns.values()) or "none", *left_out])

    def units(self, of: str, *, driven: bool = True) -> Units:
        """The units of x1 or x2, and of what drives it, A if nothing does."""
        drive = self.found("u") if driven else None
        position = "m" if self.column_of(of).quantity == "length" else "rad"
        return Units(position, DRIVES.get(drive.quantity, "A") if drive else "A")

    def error(self, message: str, line: int | None = None, column: Column | None = None) -> HopformError:
        """An error that says where it is."""
        return fault(self.source, message, line, column.title if column else None)

    def error_of(self, of: str, message: str, sample: int = 0) -> HopformError:
        """An error about the measured x1, x2 or current u at a sample."""
        return self.error(message, self.line_of(sample), self.column_of(of))

    def _beyond(self, column: Column, allowed: str) -> HopformError:
        """The error about values that are too large or too small, at the largest."""
        worst = int(np.abs(column.values).argmax())
        message = f"reaches {column.values[worst]:.6g} {SI[column.quantity]}; {allowed}: is its unit right?"
        return self.error(message, self.line_of(worst), column)


def units_of(recordings: Sequence[Recording], quantity: str, *, driven: bool) -> Units:
    """The units of recordings that are fitted together; HopformError where they differ. driven: by what drives too."""
    units_by_recording = [each.units(quantity, driven=driven) for each in recordings]
    for recording, units in zip(recordings, units_by_recording, strict=True):
        if units != units_by_recording[0]:
            ours, first = (" by ".join(one if driven else one[:1]) for one in (units, units_by_recording[0]))
            raise recording.error(f"is in {ours}, {recordings[0].source} in {first}: one fit takes one of them")
    return units_by_recording[0]


def read_recording(path: str | Path, *, added_mass: float = 0.0) -> Recording:
    """The recording in a CSV file, in SI units; HopformError names file, line and column of what is wrong.

    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "drop.csv"
    >>> rows = ["time_ms,x2_mm"] + [f"{5 * n},{400 - n * n / 4}" for n in range(30)]
    >>> _ = path.write_text("\\n".join(rows))
    >>> recording = read_recording(path)
    >>> round(float(recording.time[-1]), 3), round(float(recording.position("x2")[2]), 4)
    (0.145, 0.399)
    """
    file = path_of("path", path)
    return parse_recording(read_text(file), name_of(file), added_mass)


def parse_recording(text: str, source: str, added_mass: float = 0.0) -> Recording:
    """The recording in a CSV text; source is what errors call it."""
    mass = finite("added_mass", added_mass, "kg", 0.0)
    body, separator = _separated(text, source)
    rows, remarks = list[tuple[int, list[str]]](), list[str]()
    for line, row in rows_of(body, source, separator):
        if row[0].lstrip().startswith("#"):
            remarks.append(printable(separator.join(row).strip().lstrip("# ")))
        else:
            rows.append((line, row))
    if not rows:
        raise HopformError(f"{source}: is empty")
    head_line, titles, quantities, unfit = _head(rows, source)
    cut = rows.pop()[0] if len(rows) > 2 and _is_cut(rows[-1][1], rows[-2][1]) else None
    if len(rows) < FEWEST:
        last = rows[-1][0] if rows else head_line
        raise fault(source, f"ends after {len(rows)} samples, at least {FEWEST} are needed", last)
    used = {name: place for place, (name, quantity, _) in enumerate(quantities) if quantity != UNUSED}
    cells = [_cells(row, titles, used.values(), source, line) for line, row in rows]
    columns, others = dict[str, Column](), dict[str, Column]()

    def numbers(place: int, factor: float) -> Array:
        """The numbers of a column; HopformError for the first cell that is none."""
        comma = separator != "," and not any("." in row[place] for row in cells)
        lines_of = zip(rows, cells, strict=True)
        values = [_number(row[place], comma, source, line, titles[place]) for (line, _), row in lines_of]
        return factor * np.array(values, dtype=float)

    for place, (name, quantity, factor) in enumerate(quantities):
        if quantity != UNUSED and used[name] == place:
            try:
                columns[name] = Column(titles[place], quantity, place + 1, numbers(place, factor))
            except HopformError as error:
                unfit.setdefault(name, error)
        elif quantity == UNUSED and "_" in name:
            with suppress(HopformError):  # a column that no fit uses may hold anything
                others.setdefault(name, Column(titles[place], UNUSED, place + 1, numbers(place, 1.0)))
    columns = {name: each for name, each in columns.items() if name not in unfit}
    clock = _clock(columns, unfit, source, head_line)
    lines = [line for line, _ in rows]
    rest = {name: each for name, each in columns.items() if name not in TIMES}
    read = Recording(source, clock.values, rest, lines, mass, (), tuple(remarks), head_line,
                     sha256(text.encode("utf-8", "surrogatepass")).hexdigest(), unfit, others).of_columns([clock])  # fmt: skip
    time = _time(read, clock)
    unused = [title for title, (_, quantity, _) in zip(titles, quantities, strict=True) if quantity == UNUSED and title]
    left_out = [f"{_LEFT_OUT}{', '.join(map(shown, unused))}"] if unused else []
    left_out += [f"line {cut} is cut short, so left out"] if cut else []
    return replace(read, time=time, notes=(*remarks, *_notes(time, read.columns), *read.notes, *left_out))


_LEFT_OUT = "without a known unit, so left out: "


def used_after_all(notes: Sequence[str], title: str) -> tuple[str, ...]:
    """The notes of a recording, of which a fit uses a column that was left out."""
    kept = list[str]()
    for note in notes:
        titles = note.removeprefix(_LEFT_OUT).split(", ") if note.startswith(_LEFT_OUT) else []
        rest = [each for each in titles if each != shown(title)]
        if rest or not titles:
            kept.append(f"{_LEFT_OUT}{', '.join(rest)}" if titles else note)
    return tuple(kept)


SEPARATORS = ",;\t|"
"""What may separate columns; the first one counts where the names do not tell."""
_SEPARATOR = re.compile(r"\ufeff?sep=([,;\t|])[ \t]*(?=\r?\n)", re.IGNORECASE)
"""A first line that tells a spreadsheet what separates columns."""


def _separated(text: str, source: str) -> tuple[str, str]:
    """A text whose line `sep=` is blank, and what separates its columns: what that line says, else that by which the
    first line has a time and the most names.
    """
    if (given := _SEPARATOR.match(text)) is not None:
        return text[given.end() :], given[1]
    head = next((line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")), "")

    def told(separator: str) -> tuple[bool, int]:
        titles = next((row for _, row in rows_of(head, source, separator)), list[str]())
        names = {part for title in titles for part in (_spelt(title).lower(), _spelt(title).lower().rpartition("_")[0])}
        return not names.isdisjoint(TIMES), len(titles)

    return text, max(SEPARATORS, key=told)


_BRACKETS = re.compile(r"(.*?)\s*[(\[]\s*([^()\[\]]*?)\s*[)\]]")
"""A title with its unit in brackets, or a unit alone."""


def _head(
    rows: list[tuple[int, list[str]]], source: str
) -> tuple[int, list[str], list[tuple[str, str, float]], dict[str, HopformError]]:
    """The line of the names, these as they stand, and of each column its name, quantity and factor, then by names what is
    wrong with them; it is taken off the rows, as a line of units below it.
    """
    line, head = rows.pop(0)
    titles = [title.strip() for title in head]
    if all(number_of(title) is not None for title in titles):
        raise fault(source, f"the first line must name the columns, as in time_s,x2_mm, got {shown(titles[0])}", line)
    spelt = [_spelt(title) for title in titles]
    units = [_spelt(cell).lstrip("_") for cell in rows[0][1]] if rows else []
    if len(units) == len(titles) and any(map(unit_of, units)) and all(number_of(each) is None for each in rows[0][1]):
        del rows[0]
        spelt = [f"{name}_{unit}" if unit else name for name, unit in zip(spelt, units, strict=True)]
    columns, lacks, doubles = [_title(each) for each in spelt], dict[str, HopformError](), dict[str, HopformError]()
    good = dict[str, str]()
    for n, (title, (name, quantity, _)) in enumerate(zip(titles, columns, strict=True)):
        if quantity != UNUSED and name in good:
            doubles[name] = fault(source, f"{good[name]!r} is named {name} too", line, title)
        elif quantity != UNUSED:
            good[name] = title
        elif (named := next((each for each in (name, name.rpartition("_")[0]) if each in _NAMED), "")) != "":
            lacks.setdefault(named, _without_unit(title, spelt, source, line, n))
    return line, titles, columns, {name: each for name, each in lacks.items() if name not in good} | doubles


def _spelt(title: str) -> str:
    """A title as name_unit, whether its unit is in brackets or not."""
    match = _BRACKETS.fullmatch(title.strip())
    name, unit = (match[1], f"_{match[2]}") if match else (title.strip(), "")
    return (name.replace(" ", "_") + unit.replace(" ", "")).translate(_SIGNS)


_SIGNS = {ord("\N{MICRO SIGN}"): "u", ord("\N{GREEK SMALL LETTER MU}"): "u", ord("\N{DEGREE SIGN}"): "deg"}
"""Signs of units in the letters of `COLUMNS`."""


def _is_cut(row: Sequence[str], before: Sequence[str]) -> bool:
    """Whether a last line is one that a logger could not end: shorter than the one before, or without its number."""
    last = len(before) - 1
    return len(row) <= last or (number_of(before[last]) is not None and number_of(row[last]) is None)


def _title(spelt: str) -> tuple[str, str, float]:
    """Name, quantity and factor of a column by its title as name_unit; `UNUSED` without a unit that is known."""
    name, _, unit = spelt.rpartition("_")
    unit_in_si = unit_of(unit)
    if not name or unit_in_si is None:
        return spelt.lower(), UNUSED, 1.0
    if name.endswith("_counts") and COUNTS.fullmatch(unit):
        name = name.removesuffix("_counts")
    return name.lower(), *unit_in_si


def _without_unit(title: str, spelt: Sequence[str], source: str, line: int, place: int) -> HopformError:
    """The error about a column that a fit asks for and that has no unit."""
    return HopformError(
        f"{source}, line {line}, column {place + 1}: {shown(title)} has no known unit: a name ends in one "
        f"of {', '.join('_' + known for known in COLUMNS)}, or in counts of an encoder as position_4096perrev; "
        f"the line might be {shown(','.join(map(_with_unit, spelt)))}"
    )


def _with_unit(name: str) -> str:
    """A name as it should be, with the SI unit of what it may be where it has none that is known."""
    bare, _, unit = name.rpartition("_")
    if bare and unit_of(unit):
        return name
    bare = bare if bare.lower() in _NAMED else name
    units = {**dict.fromkeys(TIMES, "s"), **dict.fromkeys((*TITLES["x1"], *TITLES["x2"]), "m")}
    units |= (
        dict.fromkeys(TITLES["target"], "rad")
        | dict.fromkeys(TITLES["u"], "A")
        | {"voltage": "V", "drive_voltage": "V"}
    )
    return f"{bare}_{units[bare.lower()]}" if bare.lower() in units else name


_EMPTY = ("", "nan", "na", "n/a", "null")
"""What loggers write where there was no sample."""


def _cells(row: list[str], titles: Sequence[str], used: Iterable[int], source: str, line: int) -> list[str]:
    """The cells of a row, empty ones for columns at its end that no fit uses; HopformError for another number of them."""
    count = len(titles)
    if len(row) <= max(used, default=-1) or any(each.strip() for each in row[count:]):
        raise fault(source, f"has {len(row)} columns, the first line names {count}", line)
    return [*row[:count], *[""] * (count - len(row))]


def _number(cell: str, comma: bool, source: str, line: int, title: str) -> float:
    """The number of a cell, NaN where it is empty; comma: its decimals are behind a comma."""
    if cell.strip().lower() in _EMPTY:
        return math.nan
    number = number_of(cell.replace(",", ".") if comma else cell)
    if number is None or not math.isfinite(number):
        needed = "a number" if number is None else "finite"
        raise fault(source, f"must be {needed}, got {shown(cell.strip())}", line, title)
    return number


def _clock(columns: Mapping[str, Column], unfit: Mapping[str, HopformError], source: str, head: int) -> Column:
    """The column of the time."""
    name = next((name for name in TIMES if name in columns and columns[name].quantity == "time"), None)
    if name is not None:
        return columns[name]
    for name in TIMES:
        if name in unfit:
            raise unfit[name]
        if name in columns:
            quantity = columns[name].quantity
            raise fault(source, f"is to be the time, but its unit is that of a {quantity}", head, columns[name].title)
    raise fault(source, "no column is the time: one must be named time or t, with its unit, as in time_s", head)


def _time(read: Recording, clock: Column) -> Array:
    """The times [s] of a recording from 0 on; HopformError unless they increase as those of a logger do."""
    steps = np.diff(read.time)
    if not bool((steps > 0.0).all()):
        back = int(np.argmin(steps > 0.0)) + 1
        rising = [c.title for c in read.columns.values() if bool((np.diff(c.values) > 0.0).all())]
        hint = f"; column {rising[0]!r} does: are the two swapped?" if rising else ""
        still = steps[back - 1] == 0.0
        went = "stands still" if still else "goes back"
        cure = ": write it with more digits, or leave out all but one sample of a time" if still and not rising else ""
        before, after = read.time[back - 1 : back + 1].tolist()
        words = f"time {went}, from {before!r} to {after!r} s; it must increase{hint}{cure}"
        raise fault(read.source, words, read.line_of(back), clock.title)
    if not 2e-5 <= float(np.median(steps)) <= 0.5:
        words = f"samples are {float(np.median(steps)):.3g} s apart, 2e-05 to 0.5 s are allowed: is its unit right?"
        raise fault(read.source, words, read.line_of(1), clock.title)
    return np.asarray(read.time - read.time[0])


def runs(values: NDArray[Any]) -> list[tuple[int, int]]:
    """Spans of neighbours that are equal, end exclusive."""
    return list(pairwise([0, *(np.flatnonzero(values[1:] != values[:-1]) + 1).tolist(), values.size]))


def quantum_of(values: Array) -> float:
    """The encoder's step, of which all differences are multiples; 0 if there is none to be seen."""
    steps = np.unique(np.round(np.abs(np.diff(values)), 12))
    steps = steps[steps > 0.0]
    if steps.size == 0 or steps.size > 0.5 * values.size:
        return 0.0
    smallest = float(steps[0])
    counts = steps[steps < 50.0 * smallest] / smallest
    return smallest if bool((np.abs(counts - np.round(counts)) < 0.02 * np.maximum(counts, 1.0)).all()) else 0.0


def noise_of(values: Array) -> float:
    """Standard deviation of what cannot be a motion: third differences, whose noise is sqrt(20) times that of a
    sample.
    """
    third = np.diff(values, 3)
    return float(np.median(np.abs(third - np.median(third)))) / (0.6745 * math.sqrt(20.0)) if third.size else 0.0


def half_period(time: Array, values: Array) -> float:
    """Time [s] from one crossing of the middle to the next, the median; NaN for fewer than three crossings."""
    smooth = calm(values)
    noise = 4.0 * max(noise_of(values), quantum_of(values))
    left = smooth - 0.5 * (smooth.max() + smooth.min())
    sides = np.sign(left[np.abs(left) > noise])
    crossings = time[np.abs(left) > noise][1:][sides[1:] != sides[:-1]]
    return float(np.median(np.diff(crossings))) if crossings.size >= 3 else math.nan


def calm(values: Array, reach: int = 2, ends: Literal["edge", "reflect"] = "edge") -> Array:
    """Running medians of five, or of a reach either way: what single outliers do not move; of seven, reflected at the
    ends, what up to three outliers in a row do not move, nor one at an end.
    """
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(values, reach, mode=ends), 2 * reach + 1)
    return np.asarray(np.median(windows, axis=1))


def outliers(values: Array) -> NDArray[np.bool_]:
    """Which samples are off the median of their seven neighbours, beyond noise and beyond what a motion does in three
    samples.

    The rest is looked at once more without those found, since several close together hide each other. None of a few
    samples is.
    """
    rest, flags = np.arange(values.size), np.zeros(values.size, dtype=bool)
    for _ in range(2):
        if rest.size < FEWEST:
            break
        some = values[rest]
        travel = float(np.percentile(np.abs(np.diff(some)), 75.0))
        off = np.abs(some - calm(some, 3, "reflect")) > max(3.0 * travel, 6.0 * noise_of(some), 6.0 * quantum_of(some))
        flags[rest[off]], rest = True, rest[~off]
    return flags


_REST, _KEPT = 8, 4
"""Samples in a row within one quantum from which on they are one measurement; how many of them count at either end."""


def independent(values: Array) -> NDArray[np.bool_]:
    """Which samples are measurements of their own. What rests within one quantum is measured once, off by up to half of
    it, however many samples say so: of each rest the first and last few are left.
    """
    kept, quantum = np.full(values.size, True), 1.01 * quantum_of(values)
    begin, low, high = 0, math.inf, -math.inf
    for n, value in enumerate([*values.tolist(), math.inf] if quantum > 0.0 else []):
        low, high = min(low, value), max(high, value)
        if high - low > quantum:
            if n - begin >= _REST:
                kept[begin + _KEPT : n - _KEPT] = False
            begin, low, high = n, value, value
    return kept


def mended(values: Array) -> Array:
    """The values with the median of their neighbours in place of each outlier."""
    return np.where(outliers(values), calm(values, 3, "reflect"), values)


def saturated(values: Array, least: int = 8) -> tuple[int, int] | None:
    """First and last sample of the longest stay at an extreme that noise does not explain, or None."""
    for extreme in (values.max(), values.min()) if noise_of(values) > 0.0 else ():
        at = np.abs(values - extreme) <= 1e-12 * max(abs(float(extreme)), 1.0)
        begin, end = max((span for span in runs(at) if at[span[0]]), key=lambda span: span[1] - span[0])
        if end - begin >= least:
            return begin, end - 1
    return None


def flat_top(recording: Recording) -> tuple[int, int] | None:
    """First and last sample of a stay of x1 at an extreme that begins at speed, under a large current: a stop, where a
    spring would have slowed it down. None if there is none.
    """
    x, u = calm(recording.position("x1"), 3), np.abs(recording.current())
    near = 4.0 * max(noise_of(x), quantum_of(x)) + 1e-3 * float(np.ptp(x))
    fastest = float(np.abs(np.diff(x)).max())
    for extreme in (x.max(), x.min()):
        at = np.abs(x - extreme) <= near
        for begin, end in runs(at):
            if at[begin] and end - begin >= 8 and begin >= 4 and u[begin:end].max() >= 0.5 * u.max():
                speed = abs(float(x[begin] - x[begin - 4])) / 4.0
                if speed >= _AT_SPEED * fastest:
                    return begin, end - 1
    return None


_AT_SPEED = 0.3
"""Share of the largest speed that a mass has when it meets a stop."""


_GAP = 2.5
"""Usual steps of time beyond which one is a gap."""


def gaps_of(time: Array) -> list[tuple[float, float]]:
    """Gaps: begin and length [s] of each pause that is over 2.5 times the usual one."""
    steps = np.diff(time)
    return [(float(time[n]), float(steps[n])) for n in np.flatnonzero(steps > _GAP * float(np.median(steps)))]


def _notes(time: Array, columns: Mapping[str, Column]) -> tuple[str, ...]:
    notes = list[str]()
    gaps = gaps_of(time)
    if gaps:
        begin, length = max(gaps, key=lambda gap: gap[1])
        longest = f"the longest of {length:.4g} s after {begin - time[0]:.4g} s"
        notes.append(f"{len(gaps)} gap{'s' * (len(gaps) > 1)} in time, {longest}")
    steps = np.diff(time)
    if float(np.ptp(steps)) > 0.02 * float(np.median(steps)) and not gaps:
        notes.append(f"time stamps are uneven: {steps.min():.3g} to {steps.max():.3g} s apart")
    for column in columns.values():
        if np.isnan(column.values).any():
            continue
        least = max(2.0 * quantum_of(column.values), 3e-5 * float(np.ptp(column.values)))
        noisy = noise_of(column.values) > least  # so much that a rest shows it
        may = column.quantity in DRIVES or (column.quantity in _MOST_WAY and noisy)
        if may and (stay := saturated(column.values)) is not None:
            notes.append(f"{column.title} stays at its limit from sample {stay[0] + 1} to {stay[1] + 1}")
    return tuple(notes)


def whole_spans(recording: Recording) -> list[tuple[int, int]]:
    """Spans of samples, end exclusive, without a gap in time; what is too short to be fitted is left out."""
    return _spans(recording, np.full(recording.time.size - 1, True), "")


def known_spans(recording: Recording) -> list[tuple[int, int]]:
    """Those in which the current is known: a gap over which it changes parts them."""
    return _spans(recording, np.diff(recording.current()) != 0.0, ", and over each the current changes")


def _spans(recording: Recording, parts: NDArray[np.bool_], why: str) -> list[tuple[int, int]]:
    steps = np.diff(recording.time)
    broken = (steps > _GAP * float(np.median(steps))) & parts
    ends = [0, *(np.flatnonzero(broken) + 1).tolist(), recording.time.size]
    spans = [(begin, end) for begin, end in pairwise(ends) if end - begin >= FEWEST]
    if not spans:
        raise recording.error(f"between its gaps there are never {FEWEST} samples{why}", recording.line)
    return spans


def steps_of(recording: Recording, start: int = 0, end: int | None = None) -> Steps:
    """The measured current of samples start to end as steps from t = 0 on: one holds until the next; equal neighbours
    are one.
    """
    time, u = recording.time[start:end], recording.current()[start:end]
    if time.size > records.MOST_STEPS:
        every = -(-time.size // records.MOST_STEPS)
        most = f"a fit in position takes up to {records.MOST_STEPS}"
        cure = f"keep every {every}{'nd' if every == 2 else 'rd' if every == 3 else 'th'} sample, or cut it"
        raise recording.error_of("x1", f"has {time.size} samples; {most}: {cure}", start + records.MOST_STEPS)
    return current_steps(time, u)


def current_steps(time: Array, u: Array) -> Steps:
    """Samples of a current as steps from t = 0 on."""
    starts = np.concatenate([[True], u[1:] != u[:-1]])
    return tuple(zip((time[starts] - time[0]).tolist(), u[starts].tolist(), strict=True))
