"""What a model's file does not declare is nowhere: each fact, formula, column and entry has an element that brings it, and
each element has its own. Read from the declarations of the file, not from what is made of them.
"""

import csv
import io
import json
import re
import tomllib
from functools import cache, cached_property
from pathlib import Path
from runpy import run_path
from typing import Any

import pytest
import sympy as sp

from derive.derivation import Derivation
from derive.emit.render import render
from derive.model import mechanism
from derive.model.declare import DeclaredCoordinate, Draft, Element, drafted
from derive.model.mechanism import field_name
from derive.page import page
from hopform._cli import output, tables
from tests import needs
from tests.derived import MODELS, SHIPPED, solver_of

HEAD = '"""A model of a test."""\n\nfrom hopform.model import *\n\n'
MASS = 'm = parameter("m", "kg", "mass", "positive", 2)\nx = coordinate("x", "m", m, "block")\n'
SPRING = 'k = parameter("k", "N/m", "stiffness", "positive", 1500)\n'
LEG = SPRING + (
    'm = parameter("m", "kg", "mass", "positive", 2)\nL = parameter("L", "m", "length", "positive", 0.3)\n'
    'h = coordinate("h", "m", m, "trunk")\ngravity(h, 9.81)\nspring_ = spring(L - h, k)\ncontact(spring_)\n'
)
RIMS = {
    "a spring alone": SPRING + MASS + "spring(x, k)\n",
    "a force alone": MASS + "force(x, 3)\n",
    "a damper alone": MASS + "viscous(x, 1)\n",
    "friction alone": MASS + "friction(x, 1)\n",
    "a lower stop alone": MASS + "viscous(x, 1)\nstop(x, -1, None)\n",
    "an upper stop alone": MASS + "viscous(x, 1)\nstop(x, None, 1.5)\n",
    "friction and damping of 0": MASS + "viscous(x, 0)\nfriction(x, 0)\nstop(x, 0, 0)\n",
    "a law without a limit": MASS
    + 'i = current("i")\nforce(x, 2*i, "motor")\nlaw(i, x, proportional=4, derivative=1)\n',
    "two masses and a spring": SPRING
    + MASS
    + 'y_2 = coordinate("z", "m", 1, "load")\nspring(x - y_2, k)\nstop(y_2, None, 2)\nfriction(x, 1)\n',
    "a leg of one coordinate": LEG,
    "a leg of one coordinate with friction": LEG + 'friction(h, 1, where="stance")\n',
}
"""Models of the least, each with its one element."""
FILES = {path.stem: path for folder in (MODELS, SHIPPED) for path in sorted(folder.glob("[!_]*.py"))}
FIRST = ("a leg of one coordinate", "relief_valve")
NAMES = [*FIRST, *(name for name in (*RIMS, *FILES) if name not in FIRST)]
"""Of all models, those of tests/models and those that ship among them."""


class Declared:
    """The declarations of a file, by the coordinates that move; and what is made of them."""

    def __init__(self, name: str) -> None:
        with drafted() as draft:
            if name in RIMS:
                exec(compile(HEAD + RIMS[name], name, "exec"), {})  # noqa: S102
            else:
                run_path(str(FILES[name]))
        self.draft: Draft = draft
        self.model = mechanism.model_of(draft, "own", "A model of a test.", HEAD)

    @cached_property
    def derivation(self) -> Derivation:
        return Derivation(self.model)

    @cached_property
    def texts(self) -> dict[str, str]:
        """The files of its solver, by their paths."""
        return {path.as_posix(): text for path, text in render(self.model).items()}

    @cached_property
    def facts(self) -> dict[str, Any]:
        return tomllib.loads(self.texts["solver.toml"])

    @property
    def moving(self) -> dict[str, DeclaredCoordinate]:
        return {each.symbol.name: each for each in self.draft.coordinates if not each.held}

    def on(self, kind: str) -> dict[str, list[Element]]:
        """The elements of a kind that act on one coordinate that moves, by its name."""
        found: dict[str, list[Element]] = {}
        for each in self.draft.elements:
            symbols = {symbol.name for symbol in each.on.free_symbols} & self.moving.keys()
            if each.kind == kind and len(symbols) == 1:
                found.setdefault(symbols.pop(), []).append(each)
        return found

    @property
    def forces(self) -> dict[str, list[Element]]:
        kinds = [self.on(kind) for kind in ("force", "torque")]
        return {name: [each for kind in kinds for each in kind.get(name, [])] for name in self.moving}

    @property
    def is_driven(self) -> bool:
        inputs = {each.symbol for each in self.draft.currents}
        return any(each.values["value"].free_symbols & inputs for forces in self.forces.values() for each in forces)

    @property
    def stops(self) -> dict[str, dict[str, sp.Expr]]:
        """The ends that a file gives, by coordinate."""
        return {
            name: {end: each.values[key] for each in elements for end, key in (("lower", "low"), ("upper", "high"))
                   if each.values[key] is not None}
            for name, elements in self.on("stop").items()
        }  # fmt: skip


