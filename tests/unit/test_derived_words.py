"""What the derivation says of a model is in the words, glyphs and units of its file, and the hopper keeps the paper's."""

import ast
import re
import tomllib
from functools import cache

import pytest

from derive.derivation import Derivation, derive
from derive.emit.facts import facts
from derive.emit.forms import FORMS
from derive.emit.program import program
from derive.emit.render import render
from derive.model import quantities as Q
from derive.model import words
from derive.model.declare import glyph_of
from derive.model.equations import Model
from derive.page import page
from tests.derived import MODELS, hopper_with, model_of
from tests.needs import the_first

STRANGERS = ("door", "relay", "tendon")
OF_HOPPER = ("leg", "body", "hopper", "touchdown", "take-off", "actuator", "compression", "AED", "x_1", "x_2")
NUMBER = r"(?<!\w)\((?:[1-9]|1\d|2[0-7])\)"


@cache
def stranger(name: str) -> Derivation:
    return derive(MODELS / f"{name}.py")


@cache
def texts(name: str) -> dict[str, str]:
    """The files of the solver of a stranger, or of a model that ships, by their paths."""
    return {path.as_posix(): text for path, text in render(model(name)).items()}


def model(name: str) -> Model:
    return stranger(name).model if name in STRANGERS else derive(name).model


def words_of_hopper(name: str, text: str) -> list[str]:
    """Lines that have a word of the hopper, a number of the paper or a unit per A, where the file has none of them."""
    declared = (MODELS / f"{name}.py").read_text("utf-8")
    banned = [word for word in OF_HOPPER if not re.search(rf"\b{word}\b", declared)]
    pattern = "|".join(
        (*(rf"\b{re.escape(word)}\b" for word in banned), NUMBER, *([] if "/A" in declared else [r"/A\b"]))
    )
    return [line for line in text.splitlines() if re.search(pattern, line)]


@pytest.mark.parametrize("name", the_first(STRANGERS, 1))
def test_no_form_of_a_formula_has_a_word_of_the_hopper(name):
    found = stranger(name)
    for form in FORMS:
        assert not words_of_hopper(name, found.show(form=form)), form
    assert not words_of_hopper(name, page(found))


@pytest.mark.parametrize("name", STRANGERS)
def test_no_fact_has_a_word_of_the_hopper(name):
    known = facts(stranger(name).model, "", {})
    assert not words_of_hopper(name, "\n".join(map(str, (known["coordinates"], known["inputs"], known["elements"]))))
    assert not words_of_hopper(name, "\n".join(known["lacks"].values()))


@pytest.mark.parametrize("name", STRANGERS)
def test_records_and_functions_have_no_word_of_the_hopper(name):
    made = program(stranger(name).model)
    said = [record.meaning for record in made.records]
    said += [f"{each.meaning} [{each.unit}]" for record in made.records for each in record.quantities]
    for function in made.functions:
        said += [function.meaning, *(step.source for step in function.steps)]
        said += [f"{each.meaning} [{each.unit}]" for argument in function.takes for each in argument.quantities]
    assert len(said) > 300
    assert not words_of_hopper(name, "\n".join(said))


@pytest.mark.parametrize("name", the_first(STRANGERS, 1))
def test_the_package_of_a_stranger_has_no_word_of_the_hopper(name):
    files = {path: text for path, text in texts(name).items() if path.startswith(("python/", "JSON", "schema"))}
    assert len(files) > 12
    for path, text in files.items():
        assert not words_of_hopper(name, text), path


@pytest.mark.parametrize("name", ["hopper", "cart", "relay"])
def test_the_test_finds_words_of_the_hopper(name):
    """Of the hopper all of them, of others none: the texts of the hopper are read as if they were a relay's."""
    lines = words_of_hopper("relay", page(derive("hopper") if name == "hopper" else stranger("relay")))
    assert bool(lines) == (name == "hopper")


# ---- names, glyphs, units ----


@pytest.mark.parametrize("name", STRANGERS)
def test_the_latex_has_the_glyphs_of_coordinates_and_input(name):
    found = stranger(name)
    text = found.show(form="latex")
    for own in filter(None, found.model.names):
        assert own.glyph == glyph_of(own.coordinate)
        assert f"{words.over(own.glyph, 'ddot')} = " in text and f"{own.glyph}(t) = " in text
    driven = found.model.driven_by
    assert driven is not None
    assert re.search(rf"(?<![A-Za-z]){re.escape(driven.glyph)}(?![A-Za-z])", found.latex("acc_1"))


