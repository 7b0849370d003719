"""The compiled library and what stands in for it:
one that is missing, broken or stale is refused by name, and the printed engine solves.
"""

import os
import shutil
import subprocess
import sys
import warnings
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

import hopform
import hopform_solver
from hopform import ufuncs
from hopform._solver import build
from hopform._solver import c as native
from hopform._solver import library as libraries
from hopform._solver.build import LibraryNotBuilt, compile_solver
from hopform._solver.choice import DEFAULT, Solver
from hopform._solver.package import OURS

ROOT = Path(__file__).resolve().parents[2]
OWN = libraries.LIBRARY


def compile_one(library: Path, source: str) -> None:
    """A library of one source and the public headers."""
    folder = library.with_name("one")
    shutil.copytree(ROOT / "generated" / "c" / "include", folder / "c" / "include")
    (folder / "c" / "src").mkdir()
    (folder / "c" / "src" / "one.c").write_text(source, "utf-8")
    (folder / "solver.toml").write_text('[build]\nflags = ["-shared", "-fPIC"]\nsources = ["c/src/one.c"]\n', "utf-8")
    compile_solver(folder, library)


def forget() -> None:
    """Back ends are chosen once a process."""
    native.library.cache_clear()
    libraries.handle.cache_clear()
    DEFAULT._compiled = DEFAULT._best = None


@pytest.fixture
def library(tmp_path, monkeypatch) -> Iterator[Path]:
    """Where the library is looked for in a test: a file that is not there yet. The extra `compiler` is absent."""
    path = tmp_path / "runtime" / "hopform" / libraries.LIBRARY.name
    path.parent.mkdir(parents=True)
    monkeypatch.setattr(libraries, "LIBRARY", path)
    monkeypatch.setattr(libraries, "find_spec", lambda name: None if name == "ziglang" else find_spec(name))
    forget()
    yield path
    forget()


def stale(library: Path) -> str:
    """A library of another layout, down to the function that says which."""
    source = (ROOT / "generated" / "c" / "src" / "version.c").read_text("utf-8")
    other = hopform_solver.LAYOUT[::-1]
    assert source.count('#include "facts.h"\n') == 1
    compile_one(library, source.replace('#include "facts.h"\n', f'#define HOPFORM_LAYOUT "{other}"\n'))
    return f"is stale: its layout is {other}, that of hopform_solver {hopform_solver.LAYOUT}"


def outdated(library: Path) -> str:
    """That of a checkout whose formulas have changed since: structs and layout are the same."""
    generated = library.parents[2] / "generated"
    shutil.copytree(ROOT / "generated" / "c", generated / "c")
    shutil.copy(ROOT / "generated" / "solver.toml", generated)
    if not OWN.is_file():
        pytest.skip("there is no compiled library")
    shutil.copy(OWN, library)
    before, formulas = build.source_of(generated), generated / "c" / "src" / "formulas_f64.h"
    text, old = formulas.read_text("utf-8"), "a1_v1 = -b1/m_eff;"
    assert text.count(old) == 1
    formulas.write_text(text.replace(old, "a1_v1 = -2.0*b1/m_eff;"), "utf-8")
    os.utime(formulas, (0, 0))  # as a checkout of an older revision leaves it: times say nothing
    return (
        f"{library.name} is stale: it is of the sources {before}, generated/c has {build.source_of(generated)}; "
        "`python tools/build_library.py` makes it again"
    )


def missing(library: Path) -> str:
    return f"there is no compiled library {library.name}"


def broken(library: Path) -> str:
    library.write_bytes(b"half a library")
    return f"the compiled library {library.name} cannot be loaded"


def foreign(library: Path) -> str:
    compile_one(library, "int other;\n")
    return library.name


UNUSABLE = pytest.mark.parametrize("prepare", [stale, outdated, missing, broken, foreign])


def test_the_library_of_this_checkout_is_the_one_of_its_sources(tmp_path):
    """Else every other test would judge the printed engine alone: a stale library is refused, which fails nothing."""
    try:
        compile_one(tmp_path / "nothing.so", "int nothing;\n")
    except LibraryNotBuilt:
        return
    assert hopform.library_message() is None
    assert hopform.backends() == ("c", "python")


@UNUSABLE
def test_the_default_falls_back_to_python_and_says_so_once(library, hopper_c, prepare):
    why = prepare(library)
    with pytest.warns(RuntimeWarning, match="hopform uses its Python back end: ") as caught:
        first = hopform.solve_stance(hopper_c, v2=-1.93, u=2.0)
    (warning,) = caught
    assert why in str(warning.message)
    assert warning.filename == __file__, "it points at the caller"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        second = hopform.solve_stance(hopper_c, v2=-1.93, u=2.0)
    assert first.backend == second.backend == "python"
    assert first.duration == second.duration


@UNUSABLE
def test_asking_for_c_is_refused_with_the_reason(library, hopper_c, prepare):
    why = prepare(library)
    with pytest.raises(hopform.BackendError) as refused:
        hopform.solve_stance(hopper_c, v2=-1.93, backend="c")
    assert why in str(refused.value)
    assert hopform.library_message() == str(refused.value)
    assert len(str(refused.value).splitlines()) == 1
    assert hopform.backends() == ("python",)


@UNUSABLE
def test_asking_for_python_works_in_silence(library, hopper_c, prepare):
    prepare(library)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        stance = hopform.solve_stance(hopper_c, v2=-1.93, u=2.0, backend="python")
    assert (stance.backend, stance.status) == ("python", "takeoff")