declared = cache(Declared)


def numbered(found: set[str], pattern: str) -> set[int]:
    """The numbers of the masses in names of a pattern."""
    return {int(match[1]) for name in found if (match := re.fullmatch(pattern, name))}


def masses(one: Declared) -> dict[int, str]:
    """The coordinates that move, by the numbers of their masses."""
    return {n: own.coordinate for n, own in enumerate(one.model.names, 1) if own is not None}


@pytest.mark.parametrize("name", needs.the_first(NAMES, 2))
def test_formulas_are_those_of_the_coordinates_that_move(name):
    one = declared(name)
    formulas = {each.name: each for each in one.derivation.formulas}
    assert sorted(masses(one).values()) == sorted(one.moving)
    assert numbered(formulas.keys(), r"acc_(\d)") == masses(one).keys()
    named = {each.removesuffix("_free_acceleration") for each in formulas if each.endswith("_free_acceleration")}
    assert named == {*masses(one).values()}
    known = {*formulas, *(each.name for each in one.model.parameters)}
    known |= {"s", "t", "side_1", "side_2", "height", "step", "aed", "h_des", "x1_T"}
    for own in one.model.names:
        known |= (
            {f"{each}{index}" for each in (own.coordinate, own.velocity) for index in ("", "_0", "_0_")}
            if own
            else set()
        )
    known |= {each.symbol.name for each in one.draft.currents} | {each.target for each in one.draft.laws}
    known |= {f"{each}_" for each in known}
    stores = any(each.kind in ("spring", "gravity") for each in one.draft.elements)
    assert ("potential" in formulas) == stores
    for n, q in masses(one).items():
        acts = [each for each in one.draft.elements if q in map(str, each.on.free_symbols)]
        pushes = any(each.kind in ("force", "torque", "friction", "viscous") for each in acts)
        assert (f"force_{n}" in formulas) == pushes or len(
            [each for each in acts if each.kind in ("spring", "gravity")]
        ) > 1
    for each in one.derivation.formulas:
        assert {symbol.name for symbol in each.value.free_symbols} <= known, each
        for word in ("actuator", "body"):
            has = any(own is not None and own.thing == word for own in one.model.names)
            assert has or not re.search(rf"\b{word}\b", each.quantity.meaning), each


