"""The warnings of a stance are data: conditions that compare readings, and texts that name them."""

import math
import re
from dataclasses import replace

import hopform
from hopform._warnings import OPERATORS, WARNINGS, said

HOPPER = hopform.load_robot("hopper_c")
READINGS = {"x1", "v1", "v2", "y", "u", "force", "u_largest", "u_size", "spring", "lowest", "takes_off", "stiff"}


def test_conditions_and_texts_name_readings_or_parameters():
    known = READINGS | {field.name for field in (*hopform.Robot.fields(),)} | {"travel"}
    for each in WARNINGS:
        assert set(re.findall(r"\{(\w+)", each.text)) <= known
        for name, compared, bound in each.conditions:
            assert name in known
            assert compared in OPERATORS
            assert not isinstance(bound, str) or bound in known


def test_each_warning_is_said_of_a_stance_that_earns_it():
    loose = replace(HOPPER, x1_min=-0.1)
    cases = [
        hopform.solve_stance(replace(HOPPER, b1=1e8), v2=-1.9, dtype="float32"),
        hopform.solve_stance(HOPPER, v2=-1.9, u=[(0.0, 1.0), (0.05, -3.5)]),
        hopform.solve_stance(HOPPER, v2=0.1),
        hopform.solve_stance(replace(HOPPER, x1_min=-0.1, x1_max=0.0), v2=-1.9, u=1.0),
        hopform.solve_stance(HOPPER, v2=-1.9, u=-1.0),
        hopform.solve_stance(replace(loose, travel=0.1), v2=-1.9),
        hopform.solve_stance(HOPPER, v2=-9.0),
        hopform.solve_stance(replace(loose, g=0.0), v2=-1.0),
    ]
    words = (
        "ill_conditioned",
        "above u_max",
        "moves up",
        "x1_max",
        "x1_min",
        "coil_bound",
        "below the ground",
        "no apex",
    )
    assert len(words) == len(WARNINGS)
    for stance, word in zip(cases, words, strict=True):
        assert any(word in text for text in stance.warnings), (word, stance.warnings)
    assert "u = -3.5 A is above u_max = 3.0 A" in cases[1].warnings
    assert hopform.solve_stance(loose, v2=-1.9, u=1.0).warnings == ()


def test_a_reading_is_taken_only_where_it_is_asked_for():
    """The largest compression costs a solved phase; without a limit of the travel nothing asks for it."""
    asked = list[str]()

    def reading(name):
        asked.append(name)
        return {"travel": math.inf, "u_max": 1.0, "y": 1.0, "lowest": 1.0}.get(name, 0.0)

    assert list(said(WARNINGS, reading)) == []
    assert "travel" in asked
    assert "spring" not in asked
