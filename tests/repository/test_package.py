"""What pip gives a user: the wheel built from the sdist, with and without a C compiler."""

import ctypes
import os
import shlex
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
HAS_COMPILER = shutil.which(shlex.split(os.environ.get("CC") or "cc")[0]) is not None
pytestmark = pytest.mark.sliced
NO_COMPILER = {"CC": "/nonexistent/cc", "HOPFORM_REQUIRE_C": ""}


def run(*command: str | Path, cwd: Path, **environment: str) -> tuple[int, str]:
    """The exit code and everything printed."""
    done = subprocess.run(
        command,
        cwd=cwd,
        env=os.environ | environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    return done.returncode, done.stdout


def pip_wheel(source: Path, folder: Path, **environment: str) -> tuple[int, str]:
    """Build with the hatchling that is installed here, so without a network."""
    pip = [sys.executable, "-m", "pip", "wheel", "--verbose", "--no-deps", "--no-build-isolation", "--no-index"]
    return run(*pip, "--wheel-dir", folder, source, cwd=folder, **environment)


def the_wheel(folder: Path) -> Path:
    (wheel,) = folder.glob("*.whl")
    return wheel


def contents(wheel: Path) -> set[str]:
    with zipfile.ZipFile(wheel) as archive:
        return set(archive.namelist())


def libraries(wheel: Path) -> list[str]:
    return [name for name in contents(wheel) if "_libhopform" in name]


@pytest.fixture(scope="module")
def source(tmp_path_factory) -> Path:
    """The sdist, unpacked: what it lacks the wheel lacks, and the checkout's own library is left alone."""
    folder = tmp_path_factory.mktemp("sdist")
    code, output = run(sys.executable, "-m", "build", "--sdist", "--no-isolation", "--outdir", folder, ROOT, cwd=folder)
    assert code == 0, output
    (sdist,) = folder.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        archive.extractall(folder, filter="data")
    return folder / sdist.name.removesuffix(".tar.gz")


@pytest.fixture(scope="module")
def wheel(source, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    code, output = pip_wheel(source, folder)
    assert code == 0, output
    return the_wheel(folder)


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory) -> Path:
    """What site-packages would hold."""
    folder = tmp_path_factory.mktemp("site-packages")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder)
    return folder


def test_a_wheel_installs_two_packages_and_nothing_else(wheel):
    top = {name.split("/")[0] for name in contents(wheel)}
    assert {name for name in top if not name.endswith(".dist-info")} == {"hopform", "hopform_solver"}
    assert len(top) == 3


def test_the_proof_stays_in_the_repository_and_nothing_of_the_derivation_stands_at_the_top(wheel):
    folders = {part for name in contents(wheel) for part in name.split("/")[:-1]}
    assert not folders & {"derive", "templates", "generated", "tests", "tools", "runtime", "__pycache__"}


@pytest.mark.parametrize("room", ["derive", "templates", "engine"])
def test_what_another_robot_is_derived_from_is_shipped_whole(wheel, room):
    folder = ROOT / "runtime" / "engine" if room == "engine" else ROOT / room
    files = [path for path in folder.rglob("[!.]*") if path.is_file() and "__pycache__" not in path.parts]
    assert len(files) > 10
    assert {f"hopform/_{room}/{path.relative_to(folder).as_posix()}" for path in files} <= contents(wheel)


def test_an_installed_wheel_derives_the_hopper_to_the_same_bytes(installed, tmp_path):
    code, output = run(
        sys.executable, "-m", "hopform._derive", "--out", "hopper", cwd=tmp_path, PYTHONPATH=str(installed)
    )
    assert (code, output) == (0, "")
    made = {path.relative_to(tmp_path / "hopper"): path for path in (tmp_path / "hopper").rglob("*") if path.is_file()}
    assert len(made) > 50
    for name, path in made.items():
        if name.name != "MANIFEST":  # which has hashes here
            assert path.read_bytes() == (ROOT / "generated" / name).read_bytes(), name


def test_an_installed_wheel_builds_the_solver_of_another_model_without_a_compiler(installed, tmp_path):
    model = ROOT / "tests" / "models" / "back_emf.py"
    build = (sys.executable, "-m", "hopform", "model", "build", model, "--out", "driven")
    code, output = run(*build, cwd=tmp_path, PYTHONPATH=str(installed), CC="/no/compiler")
    assert code == 0 and "The solver is built in driven." in output, output
    assert "there is no library, so that stances take longer: /no/compiler does not run" in output
    code, output = run(
        sys.executable, "-c", "import hopform_solver as s; print(s.ROBOT_FIELDS[-1].name)",
        cwd=tmp_path, PYTHONPATH=str(tmp_path / "driven" / "python"),
    )  # fmt: skip
    assert (code, output) == (0, "k_emf\n")