def test_a_glyph_that_a_file_gives_stands_in_every_formula():
    found = Derivation(model_of(
        'm = parameter("m", "kg", "mass", "positive")\n'
        'lift = coordinate("lift", "m", m, "valve", glyph=r"\\zeta_{v}")\n'
        'p = current("p", "Pa", glyph=r"\\Pi", thing="line", meaning="pressure")\n'
        'A = parameter("A", "m^2", "area", "positive")\nforce(lift, A * p, "pressure")\nspring(lift, 5, "coil")\n'
    ))  # fmt: skip
    assert found.latex("acc_1") == r"\ddot{\zeta}_{v} = \frac{A \Pi - 5 \zeta_{v}}{m}"
    assert r"\dot{\zeta}_{v}(0)" in found.latex("H4_hat")
    known = facts(found.model, "", {})
    assert [each["glyph"] for each in known["coordinates"]] == [r"\zeta_{v}", r"\dot{\zeta}_{v}"]
    assert known["inputs"][0]["glyph"] == r"\Pi"


def test_a_letter_of_the_derivation_that_is_the_models_too_is_told_apart():
    assert derive("joint").latex("q_") == r"\tilde{q} = q_1"
    assert derive("hopper").latex("q") == "q = - a p + s_2"
    assert r"\ddot{q}" in derive("joint").latex("acc_1")


@pytest.mark.parametrize(
    ("name", "unit"),
    [("door", "rad/s^2/N"), ("relay", "m/s^2/V"), ("tendon", "rad/s^2/A"), ("relief_valve", "m/s^2/Pa")],
)
def test_coefficients_of_the_input_are_in_its_unit(name, unit):
    found = derive(name) if name == "relief_valve" else stranger(name)
    assert found.formula("a1_u").quantity.unit == unit
    rates = program(found.model).record("Rates")
    assert [each.unit for each in rates.quantities if each.symbol == Q.a1_u] == [unit]


def test_a_unit_that_is_a_product_is_divided_by_as_a_whole():
    found = model_of(
        'q = coordinate("q", "rad", 2)\nM = current("M", "N m", meaning="torque")\ntorque(q, M, "drive")\nspring(q, 3)\n'
    )
    assert found.unit("m/s^2/A") == "rad/s^2/(N m)"
    assert model_of('x = coordinate("x", "m", 2)\nspring(x, 3)\n').unit("m/s^2/A") == "m/s^2"


# ---- elements ----


@pytest.mark.sliced
@pytest.mark.parametrize(
    ("name", "entries", "labels"),
    [
        ("door", {"oil_1", "hinges_1", "push_work"}, {"door, oil", "door, hinges", "work of the push", "door, lost at the frame"}),
        ("relay", {"air_1", "guide_1", "pull_work"}, {"armature, air", "armature, guide", "armature, lost at the seat"}),
        ("tendon", {"knee_2", "drum_friction_1", "motor_work", "tendon_damping_1"}, {"leg, knee", "drum, drum friction"}),
        ("joint", {"viscous_1", "coulomb_1", "motor_work", "load_1"}, {"joint, viscous friction", "joint, Coulomb friction"}),
    ],
)  # fmt: skip
def test_elements_keep_their_names_in_ledger_labels_and_powers(name, entries, labels):
    known = tomllib.loads(texts(name)["solver.toml"])
    ledger = {entry: label for each in known["elements"] for entry, label in each["ledger"].items()}
    assert entries <= ledger.keys() and labels <= {*ledger.values()}
    powers = {f"{entry.removesuffix('_work')}_power" for entry in entries}
    assert powers <= Derivation(model(name)).energies.keys()
    (listed,) = re.findall(r"^LEDGER_OF_ROBOT = (.*)$", texts(name)["python/hopform_solver/records.py"], re.MULTILINE)
    assert {*ast.literal_eval(listed)} == ledger.keys()


def test_an_entry_whose_name_is_taken_keeps_its_usual_one():
    found = model_of(
        'x = coordinate("x", "m", 2)\nspring(x, 3)\nviscous(x, 1, "rail")\nfriction(x, 1, name="rail")\n'
        'viscous(x, 2, "oil")\n'
    )
    entries = {entry for each in facts(found, "", {})["elements"] for entry in each["ledger"]}
    assert entries == {"rail_1", "coulomb_1", "oil_1"}


