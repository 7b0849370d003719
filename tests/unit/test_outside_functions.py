"""Any object for any argument of any public function: it is taken, or refused in one message, and nothing else."""

import os
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import hopform
import hopform.hopping
from hopform._files import write
from tests.calls import ANSWERS, INSIDE, every, parameters_of
from tests.outside import examples, objects

EVERY = every()
PROTOCOLS = {"Preparing", "HopformError"}


@pytest.fixture(scope="module", autouse=True)
def a_folder_of_its_own(tmp_path_factory):
    """What is saved is saved there, and nothing outside of it."""
    folder = tmp_path_factory.mktemp("outside")

    def inside(files):
        write({path: each for path, each in files.items() if Path(os.path.realpath(path)).is_relative_to(folder)})

    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setattr("hopform.hopping._run.write", inside)
        yield


def test_every_public_function_is_in_the_catalogue():
    rooms = (hopform, hopform.hopping, hopform.identify)
    for module in (*rooms, hopform.hopping.controllers, hopform.hopping.terrain):
        own = {name for name, found in vars(module).items() if getattr(found, "__module__", "") == module.__name__}
        for name in module.__all__ if module in rooms else own:
            found = getattr(module, name)
            if name.startswith("_") or not callable(found) or found in (hopform.BackendError, hopform.MissingExtra):
                continue
            assert name in EVERY or name in ANSWERS | INSIDE | PROTOCOLS, name


@st.composite
def call(draw):
    """A call with one to three of its arguments replaced by any object."""
    name = draw(st.sampled_from(sorted(EVERY)))
    function, arguments = EVERY[name]
    names = parameters_of(function, arguments)
    changed = draw(st.lists(st.sampled_from(names), min_size=1, max_size=3, unique=True)) if names else []
    return name, arguments | {each: draw(objects()) for each in changed}


def tried(name, arguments):
    """None, or the message of a refusal; what else is raised or warned of goes through."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            EVERY[name][0](**arguments)
        except (hopform.HopformError, TypeError) as error:
            return str(error)
    return None


@given(call())
@examples(300)
def test_any_object_for_any_argument_is_taken_or_refused(drawn):
    name, arguments = drawn
    message = tried(name, arguments)
    assert message is None or ("\n" not in message and len(message) < 600), message


MOST = 2**20
"""Entries that any argument has at most, where a detector's samples are bounded for this test."""


class TakesAll(BaseException):
    """More was taken than any argument may have."""


def endless() -> Iterator[float]:
    """Zeros without an end."""
    for _ in range(MOST + 1):
        yield 0.0
    raise TakesAll


class Endless(Mapping[str, float]):
    """Names without an end."""

    def __len__(self):
        return 1

    def __getitem__(self, name):
        return 0.0

    def __iter__(self):
        yield from (str(n) for n, _ in enumerate(endless()))


@pytest.mark.parametrize("name", sorted(EVERY))
def test_no_argument_is_read_without_a_bound(name, monkeypatch):
    monkeypatch.setattr("hopform._solvers.MOST_SAMPLES", 2**14)
    monkeypatch.setattr("hopform.hopping._touchdown.MOST_SAMPLES", 2**14)
    function, arguments = EVERY[name]
    for each in parameters_of(function, arguments):
        for value in (endless(), Endless()):
            message = tried(name, arguments | {each: value})
            assert message is None or ("\n" not in message and len(message) < 600), (each, message)


@pytest.mark.parametrize(
    ("name", "argument", "said"),
    [
        ("compare", "seeds", "seeds must have at most 1048576 entries, got more"),
        ("compare", "grounds", "grounds must have at most 1048576 entries, got more"),
        ("simulate", "terrain", "terrain must have at most 65536 entries, got more"),
        ("sensitivities arrays", "over", "over must have at most 0 entries, got more"),
        ("many sensitivities arrays", "over", "over must have at most 1 entries, got more"),
    ],
)
def test_what_does_not_end_is_refused_with_the_limit(name, argument, said):
    assert tried(name, EVERY[name][1] | {argument: endless()}) == said