@pytest.fixture
def compiled(library, tmp_path, monkeypatch) -> list[Path]:
    """The extra `compiler` is there, its library that of this checkout; the folders that are compiled."""
    folders = list[Path]()

    def compile_into(folder: Path, output: Path) -> None:
        folders.append(folder)
        shutil.copy(OWN, output)

    shutil.copy(ROOT / "generated" / "solver.toml", library.parent)
    shutil.copytree(ROOT / "generated" / "c", library.parent / "c")
    monkeypatch.setattr(libraries, "find_spec", lambda name: find_spec("sys" if name == "ziglang" else name))
    monkeypatch.setattr(build, "compile_solver", compile_into)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return folders


@pytest.mark.skipif(not OWN.is_file(), reason="there is no compiled library")
def test_with_the_extra_compiler_a_pure_wheel_compiles_its_library_once(library, compiled, hopper_c):
    for _ in range(2):
        forget()
        assert hopform.solve_stance(hopper_c, v2=-1.93, u=2.0).backend == "c"
    assert compiled == [library.parent]
    (library.parent / "c" / "src" / "version.c").write_text("/* of another version */\n", "utf-8")
    forget()
    assert hopform.library_message() is None
    assert len(compiled) == 2, "another source is another library"


@pytest.mark.parametrize("error", [PermissionError(13, "Permission denied", "/cache"), build.NoCompiler("no zig")])
def test_a_library_that_the_extra_compiler_cannot_make_is_one_line(library, compiled, monkeypatch, error):
    def refuse(*_) -> None:
        raise error

    monkeypatch.setattr(build, "compile_solver", refuse)
    assert hopform.library_message() == f"there is no compiled library {library.name}, and it cannot be made: {error}"
    assert hopform.backends() == ("python",)


def test_numpy_is_another_name_for_python_and_warns_of_it(hopper_c):
    with pytest.warns(DeprecationWarning, match='backend="numpy" is backend="python" now.* ms for each stance'):
        named = hopform.solve_stance(hopper_c, v2=-1.93, u=2.0, backend="numpy")
    assert named == hopform.solve_stance(hopper_c, v2=-1.93, u=2.0, backend="python")


def test_a_back_end_of_no_such_name_is_refused(hopper_c):
    with pytest.raises(ValueError, match="backend must be 'c' or 'python', got 'fortran'"):
        hopform.solve_stance(hopper_c, v2=-1.93, backend="fortran")


def test_the_class_of_a_robot_names_what_solves_it(hopper_c):
    """So that functions of hopform solve robots of another package by its own back ends, whoever calls them."""

    def absent() -> native.Library:
        raise hopform.BackendError("this package has no library")

    class Other(hopform.Robot):
        solver = Solver(OURS, absent)

    other = Other(**{field.name: getattr(hopper_c, field.name) for field in hopper_c.fields()})
    with pytest.warns(RuntimeWarning, match="hopform uses its Python back end: this package has no library") as caught:
        stance = hopform.solve_stance(other, v2=-1.93, u=2.0)
    assert caught[0].filename == __file__
    v2 = np.array([-1.93])
    assert {
        stance.backend,
        hopform.solve_stances(other, v2=v2).backend,
        hopform.solve_flight(other, v2=1.9).backend,
    } == {"python"}
    with pytest.raises(hopform.BackendError, match="this package has no library"):
        hopform.choose_current(other, v2=-1.93, h_des=0.2, backend="c")
    assert hopform.solve_stance(hopper_c, v2=-1.93).backend == hopform.backends()[0]


WITHOUT_LIBRARY = """
import pickle
import sys
import warnings

import numpy as np

import hopform
from hopform import ufuncs

assert hopform.backends() == ("python",), hopform.backends()
assert ufuncs.stance is ufuncs.stance_on_arrays
assert pickle.loads(pickle.dumps(ufuncs.stance)) is ufuncs.stance
robot = hopform.load_robot("hopper_c")
v2, u = np.linspace(-2.5, -0.5, 5)[:, np.newaxis], np.linspace(-3.0, 3.0, 4)
out = tuple(np.empty((5, 4), np.intc if name in ufuncs.CODES else float) for name in ufuncs.RESULTS)
assert all(a is b for a, b in zip(ufuncs.stance(0.0, 0.0, v2, 0.0, u, 2.0, np.array(robot.parameters), out=out), out))
with warnings.catch_warnings(record=True) as said:
    warnings.simplefilter("always")
    batch = hopform.solve_stances(robot, v2=v2, u=u)
assert ["no compiled library" in str(warning.message) for warning in said] == [True], said
np.savez(sys.argv[1], *out, duration_of_batch=batch.duration)
"""


def test_the_ufunc_works_where_there_is_no_library(tmp_path):
    """An installation without a compiler: the printed engine stands in, for the ufunc too, with its numbers."""
    for package, folder in (("hopform", "runtime"), ("hopform_solver", "generated/python")):
        shutil.copytree(
            ROOT / folder / package, tmp_path / package, ignore=shutil.ignore_patterns("_lib*", "__pycache__")
        )
    shutil.copy(ROOT / "generated" / "solver.toml", tmp_path / "hopform")  # as a wheel has it
    environment = os.environ | {"PYTHONPATH": str(tmp_path)}
    result = tmp_path / "results.npz"
    subprocess.run([sys.executable, "-c", WITHOUT_LIBRARY, str(result)], env=environment, cwd=tmp_path, check=True)
    found = np.load(result)
    v2, u = np.linspace(-2.5, -0.5, 5)[:, np.newaxis], np.linspace(-3.0, 3.0, 4)
    robot = hopform.load_robot("hopper_c")
    expected = ufuncs.stance(0.0, 0.0, v2, 0.0, u, 2.0, np.array(robot.parameters))
    for n, values in enumerate(expected):
        np.testing.assert_allclose(found[f"arr_{n}"], values, rtol=1e-12, atol=1e-13)
    np.testing.assert_array_equal(found["duration_of_batch"], found["arr_1"])