@pytest.mark.parametrize("name", needs.the_first(NAMES, 2))
def test_event_functions_are_those_of_friction_stops_and_limits_that_a_file_has(name):
    one = declared(name)
    functions = one.derivation.event_functions
    friction, coordinates = one.on("friction"), masses(one)
    levels = {each.removesuffix("_coulomb_level") for each in functions if each.endswith("_coulomb_level")}
    assert levels == {q for q in coordinates.values() if q in friction}
    assert ("contact_force" in functions) == any(each.kind == "contact" for each in one.draft.elements)
    wanted = {f"{q}_{end}_stop": (q, end, at) for q, ends in one.stops.items() for end, at in ends.items()}
    assert {each for each in functions if each.endswith("_stop")} == wanted.keys()
    for function, (q, end, at) in wanted.items():
        away = sp.Symbol(q) - sp.Symbol("at")
        distance = (away if end == "lower" else -away).subs(sp.Symbol("at"), at)
        names = {symbol: sp.Symbol(symbol.name) for symbol in at.free_symbols}
        assert sp.nsimplify(functions[function] - distance.xreplace(names)) == 0
    has_law = bool(one.draft.laws)
    limited = has_law and one.draft.currents[0].limit is not None
    assert {"room_up", "room_down"} & functions.keys() == ({"room_up", "room_down"} if limited else set())
    text = page(one.derivation)
    assert all(f"`{function}`" in text for function in wanted)


@pytest.mark.parametrize("name", needs.the_first(NAMES, 2))
def test_runs_of_hops_are_those_of_a_file_with_a_contact(name):
    one = declared(name)
    has_contact = any(each.kind == "contact" for each in one.draft.elements)
    assert any(Path(path).name.startswith("hops_") for path in one.texts) == has_contact
    assert any(re.search("solve_hops|hops_in|HOPFORM_RUN_", text) for text in one.texts.values()) == has_contact


USUAL = ("viscous friction", "Coulomb friction", "motor")
"""Names that an element has where a file gives it no other, and that of the input's force of the hopper."""


def named(elements: list[Element], usual: str, behind: str) -> str:
    """The entry of elements of one kind: under the name of the one that has a name of its own; "" without an element."""
    names = list(dict.fromkeys(each.name for each in elements))
    has_own = len(names) == 1 and names[0] not in USUAL
    return f"{field_name(names[0])}_{behind}" if has_own else usual if names else ""


@pytest.mark.parametrize("name", needs.the_first(NAMES, 2))
def test_each_entry_of_the_ledger_has_the_element_that_does_its_work(name):
    one = declared(name)
    known = {entry: each for each in one.facts["elements"] for entry in each["ledger"]}
    coordinates, has_contact = masses(one), any(each.kind == "contact" for each in one.draft.elements)
    inputs = {each.symbol for each in one.draft.currents}
    driven = [each for forces in one.forces.values() for each in forces if each.values["value"].free_symbols & inputs]
    carried = {
        *(named(one.on("viscous").get(q, [])[:1], f"viscous_{n}", str(n)) for n, q in coordinates.items()),
        *(named(one.on("friction").get(q, []), f"coulomb_{n}", str(n)) for n, q in coordinates.items()),
        named(driven, "motor_work", "work"),
        "stop_loss" if one.stops else "",
        "spring_work" if len(coordinates) == 2 and has_contact else "",  # x_1 counts from the ground there alone
    } - {""}
    assert carried <= known.keys()
    kinds = ("viscous", "spring", "force", "torque", *(["gravity"] if has_contact else []))
    names = {field_name(each.name) for each in one.draft.elements if each.kind in kinds}
    others = known.keys() - carried - {"offset_work"}
    assert {entry.rpartition("_")[0] for entry in others} <= names
    constant = [each for forces in one.forces.values() for each in forces
                if each.values["value"].subs({i.symbol: 0 for i in one.draft.currents}) != 0]  # fmt: skip
    of_forces = [entry for entry in others if entry.rpartition("_")[0] in {field_name(each.name) for each in constant}]
    assert len(of_forces) + ("offset_work" in known) == len(constant)
    package = one.texts["python/hopform_solver/records.py"]
    fields = re.search(r"\nclass Ledger\(.*?\n(?=\n\n|\Z)", package, re.DOTALL)
    assert fields is not None and {*re.findall(r"^    (\w+): Value$", fields[0], re.MULTILINE)} == known.keys()


