"""The compiled library: one that is broken or stale is refused by name, one that is missing is made at its first use."""

import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import hopform
import hopform_solver
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
    """A library is loaded once a process."""
    native.library.cache_clear()
    libraries.handle.cache_clear()
    DEFAULT._compiled = None


@pytest.fixture
def library(tmp_path, monkeypatch) -> Iterator[Path]:
    """Where the library is looked for in a test: a file that is not there yet. There is no compiler."""
    path = tmp_path / "runtime" / "hopform" / libraries.LIBRARY.name
    path.parent.mkdir(parents=True)
    monkeypatch.setattr(libraries, "LIBRARY", path)
    monkeypatch.setenv("CC", "/no/compiler")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    shutil.copy(ROOT / "generated" / "solver.toml", path.parent)
    shutil.copytree(ROOT / "generated" / "c", path.parent / "c")
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
    copied(library)
    before, formulas = build.source_of(generated), generated / "c" / "src" / "formulas_f64.h"
    text, old = formulas.read_text("utf-8"), "a1_v1 = -b1/m_eff;"
    assert text.count(old) == 1
    formulas.write_text(text.replace(old, "a1_v1 = -2.0*b1/m_eff;"), "utf-8")
    os.utime(formulas, (0, 0))  # as a checkout of an older revision leaves it: times say nothing
    return (
        f"{library.name} is stale: it is of the sources {before}, generated/c has {build.source_of(generated)}; "
        "`python tools/build_library.py` makes it again"
    )


def copied(library: Path) -> None:
    """The library of this checkout, with its hashes and without its notes."""
    shutil.copy(OWN, library)
    shutil.copy(build.seal_of(OWN), build.seal_of(library))


def cut_short(library: Path) -> str:
    """As by a full disk or a killed copy: where such a file is loaded, a signal ends the process."""
    copied(library)
    library.write_bytes(OWN.read_bytes()[:5000])
    return f"the compiled library {library.name} is damaged: its SHA-256 differs from that in {library.stem}.sha256; reinstall"


def killed(library: Path) -> str:
    """A build that did not come to its last file."""
    library.write_bytes(b"a library")
    return f"{library.name} is not complete: there is no {library.stem}.sha256, which its build writes last; reinstall"


def missing(library: Path) -> str:
    return f"there is no compiled library {library.name}"


def broken(library: Path) -> str:
    library.write_bytes(b"for another computer")
    build.sealed(library)
    return f"the compiled library {library.name} cannot be loaded"


def foreign(library: Path) -> str:
    compile_one(library, "int other;\n")
    return library.name


UNUSABLE = pytest.mark.parametrize("prepare", [stale, outdated, missing, cut_short, killed, broken, foreign])


def test_the_library_of_this_checkout_is_the_one_of_its_sources(tmp_path):
    try:
        compile_one(tmp_path / "nothing.so", "int nothing;\n")
    except LibraryNotBuilt:
        return
    assert hopform.library_message() is None


@UNUSABLE
def test_a_library_that_cannot_be_used_is_refused_with_the_reason(library, hopper_c, monkeypatch, prepare):
    with monkeypatch.context() as with_a_compiler:
        with_a_compiler.delenv("CC")
        why = prepare(library)
    with pytest.raises(hopform.BackendError) as refused:
        hopform.solve_stance(hopper_c, v2=-1.93)
    assert why in str(refused.value)
    assert hopform.library_message() == str(refused.value)
    assert len(str(refused.value).splitlines()) == 1


def test_without_a_library_and_a_compiler_one_line_names_the_three_ways(library):
    said = hopform.library_message()
    assert said is not None
    for way in (
        "no C compiler makes it: install one",
        "name it by CC",
        "pip install 'hopform[compiler]'",
        "a wheel of hopform",
    ):
        assert way in said


@pytest.fixture
def compiled(library, monkeypatch) -> list[Path]:
    """There is a compiler, whose library is that of this checkout; the folders that are compiled."""
    folders = list[Path]()

    def compile_into(folder: Path, output: Path) -> None:
        folders.append(folder)
        shutil.copy(build.with_notes(OWN), build.with_notes(output))
        copied(output)

    monkeypatch.setattr(build, "compile_solver", compile_into)
    return folders


@pytest.mark.skipif(not OWN.is_file(), reason="there is no compiled library")
def test_an_installation_without_a_library_compiles_it_once(library, compiled, hopper_c):
    for _ in range(2):
        forget()
        stance = hopform.solve_stance(hopper_c, v2=-1.93, u=2.0)
    assert stance.status == "takeoff" and "rule 2" in stance.explain()
    assert compiled == [library.parent]
    (library.parent / "c" / "src" / "version.c").write_text("/* of another version */\n", "utf-8")
    forget()
    assert hopform.library_message() is None
    assert len(compiled) == 2, "another source is another library"


@pytest.mark.parametrize("error", [PermissionError(13, "Permission denied", "/cache"), LibraryNotBuilt("a fault in c")])
def test_a_library_that_cannot_be_made_is_one_line(library, compiled, monkeypatch, error):
    def refuse(*_) -> None:
        raise error

    monkeypatch.setattr(build, "compile_solver", refuse)
    assert hopform.library_message() == f"there is no compiled library {library.name}, and it cannot be made: {error}"


@pytest.mark.skipif(not OWN.is_file(), reason="there is no compiled library")
def test_notes_that_are_missing_or_of_other_sources_are_refused_by_name(library, hopper_c, tmp_path, monkeypatch):
    monkeypatch.delenv("CC")
    copied(library)
    stance, notes = hopform.solve_stance(hopper_c, v2=-1.93, u=2.0), build.with_notes(library)
    with pytest.raises(hopform.BackendError, match=f"explain.. needs {notes.name}, which is not beside {library.name}"):
        stance.explain()
    version = (ROOT / "generated" / "c" / "src" / "version.c").read_text("utf-8")
    compile_one(tmp_path / "other.so", version.replace('"facts.h"', f'"{ROOT}/generated/c/src/facts.h"'))
    shutil.move(tmp_path / "other.so", notes)
    with pytest.raises(hopform.BackendError, match=f"{notes.name} is damaged: its SHA-256 differs from that in"):
        stance.explain()
    build.sealed(library)
    with pytest.raises(
        hopform.BackendError, match=rf"{notes.name} is stale: it is of the sources \w+, {library.name} of"
    ):
        stance.explain()


def test_the_class_of_a_robot_names_what_solves_it(hopper_c):
    """So that functions of hopform solve robots of another package by its own library, whoever calls them."""

    def absent() -> native.Library:
        raise hopform.BackendError("this package has no library")

    class Other(hopform.Robot):
        solver = Solver(OURS, absent)

    other = Other(**{field.name: getattr(hopper_c, field.name) for field in hopper_c.fields()})
    calls = (
        lambda: hopform.solve_stance(other, v2=-1.93, u=2.0),
        lambda: hopform.solve_stances(other, v2=np.array([-1.93])),
        lambda: hopform.solve_flight(other, v2=1.9),
        lambda: hopform.choose_current(other, v2=-1.93, h_des=0.2),
    )
    for call in calls:
        with pytest.raises(hopform.BackendError, match="this package has no library"):
            call()
