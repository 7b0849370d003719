"""The table of modes: each row by what it says, and the rows that it leads to."""

from itertools import product

import pytest

from derive.maths import energy, mode_table, sensitivity
from derive.maths.elements import ELEMENTS
from derive.model.quantities import limit_sign, side_2
from derive.model_file import read_model
from tests.derived import SHIPPED, model_file

MODELS = ("hopper", "leg_damper", "sea", "sea_held", "joint", "servo")


@pytest.fixture(params=MODELS, scope="module")
def model(request):
    return read_model(SHIPPED / f"{request.param}.py")


def test_each_combination_of_signs_and_limits_has_one_row(model):
    signs = [(-1, 0, 1) if element.number in model.moving else (0,) for element in ELEMENTS]
    limits = (-1, 0, 1) if model.has_law else (0,)
    rows = mode_table.rows(model)
    assert [(*row.side, row.limit) for row in rows] == list(product(*signs, limits))
    assert [mode_table.by_number(model)[row.number] for row in rows] == list(range(len(rows)))


def test_a_row_leads_to_that_with_one_change(model):
    rows = mode_table.rows(model)
    for row in rows:
        for n, element in enumerate(ELEMENTS):
            for sign, index in zip((-1, 0, 1), row.turned[n], strict=True):
                changed = list(row.side)
                changed[n] = sign if element.number in model.moving else 0
                assert (rows[index].side, rows[index].limit) == (tuple(changed), row.limit)
        for sign, index in zip((-1, 0, 1), row.limited, strict=True):
            assert (rows[index].side, rows[index].limit) == (row.side, sign if model.has_law else 0)


def test_a_row_has_the_form_in_which_its_elements_slip(model):
    forms = mode_table.forms(model)
    for row in mode_table.rows(model):
        slipping = tuple(element.number for element, sign in zip(ELEMENTS, row.side, strict=True) if sign)
        assert (row.rests, row.several) == (not slipping, len(slipping) > 1)
        assert row.alone == (slipping[0] - 1 if len(slipping) == 1 else -1)
        assert forms[row.form].rates == row.rates == (model.has_law and row.limit == 0)
        assert row.rests or forms[row.form].moving == slipping


def test_the_stretch_falls_where_the_actuator_retracts_or_the_body_rises():
    for row in mode_table.rows(read_model(SHIPPED / "hopper.py")):
        first, second = row.side
        assert row.falls == (first < 0 or second > 0)
        assert row.rises == (first > 0 or second < 0)


@pytest.mark.parametrize(
    ("name", "guards"),
    [
        ("hopper", "contact stop velocity threshold"),
        ("sea_held", "stop velocity"),
        ("monoped", "contact velocity threshold"),
        ("servo", "stop limit velocity"),
    ],
)
def test_what_a_model_lacks_has_no_guard(name, guards):
    assert " ".join(mode_table.guards(read_model(model_file(name)))) == guards


def test_a_limit_is_no_side():
    servo = read_model(SHIPPED / "servo.py")
    for formula in (energy.ledger_of, sensitivity.slopes_of):
        read = {symbol for step in formula(servo) for symbol in step.value.free_symbols}
        assert limit_sign in read
        assert side_2 not in read