def test_friction_of_two_elements_is_called_by_both():
    found = model_of(
        'x = coordinate("x", "m", 2, "slide")\nspring(x, 3)\nfriction(x, 1, name="seal")\nfriction(x, 2, name="rail")\n'
    )
    ledger = {entry: label for each in facts(found, "", {})["elements"] for entry, label in each["ledger"].items()}
    assert ledger == {"coulomb_1": "slide, seal and rail"}


def test_the_stretch_is_that_of_the_spring_by_its_name():
    for name, spring in (("door", "closer spring"), ("relay", "seat spring"), ("tendon", "tendon")):
        assert stranger(name).formula("y_0").quantity.meaning.startswith(f"stretch of the {spring}")
    springless = model_of('x = coordinate("x", "m", 2, "sledge")\nforce(x, 3)\n')
    assert words.stretch(springless) == "displacement of the sledge"


def test_a_word_of_the_file_is_not_taken_for_one_of_the_hopper():
    """The first mass is called as the hopper's second one, and its oil as its first one."""
    found = Derivation(model_of(
        'a = coordinate("a", "m", 1, "body")\nb = coordinate("b", "m", 1, "hull")\nspring(a - b, 3, "compression")\n'
        'viscous(a, 1, "actuator")\nviscous(b, 1, "motor")\nforce(a, 2, "current")\n'
    ))  # fmt: skip
    meanings = {each.name: each.quantity.meaning for each in found.formulas}
    assert meanings["acc_1"] == "acceleration of the body" and meanings["acc_2"] == "acceleration of the hull"
    assert meanings["actuator_1_power"] == "power: work of viscous 'actuator' on the body"
    assert meanings["motor_2_power"] == "power: work of viscous 'motor' on the hull"
    assert meanings["current_1_power"] == "power: work of force 'current' on the body"
    assert meanings["a1_y"] == "acceleration of the body per stretch of the compression"


@pytest.mark.sliced
def test_a_name_with_an_apostrophe_ends_nothing():
    found = model_of(
        """q = coordinate("q", "rad", 2, "door's leaf")\nspring(q, 3, "closer's spring").damper(1, "spring's damping")\n"""
        """viscous(q, 1, "closer's oil")\nfriction(q, 1, name="hinges' pins")\nstop(q, 0, 1, "frame's edge")\n"""
    )
    files = {path.name: text for path, text in render(found).items()}
    for file in (name for name in files if name.endswith(".py")):
        ast.parse(files[file])
    known = tomllib.loads(files["solver.toml"])
    ledger = {entry: label for each in known["elements"] for entry, label in each["ledger"].items()}
    assert ledger["hinges__pins_1"] == "door's leaf, hinges' pins"
    assert r"\text{hinges  pins 1}" in Derivation(found).show(form="latex")


# ---- the paper ----


def test_the_hopper_keeps_the_papers_letters_and_numbers():
    found = derive("hopper")
    assert {number for each in found.formulas for number in each.numbers} >= {3, 4, 5, 6, 11, 18, 24, 27}
    assert found.latex("acc_2").startswith(r"\ddot{x}_2 = \frac{- b_2 \dot{x}_2")
    assert "(3), (4)" in program(found.model).record("Rates").meaning
    assert found.formula("y_0").quantity.meaning == "spring deflection at t = 0, from its free length"


@pytest.mark.parametrize(
    ("further", "is_of_the_paper"),
    [("", True), ("viscous(h.x1, 2, 'oil')", False), ("friction(h.x1, 2, name='seal')", False)],
)
def test_a_model_made_of_the_hopper_keeps_numbers_while_its_equations_are_the_papers(further, is_of_the_paper):
    found = Derivation(hopper_with(further))
    assert found.model.is_of_the_paper == is_of_the_paper
    assert any(each.numbers for each in found.formulas) == is_of_the_paper
    derived = page(found).partition("## Lagrangian")[2]  # behind the parameters, whose meanings are the file's
    assert bool(re.search(NUMBER, derived)) == is_of_the_paper
    assert r"\ddot{x}_1" in found.latex("acc_1")
