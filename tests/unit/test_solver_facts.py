"""The facts of a solver, solver.toml: they say of a package what the package itself says, and are read before it."""

import sys
import tomllib
from functools import cache
from pathlib import Path

import pytest

from derive.emit import c
from derive.emit.facts import abilities, facts
from derive.emit.toml import toml
from derive.model import selftest
from derive.model.equations import Model
from derive.model_file import read_model
from derive.shipped import HOPPER
from hopform_solver import LAYOUT, VERSION, elements, records
from tests.derived import built, model_file, model_of, solver_of

ROOT = Path(__file__).resolve().parents[2]
SOUND = ("back_emf", "further_forces", "joint", "leg_damper", "rig", "second_spring")


@cache
def model(name: str) -> Model:
    return HOPPER if name == "hopper" else read_model(model_file(name))


def of_package(known, package_records, package_elements) -> None:
    """Parameters, events, ledger and outputs of the facts are those of the package, in its order."""
    fields = [
        (f["name"], f["glyph"], f["unit"], f["domain"], f["meaning"], f.get("default")) for f in known["parameters"]
    ]
    assert fields == [tuple(field) for field in package_records.ROBOT_FIELDS]
    limits = [(f["name"], f["glyph"], f["unit"], f["domain"], f["meaning"], f.get("default")) for f in known["limits"]]
    assert limits == ([tuple(package_records.TRAVEL)] if "stance" in known["can"] else [])
    events = [event for element in known["elements"] for event in element.get("events", {})]
    assert sorted(events) == sorted(package_records.EVENTS.values())
    entries = [entry for element in known["elements"] for entry in element["ledger"]]
    assert sorted(entries) == sorted(package_records.Ledger._fields)
    assert [each["name"] for each in known["outputs"]] == list(package_elements.ROWS)
    axes = {each["axis"] for each in known["coordinates"]}
    assert axes == ({*package_records.LegState._fields, "x2"} if "stance" in known["can"] else {"x1", "v1"})


def test_the_facts_of_the_hopper_are_those_of_its_package():
    known = tomllib.loads((ROOT / "generated" / "solver.toml").read_text("utf-8"))
    of_package(known, records, elements)
    assert (known["format"], known["name"], known["layout"], known["version"]) == (3, "hopper", LAYOUT, VERSION)


def test_the_facts_of_a_derived_model_are_those_of_its_package(store):
    folder, package = built(store, "leg_damper"), solver_of(store, "leg_damper").Robot.solver.package
    known = tomllib.loads((folder / "solver.toml").read_text("utf-8"))
    of_package(known, package.records, package.elements)
    assert (known["name"], known["layout"]) == ("leg_damper", sys.modules[package.name].LAYOUT)
    assert known["title"].startswith("A damper between the masses")
    compiled = {path.relative_to(folder).as_posix() for path in (folder / "c" / "src").glob("*.c")}
    assert compiled == {*known["build"]["sources"]}
    assert {*known["build"]["notes"]} == {"c/notes/notes_f32.c", "c/notes/notes_f64.c", "c/src/version.c"}


@pytest.mark.parametrize("name", ["hopper", *SOUND])
def test_the_facts_of_every_model_are_data_that_reads_back(name):
    known = facts(model(name), "0" * 16, {"sources": ["c/src/version.c"]})
    assert tomllib.loads(toml(known)) == known


@pytest.mark.parametrize("name", ["hopper", *SOUND])
def test_each_parameter_belongs_to_an_element(name):
    known = facts(model(name), "", {})
    there = {each["name"] for each in known["elements"]}
    assert all(parameter["element"] in there for parameter in known["parameters"])


def element_of(name: str, parameter: str) -> str:
    return next(each["element"] for each in facts(model(name), "", {})["parameters"] if each["name"] == parameter)


def test_a_parameter_of_a_further_element_belongs_to_it():
    assert element_of("leg_damper", "b12") == "damper"
    assert element_of("second_spring", "L_2") == "second spring"
    assert element_of("joint", "F_minus") == "joint"
    assert element_of("joint", "load") == "load"


def test_what_a_model_can_follows_from_its_elements():
    every = ["motion", "fit", "batches", "derivatives", "plots", "export"]
    standing = ["stance", "flight", "hop"]
    everything = [*every, *standing, "command", "reach", "identify"]
    leg = facts(model("leg_damper"), "", {})
    assert facts(HOPPER, "", {})["can"] == everything
    assert leg["can"] == everything[:-1] and "viscous 'damper'" in leg["lacks"]["identify"]
    rig, joint = facts(model("rig"), "", {}), facts(model("joint"), "", {})
    assert rig["can"] == joint["can"] == every
    assert all(known["lacks"].keys() == {*everything} - {*every} for known in (rig, joint))
    assert [*abilities(joint)][1:] == ["No stance, flight or hop: the model has no contact()."]
    assert all("contact" not in known and "flight" not in known for known in (rig, joint))
    alone = facts(model_of(BODY), "", {})
    assert alone["can"] == [*every, *standing] and alone["lacks"]["command"] == "a current()"
    assert [*abilities(alone)][1].startswith("No command or reach: the model has no current().")


BODY = """
m, k, L = (parameter(name, unit, name, "positive") for name, unit in (("m", "kg"), ("k", "N/m"), ("L", "m")))
h = coordinate("h", "m", m, "body")
gravity(h, 9.81)
contact(spring(L - h, k))
"""
"""A body on a leg, whose foot carries nothing but the spring."""


@pytest.mark.parametrize("name", sorted({*SOUND} - {"rig"}))  # all parameters of a rig are the hopper's
def test_the_selftest_of_a_model_has_its_further_parameters_act(name):
    """With all of them 0 the digest said nothing of a term, and a robot whose L_2 must be > 0 was refused in each case."""
    robot = model(name).robot
    numbers = c.values(robot, selftest.ROBOTS[0]).strip("{}").split(", ")
    assert len(numbers) == len(robot.quantities)
    known = {quantity.name for quantity in HOPPER.parameters}
    further = [(number, each) for number, each in zip(numbers, robot.quantities, strict=True) if each.name not in known]
    assert further and all(float(number) in each.interval and float(number) for number, each in further)