@pytest.mark.parametrize("name", needs.the_first(NAMES, 2))
def test_facts_of_a_mass_are_those_of_its_elements(name):
    one = declared(name)
    friction = one.on("friction")
    found = {each["velocity"]: each for each in one.facts["elements"] if each["kind"] == "mass"}
    assert found.keys() == {each.velocity for each in one.moving.values()}
    for q, each in one.moving.items():
        facts, stops = found[each.velocity], one.stops.get(q, {})
        assert facts["stops"] == {end: str(sp.nsimplify(at)) for end, at in stops.items()}
        assert (f"{q}_hits_stop" in facts["events"]) == bool(stops)
        assert bool(facts["friction"]) == (q in friction)
        assert not facts["excess"] or any(
            made.values[f"{way}_at_rest"] != made.values[way] for made in friction[q] for way in ("forward", "backward")
        )


@pytest.mark.parametrize("name", needs.the_first(NAMES, 2))
def test_no_number_stands_for_what_there_is_not(name):
    """Neither a large one for a limit nor infinity in a fact; a coordinate without an end has an infinite range."""
    one = declared(name)
    assert all(value.is_infinite or abs(value) < 10**20 for value in one.model.constants.values() if value.is_number)
    files = ("solver.toml", "c/src/formulas_f64.h", "python/hopform_solver/formulas.py")
    for text in (*(one.texts[file] for file in files), page(one.derivation)):
        assert not re.search(r"1e\+?30|10{20,}|\boo\b|\bzoo\b", text)
    has_stops = f"#define HOPFORM_HAS_STOPS {int(bool(one.stops))}\n"
    assert has_stops in one.texts["c/src/facts.h"]


SOLVED = {
    "a leg of one coordinate": ("v2", -1.5),
    "a spring alone": ("x", 0.25),
    "an upper stop alone": ("v", 2.0),
    "a damper alone": ("v", 2.0),
}


@needs.library
@pytest.mark.parametrize("name", needs.the_first([*SOLVED], 0))
def test_a_motion_has_the_columns_and_entries_of_what_is_declared(store, name, monkeypatch, capsys):
    one, (axis, value) = declared(name), SOLVED[name]
    file = store / f"absent_{name.replace(' ', '_')}.py"
    file.write_text(HEAD + RIMS[name], "utf-8")
    solver = solver_of(store, file)
    robot = solver.Robot()
    if axis == "v2":
        motion: Any = solver.solve_stance(robot, v2=value)
        text = tables.stance_csv(motion, 5)
    else:
        motion = solver.solve_motion(robot, start={axis: value})
        text = tables.motion_csv(motion, 5)
    stops, friction = one.stops, one.on("friction")
    wanted = {f"friction_{q}" for q in friction} | {f"stop_{q}" for q in stops}
    forces = motion.forces(0.0).keys() - {"contact"}
    assert forces == wanted | ({"input"} if one.is_driven else set())
    columns = next(csv.reader(io.StringIO(text)))
    assert wanted <= {*columns} or axis == "v2"
    assert not {"x1", "v1"} & {*columns} or "x1" in one.moving
    known = {entry for each in one.facts["elements"] for entry in each["ledger"]}
    assert {*motion.ledger(motion.duration)._fields} == known
    work = sum(float(each) for own in motion.ledger_by_element(motion.duration).values() for each in own.values())
    gain = float(motion.total_energy(motion.duration) - motion.total_energy(0.0))
    assert work == pytest.approx(gain, abs=1e-12)
    monkeypatch.setattr("hopform._cli.output.core", lambda: solver.Robot.solver)
    assert json.loads(tables.motion_json(motion))["total_energy"][0] == pytest.approx(float(motion.total_energy(0.0)))
    output.show(tables.motion(motion))
    labels = [label for each in one.facts["elements"] for label in each["ledger"].values()]
    of_ledger = capsys.readouterr().out.partition("Energy ledger")[2]
    assert all(of_ledger.count(label) == 1 for label in labels)
    assert ("E [J]" in of_ledger) == ("AED" in of_ledger) == (axis == "v2")
    explained = motion.explain()
    assert ("monotone: its end decides" in explained) == bool(stops or axis == "v2")
