"""What pip gives a user: the wheel built from the sdist, with and without a C compiler."""

import ctypes
import json
import os
import re
import resource
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tomllib
import venv
import zipfile
from email import message_from_bytes
from email.message import Message
from hashlib import sha256
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
HAS_COMPILER = shutil.which(shlex.split(os.environ.get("CC") or "cc")[0]) is not None
pytestmark = pytest.mark.sliced
NO_COMPILER = {"CC": "/nonexistent/cc"}


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


def metadata(wheel: Path) -> Message:
    """What an index is told; its payload is the page that it shows."""
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
        return message_from_bytes(archive.read(name))


def libraries(wheel: Path) -> list[str]:
    """The compiled libraries of a wheel; they are as their hashes beside them say."""
    found = [name for name in contents(wheel) if "_libhopform" in name]
    seals = [name for name in found if name.endswith(".sha256")]
    with zipfile.ZipFile(wheel) as archive:
        said = {line for seal in seals for line in archive.read(seal).decode().splitlines()}
        own = [name for name in found if name not in seals]
        assert said == {f"{sha256(archive.read(name)).hexdigest()}  {Path(name).name}" for name in own}
    return own


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


class Stranger:
    """A new environment with the wheel, installed by pip, and what it requires; no compiler, no git, no HOME."""

    def __init__(self, folder: Path, wheel: Path) -> None:
        self.folder = folder
        venv.create(folder / "env", symlinks=True)
        self.python = folder / "env" / "bin" / "python"
        install = ("install", "--quiet", "--no-deps", "--no-index", wheel)
        code, output = run(sys.executable, "-m", "pip", "--python", self.python, *install, cwd=folder)
        assert code == 0, output
        (hopform,) = (folder / "env" / "lib").glob("python3*/site-packages/hopform")
        required = sysconfig.get_path("purelib")  # a line of a .pth, so that an editable install in there is not seen
        hopform.with_name("required.pth").write_text(f"{required}\n", "utf-8")
        self.package = hopform

    def __call__(self, *arguments: str | Path, program: str = "hopform") -> str:
        """What a program of the environment prints."""
        command = [self.python.with_name(program), *arguments]
        bare = {"PATH": str(self.folder / "nothing"), "CC": "/nonexistent/cc"}
        done = subprocess.run(command, cwd=self.folder, env=bare, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout


@pytest.fixture(scope="module")
def stranger(wheel, tmp_path_factory) -> Stranger:
    return Stranger(tmp_path_factory.mktemp("stranger"), wheel)


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


def test_the_metadata_have_each_licence_with_their_texts_and_no_address(wheel):
    told = metadata(wheel)
    assert told["License-Expression"] == "MIT AND MIT-0 AND CC0-1.0 AND BSD-2-Clause"
    folder = f"hopform-{told['Version']}.dist-info/licenses/"
    with zipfile.ZipFile(wheel) as archive:
        first = [archive.read(folder + name).split(b"\n")[0] for name in told.get_all("License-File")]
    assert first == [
        b"MIT License", b"MIT No Attribution", b"BSD 2-Clause License", b"Creative Commons Legal Code",
    ]  # fmt: skip
    assert [
        key for key in told if key.lower() in {"project-url", "home-page", "author-email", "maintainer-email"}
    ] == []


def test_a_wheel_requires_three_packages_and_has_the_extras_of_users_alone(wheel):
    told = metadata(wheel)
    always = [line for line in told.get_all("Requires-Dist") if "extra ==" not in line]
    assert sorted(re.split(r"\W", line)[0] for line in always) == ["numpy", "rich", "typer"]
    assert set(told.get_all("Provides-Extra")) == {"all", "compiler", "derive", "identify", "jax", "plot", "xarray"}


def test_the_page_of_an_index_has_the_text_of_each_link_and_picture_and_none_that_leads_nowhere(wheel):
    told = metadata(wheel)
    page = str(told.get_payload())
    assert told["Description-Content-Type"] == "text/markdown"
    readme = (ROOT / "README.md").read_text("utf-8")
    for pattern in (r"\[([^\[\]]+)\]\(([^)\s]+)\)", r'<img (?=.*alt="([^"]+)").*src="([^"]+)"'):
        outside = [link for link in re.findall(pattern, readme) if link[1].startswith(("https://", "#"))]
        texts = [text for text, target in re.findall(pattern, readme) if (text, target) not in outside]
        assert texts and [text for text in texts if text not in page] == []
        assert re.findall(pattern, page) == outside


def test_the_proof_stays_in_the_repository_and_nothing_of_the_derivation_stands_at_the_top(wheel):
    installed = [name for name in contents(wheel) if ".dist-info/licenses/" not in name]
    folders = {part for name in installed for part in name.split("/")[:-1]}
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
    model = ROOT / "derive" / "models" / "back_emf.py"
    build = (sys.executable, "-m", "hopform", "model", "build", model, "--out", "driven")
    code, output = run(*build, cwd=tmp_path, PYTHONPATH=str(installed), CC="/no/compiler")
    assert code == 0 and "The solver is built in driven, after " in output, output
    assert "the library is not compiled (/no/compiler does not run); it is compiled at first use" in output
    code, output = run(
        sys.executable, "-c", "import hopform_solver as s; print(s.ROBOT_FIELDS[-1].name)",
        cwd=tmp_path, PYTHONPATH=str(tmp_path / "driven" / "python"),
    )  # fmt: skip
    assert (code, output) == (0, "k_emf\n")


def test_a_model_file_without_the_extra_says_which_one_it_needs(installed, tmp_path):
    without = "import sys; sys.modules['sympy'] = None; from hopform.model import spring"
    code, output = run(sys.executable, "-c", without, cwd=tmp_path, PYTHONPATH=str(installed))
    assert code == 1
    assert output.splitlines()[-1].endswith(
        f"MissingExtra: hopform.model needs the extra `derive`: {sys.executable} -m pip install 'hopform[derive]'"
    )


@pytest.mark.parametrize("package", ["sympy", "jinja2"])
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


def test_the_reference_set_is_shipped_whole_and_scores_a_simulator_of_the_current_folder(wheel, stranger):
    folder = ROOT / "runtime" / "hopform" / "_reference"
    files = [*folder.glob("data/*.json"), folder / "README.md", folder / "LICENSE"]
    assert {f"hopform/_reference/{path.relative_to(folder).as_posix()}" for path in files} <= contents(wheel)
    still = "import numpy as np\n\n\ndef simulate(case):\n    return np.zeros((len(case.times), len(case.outputs)))\n"
    (stranger.folder / "at_rest.py").write_text(still, "utf-8")
    (hold,) = json.loads(stranger("reference", "score", "at_rest:simulate", "--case", "hold", "--json"))["scores"]
    assert (hold["rms"], hold["creep"]) == (0.0, 0.0)
    stranger("reference", "write", "friction")
    assert len([*(stranger.folder / "friction").glob("*.json")]) == len(files) - 2


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
    assert len(libraries(wheel)) == 2
    for library in libraries(wheel):
        ctypes.CDLL(str(installed / library))


def test_a_wheel_gives_the_first_number_within_20_s_of_a_processor_and_the_digests_of_this_checkout(wheel, tmp_path):
    def spent() -> float:
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        return used.ru_utime + used.ru_stime

    begin = spent()
    stranger = Stranger(tmp_path, wheel)
    first = stranger("stance", "--robot", "hopper_c", "--height", "0.20", "--u", "3")
    assert spent() - begin < 20.0
    assert "takes off after 188.13 ms" in first
    assert "no earlier zero, shown by" in stranger("stance", "--robot", "hopper_c", "--height", "0.20", "--explain")
    digests = json.loads((ROOT / "tests/repository/gate/record.json").read_text("utf-8"))["selftest"]
    assert [line.split()[-1] for line in stranger("selftest").splitlines()] == [digests["f32"], digests["f64"]]


def test_a_stranger_derives_a_model_without_a_compiler_and_is_told_what_solving_needs(stranger):
    shutil.copy(ROOT / "derive" / "models" / "back_emf.py", stranger.folder)
    assert "driven" in stranger("model", "build", "back_emf.py", "--out", "driven")
    why = "import hopform; print(hopform.load_solver('./driven').library_message())"
    said = stranger("-c", why, program="python")
    assert "no C compiler makes it" in said and "hopform[compiler]" in said


def test_a_package_that_a_stranger_exports_is_built_of_the_list_of_the_library_and_has_its_digests(stranger, tmp_path):
    """By CMake, with the flags of the package; the library of the wheel has those of solver.toml."""
    stranger("export", "package", "--for", "cmake")
    package, board = stranger.folder / "package", ROOT / "tests" / "conformance" / "firmware" / "boards"
    build = tomllib.loads((stranger.package / "solver.toml").read_text("utf-8"))["build"]
    listed = (package / "CMakeLists.txt").read_text("utf-8")
    assert {f"c/{name}" for name in re.findall(r"^    (src/\S+\.c)$", listed, re.MULTILINE)} <= set(build["sources"])
    rounding = re.findall(r":(-ffp[^>]+)>", listed)[0].split(";")
    assert [flag for flag in build["flags"] if flag.startswith("-f") and flag in rounding] == rounding
    (tmp_path / "CMakeLists.txt").write_text(
        f"""cmake_minimum_required(VERSION 3.16)
project(app LANGUAGES C)
add_subdirectory({package} hopform)
add_executable(app {board.parent}/selftest.c {board}/board.c)
target_include_directories(app PRIVATE {board})
target_link_libraries(app hopform::hopform)
""",
        "utf-8",
    )
    for command in (("cmake", "-S", ".", "-B", "build"), ("cmake", "--build", "build", "-j2")):
        code, output = run(*command, cwd=tmp_path)
        assert code == 0, output
    f32, f64 = (line.split()[-1] for line in stranger("selftest").splitlines())
    assert run(tmp_path / "build" / "app", cwd=tmp_path) == (0, f"f32 {f32} f64 {f64}\n")


def test_a_program_of_a_stranger_passes_mypy_strict_and_runs(stranger, tmp_path):
    """mypy reads the installed package, by its py.typed; what is not typed there is an error in the program."""
    program = shutil.copy(ROOT / "tests" / "repository" / "typed_project.py", tmp_path)
    mypy = (sys.executable, "-m", "mypy", "--strict", "--config-file=", "--python-executable", stranger.python)
    code, output = run(*mypy, program, cwd=tmp_path)
    assert (code, output) == (0, "Success: no issues found in 1 source file\n")
    assert stranger(program, program="python") == "0.312109\n"


def test_without_a_compiler_one_line_says_what_to_do_and_there_is_no_wheel_that_pip_could_keep(source, tmp_path):
    code, output = pip_wheel(source, tmp_path, **NO_COMPILER)
    assert code != 0
    (line,) = {line.strip() for line in output.splitlines() if line.strip().startswith("hopform: ")}
    assert line.startswith("hopform: no C compiler: /nonexistent/cc: ")
    assert "HOPFORM_COMPILE_LATER=1 pip install 'hopform[compiler]'" in line
    assert not list(tmp_path.glob("*.whl"))


def test_an_editable_install_without_a_compiler_is_refused_by_the_same_line(source, tmp_path):
    hook = "from hatchling.build import build_editable; build_editable('.')"
    code, output = run(sys.executable, "-c", hook, cwd=source, **NO_COMPILER)
    assert (code, output.count("\n")) == (1, 1)
    assert output.startswith("hopform: no C compiler: /nonexistent/cc: ")


def test_a_wheel_without_a_library_is_for_who_asks_for_it_and_has_no_library_of_an_earlier_build(source, tmp_path):
    left = source / "runtime" / "hopform" / "_libhopform.so"
    left.write_bytes(b"of other sources")
    code, output = pip_wheel(source, tmp_path, **NO_COMPILER, HOPFORM_COMPILE_LATER="1")
    left.unlink()
    assert code == 0, output
    assert the_wheel(tmp_path).name.endswith("-py3-none-any.whl")
    assert libraries(the_wheel(tmp_path)) == []


def test_sources_that_do_not_compile_end_the_build_with_what_the_compiler_said(source, tmp_path):
    broken = shutil.copytree(source, tmp_path / "broken")
    (broken / "generated" / "c" / "src" / "version.c").write_text("int version(void) { return }\n", "utf-8")
    code, output = pip_wheel(broken, tmp_path)
    assert code != 0
    assert "does not compile generated/c" in output
    assert "version.c:1:" in output


def test_a_build_of_a_wheel_leaves_nothing_in_the_tree_of_its_sources(source, wheel):
    assert libraries(wheel)
    assert not list((source / "runtime").rglob("_libhopform*"))