def test_a_model_file_without_the_extra_says_which_one_it_needs(installed, tmp_path):
    without = "import sys; sys.modules['sympy'] = None; from hopform.model import Term"
    code, output = run(sys.executable, "-c", without, cwd=tmp_path, PYTHONPATH=str(installed))
    assert code == 1
    assert output.splitlines()[-1].endswith(
        f"MissingExtra: hopform.model needs the extra `derive`: {sys.executable} -m pip install 'hopform[derive]'"
    )


@pytest.mark.parametrize("package", ["sympy", "jinja2", "pcpp", "pycparser"])
def test_the_derivation_without_its_extra_is_one_line(installed, tmp_path, package):
    without = f"import runpy, sys; sys.modules[{package!r}] = None; runpy.run_module('hopform._derive', alter_sys=True)"
    code, output = run(sys.executable, "-c", without, cwd=tmp_path, PYTHONPATH=str(installed))
    installs = f"{sys.executable} -m pip install 'hopform[derive]'"
    assert (code, output) == (2, f"derive: python -m hopform._derive needs the extra `derive`: {installs}\n")


def test_an_installed_wheel_has_no_folder_to_write_into_but_the_one_it_is_told(installed, tmp_path):
    for options in ((), ("--check",)):
        code, output = run(sys.executable, "-m", "hopform._derive", *options, cwd=tmp_path, PYTHONPATH=str(installed))
        assert (code, output.count("\n")) == (2, 1)
        assert "--out DIR is needed" in output


def test_both_packages_say_that_they_are_typed(wheel):
    assert {"hopform/py.typed", "hopform_solver/py.typed"} <= contents(wheel)


def test_every_robot_of_the_repository_is_shipped(wheel):
    robots = {f"hopform/_robots/{path.name}" for path in (ROOT / "runtime" / "hopform" / "_robots").glob("*.toml")}
    assert robots
    assert robots <= contents(wheel)


def test_the_c_that_firmware_copies_is_shipped_whole(wheel):
    folder = ROOT / "generated" / "c"
    sources = {f"hopform/c/{path.relative_to(folder).as_posix()}" for path in folder.rglob("*") if path.is_file()}
    assert "hopform/c/include/hopform/hopform.h" in sources
    assert sources <= contents(wheel)


def test_an_installed_wheel_is_imported_without_the_checkout(installed, tmp_path):
    where = "import hopform, hopform_solver; print(hopform.__file__, hopform_solver.__file__, sep='\\n')"
    code, output = run(sys.executable, "-c", where, cwd=tmp_path, PYTHONPATH=str(installed))
    assert code == 0, output
    assert [Path(line).parent.parent for line in output.splitlines()] == [installed, installed]


@pytest.mark.skipif(not HAS_COMPILER, reason="needs a C compiler")
def test_with_a_compiler_the_wheel_is_for_one_platform_and_any_python_3(wheel):
    assert wheel.name.startswith("hopform-")
    assert "-py3-none-" in wheel.name
    assert not wheel.name.endswith("-any.whl")


@pytest.mark.skipif(not HAS_COMPILER, reason="needs a C compiler")
def test_the_compiled_library_loads_with_every_symbol_found(wheel, installed):
    (library,) = libraries(wheel)
    ctypes.CDLL(str(installed / library))


def test_without_a_compiler_the_wheel_is_pure_and_one_line_says_so(source, tmp_path):
    code, output = pip_wheel(source, tmp_path, **NO_COMPILER)
    assert code == 0, output
    assert the_wheel(tmp_path).name.endswith("-py3-none-any.whl")
    (warning,) = [line for line in output.splitlines() if "compiler" in line]
    assert "/nonexistent/cc" in warning


def test_without_a_compiler_no_library_of_an_earlier_build_is_shipped(source, tmp_path):
    (source / "runtime" / "hopform" / "_libhopform.so").write_bytes(b"of other sources")
    code, output = pip_wheel(source, tmp_path, **NO_COMPILER)
    assert code == 0, output
    assert libraries(the_wheel(tmp_path)) == []


def test_without_a_compiler_a_build_that_requires_c_fails_by_name(source, tmp_path):
    code, output = pip_wheel(source, tmp_path, **NO_COMPILER | {"HOPFORM_REQUIRE_C": "1"})
    assert code != 0
    assert "HOPFORM_REQUIRE_C is set, but no C compiler: /nonexistent/cc" in output
    assert not list(tmp_path.glob("*.whl"))
