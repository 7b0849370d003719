"""`hopform export`: each package is complete by itself, says what its build system wants, and works there."""

import json
import os
import re
import shlex
import shutil
import subprocess
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml

import hopform
from derive.__main__ import main as derive
from hopform._cli import main
from hopform._export import SYSTEMS, Wanted, amalgamated, export, package, sources
from tests import needs
from tests.needs import the_first

CC = shlex.split(os.environ.get("CC") or "cc")
FLAGS = ["-O1", "-ffp-contract=off", "-fno-math-errno", "-Wall", "-Wextra", "-Werror"]


def run(*command: str | Path, cwd: Path) -> str:
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def packages(tmp_path_factory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("export")
    for system in SYSTEMS:
        export(folder / system, Wanted(system))
    return {system: folder / system for system in SYSTEMS}


@pytest.mark.parametrize("system", SYSTEMS)
def test_a_package_has_sources_licence_readme_costs_and_no_word_left_to_fill_in(packages, system):
    files = [file for file in packages[system].rglob("*") if file.is_file()]
    names = {file.relative_to(packages[system]).as_posix() for file in files}
    assert {
        "LICENSE",
        "README.md",
        "costs.md",
        "amalgamated/hopform.c",
        "amalgamated/hopform.h",
        "src/hopform_f32.c",
    } <= names
    assert not [name for name in names if "batch" in name]
    for file in files:
        text = file.read_text("utf-8")
        assert not re.search(r"@(prefix|PREFIX|version|summary|real|sources\w*|files)@", text), file


def test_an_export_in_one_precision_is_that_of_the_generator(tmp_path):
    assert derive(["--float32", "--out", str(tmp_path)]) == 0
    exported = sources(Wanted("plain", precisions=("f32",)))
    for path, text in exported.items():
        if path.name != "facts.h":  # has the layout, which depends on precisions
            assert (tmp_path / "c" / path).read_text("utf-8") == text, path
    left = {
        file.relative_to(tmp_path / "c") for file in (tmp_path / "c").rglob("*") if file.is_file()
    } - exported.keys()
    assert all(re.match(r"(batch|columns|readings_of_many)", path.name) for path in left), left


STANDARDS = [
    ["-std=c99"],
    ["-std=c11"],
    pytest.param(["-x", "c++", "-std=c++17", "-Wno-missing-field-initializers"], marks=needs.cpp),
]


@pytest.mark.sliced
@pytest.mark.parametrize("standard", STANDARDS, ids=lambda flags: flags[-1] if len(flags) == 1 else "c++17")
@pytest.mark.parametrize("prefix", ["hopform", "gait"])
def test_the_amalgamated_pair_compiles(tmp_path, standard, prefix):
    for name, text in amalgamated(sources(Wanted(prefix=prefix)), prefix).items():
        (tmp_path / name).write_text(text, "utf-8")
    compiler = ["c++"] if "c++" in standard else CC
    level = ["-O0"] if prefix == "gait" else []  # names alone are others: what an optimiser warns of is the same
    run(*compiler, *standard, *FLAGS, *level, "-c", f"{prefix}.c", "-o", "pair.o", cwd=tmp_path)
    defined = [line.split()[2] for line in run("nm", "pair.o", cwd=tmp_path).splitlines() if line[17:18] in "TDBRC"]
    assert defined
    if "c++" not in standard:
        assert all(name.startswith(f"{prefix}_") for name in defined), defined


def test_the_amalgamated_pair_gives_the_digest_of_the_library(tmp_path):
    from tests.conformance.firmware.targets import BOARDS, HERE

    for name, text in amalgamated(sources(Wanted()), "hopform").items():
        target = tmp_path / ("hopform" if name.endswith(".h") else "") / name
        target.parent.mkdir(exist_ok=True)
        target.write_text(text.replace('#include "hopform.h"', '#include "hopform/hopform.h"'), "utf-8")
    files = [HERE / "selftest.c", BOARDS / "board.c", "hopform.c"]
    run(*CC, "-std=c99", *FLAGS, "-I", BOARDS, "-I", ".", *files, "-o", "selftest", "-lm", cwd=tmp_path)
    said = subprocess.run([tmp_path / "selftest"], capture_output=True, text=True, check=True).stderr
    from hopform._export import selftest

    assert said == f"f32 {selftest('float32'):08x} f64 {selftest('float64'):08x}\n"


def test_the_ten_lines_of_the_readme_compile(packages, tmp_path):
    (code,) = re.findall(r"```c\n(.*?)```", (packages["plain"] / "README.md").read_text("utf-8"), re.DOTALL)
    (tmp_path / "wiring.c").write_text(code, "utf-8")
    flags = [*FLAGS, "-std=c99", "-Wdouble-promotion", "-Wconversion", "-I", packages["plain"] / "include"]
    run(*CC, *flags, "-c", "wiring.c", "-o", "wiring.o", cwd=tmp_path)


# ---- CMake: a project of its own consumes the package in three ways ----

WAYS = {
    "find_package": "find_package(hopform 0.1 REQUIRED)",
    "add_subdirectory": 'add_subdirectory("${PACKAGE}" hopform)',
    "FetchContent": (
        'include(FetchContent)\nFetchContent_Declare(hopform SOURCE_DIR "${PACKAGE}")\n'
        "FetchContent_MakeAvailable(hopform)"
    ),
}
CONSUMER = """cmake_minimum_required(VERSION 3.16)
project(consumer LANGUAGES C)
{way}
add_executable(app main.c)
target_link_libraries(app PRIVATE hopform::hopform)
"""
MAIN = """#include <stdio.h>
#include "hopform/hopform.h"
int main(void)
{
    static hopform_search_f32 search;
    static hopform_phase_f32 phases[HOPFORM_SELFTEST_PHASES];
    printf("%08x\\n", (unsigned)hopform_selftest_f32(&search, phases, HOPFORM_SELFTEST_PHASES));
    return 0;
}
"""


@pytest.mark.sliced
@pytest.mark.parametrize("way", the_first(list(WAYS)))
def test_another_cmake_project_consumes_the_package(packages, tmp_path, way):
    from hopform._export import selftest

    cmake = shutil.which("cmake")
    assert cmake is not None, "cmake is not installed"
    (tmp_path / "CMakeLists.txt").write_text(CONSUMER.format(way=WAYS[way]), "utf-8")
    (tmp_path / "main.c").write_text(MAIN, "utf-8")
    kind = f"-DCMAKE_BUILD_TYPE={'Release' if way == 'find_package' else 'Debug'}"
    if way == "find_package":
        run(cmake, "-S", packages["cmake"], "-B", "library", kind, cwd=tmp_path)
        run(cmake, "--build", "library", "-j2", cwd=tmp_path)
        run(cmake, "--install", "library", "--prefix", tmp_path / "installed", cwd=tmp_path)
    where = [f"-DPACKAGE={packages['cmake']}", f"-DCMAKE_PREFIX_PATH={tmp_path / 'installed'}"]
    run(cmake, "-S", ".", "-B", "build", kind, *where, cwd=tmp_path)
    run(cmake, "--build", "build", "-j2", cwd=tmp_path)
    assert run(tmp_path / "build" / "app", cwd=tmp_path) == f"{selftest('float32'):08x}\n"


# ---- manifests of build systems that are not here ----


def test_the_arduino_package_has_what_the_library_specification_asks_for(packages):
    root = packages["arduino"]
    lines = (root / "library.properties").read_text("utf-8").splitlines()
    properties = dict(line.split("=", 1) for line in lines)
    asked = ("name", "version", "author", "maintainer", "sentence", "paragraph", "category", "url", "architectures")
    assert all(properties.get(key) for key in asked)
    assert re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9 _.-]{0,62}", properties["name"])
    assert re.fullmatch(r"\d+\.\d+\.\d+", properties["version"])
    assert properties["category"] in (
        "Display", "Communication", "Signal Input/Output", "Sensors", "Device Control", "Timing", "Data Storage",
        "Data Processing", "Other",
    )  # fmt: skip
    assert not properties["sentence"].endswith(".")
    assert (root / "src" / properties["includes"]).is_file()
    assert not (root / "include").exists()
    (sketch,) = (root / "examples").rglob("*.ino")
    assert sketch.stem == sketch.parent.name


@needs.cpp
def test_the_arduino_sketch_compiles_against_its_src(packages, tmp_path):
    """As C++ with src/ as the include root, and a stand-in for the core's Serial and delay."""
    root = packages["arduino"]
    (sketch,) = (root / "examples").rglob("*.ino")
    core = (
        "struct Port { void begin(long); template<class T> void print(T); template<class T> void println(T); "
        "void println(float, int); };\nextern Port Serial;\nvoid delay(unsigned long);\n"
    )
    (tmp_path / "sketch.cpp").write_text(core + sketch.read_text("utf-8"), "utf-8")
    run("c++", "-std=c++17", "-Wall", "-Werror", "-I", root / "src", "-c", "sketch.cpp", "-o", "sketch.o", cwd=tmp_path)
    run(*CC, "-std=c99", "-I", root / "src", "-c", root / "src" / "hopform_f32.c", "-o", "hopform.o", cwd=tmp_path)


def test_the_platformio_manifest_keeps_to_its_schema(packages):
    manifest = json.loads((packages["platformio"] / "library.json").read_text("utf-8"))
    assert re.fullmatch(r"[^:;/,@<>]{1,50}", manifest["name"])
    assert re.fullmatch(r"\d+\.\d+\.\d+", manifest["version"])
    kinds = {"description": str, "keywords": list, "license": str, "authors": list, "headers": str, "build": dict}
    assert all(isinstance(manifest[key], kind) for key, kind in kinds.items())
    assert set(manifest) <= {*kinds, "name", "version", "frameworks", "platforms"}
    assert set(manifest["build"]) <= {"flags", "srcDir", "includeDir"}
    assert (packages["platformio"] / "include" / manifest["headers"]).is_file()
    assert all((packages["platformio"] / manifest["build"][key]).is_dir() for key in ("srcDir", "includeDir"))


def test_the_zephyr_module_names_what_is_there(packages):
    root = packages["zephyr"]
    module = yaml.safe_load((root / "zephyr" / "module.yml").read_text("utf-8"))
    assert set(module) <= {"name", "build", "tests", "samples", "boards", "security", "package-managers", "blobs"}
    assert (root / module["build"]["cmake"] / "CMakeLists.txt").is_file()
    assert (root / module["build"]["kconfig"]).is_file()
    listed = re.findall(r"\.\./(src/\w+\.c)", (root / "zephyr" / "CMakeLists.txt").read_text("utf-8"))
    assert sorted(listed) == sorted(file.relative_to(root).as_posix() for file in (root / "src").glob("*.c"))
    assert re.match(r"config HOPFORM\n\tbool \"", (root / "zephyr" / "Kconfig").read_text("utf-8"))
    sample = yaml.safe_load((root / "samples" / "stance" / "sample.yaml").read_text("utf-8"))
    assert set(sample) == {"sample", "tests"}
    assert "CONFIG_HOPFORM=y" in (root / "samples" / "stance" / "prj.conf").read_text("utf-8")


def test_the_esp_idf_component_lists_every_source(packages):
    root = packages["esp-idf"]
    manifest = yaml.safe_load((root / "idf_component.yml").read_text("utf-8"))
    assert set(manifest) <= {
        "version",
        "description",
        "license",
        "url",
        "dependencies",
        "targets",
        "tags",
        "maintainers",
    }
    assert manifest["version"] == hopform.__version__
    listed = re.findall(r"^    (src/\w+\.c)$", (root / "CMakeLists.txt").read_text("utf-8"), re.MULTILINE)
    assert sorted(listed) == sorted(file.relative_to(root).as_posix() for file in (root / "src").glob("*.c"))


def test_the_cmsis_pack_describes_files_that_are_there(packages):
    root = packages["cmsis-pack"]
    (description,) = root.glob("*.pdsc")
    pack = ElementTree.parse(description).getroot()
    order = ["vendor", "name", "description", "url", "license", "releases", "keywords", "components"]
    assert [child.tag for child in pack] == order
    assert description.stem == f"{pack.findtext('vendor')}.{pack.findtext('name')}"
    for component in pack.iter("component"):
        assert component.get("condition") is None  # the schema has no word for every core, and any will do
        assert all(component.get(key) for key in ("Cclass", "Cgroup", "Cversion"))
    assert all((root / str(file.get("name"))).exists() for file in pack.iter("file"))
    assert {file.get("name") for file in pack.iter("file")} >= {
        f"src/{file.name}" for file in (root / "src").glob("*.c")
    }


@pytest.mark.parametrize("system", ["platformio", "zephyr"])
def test_the_sample_compiles(packages, tmp_path, system):
    (sample,) = packages[system].rglob("main.c")
    run(*CC, "-std=c99", *FLAGS, "-I", packages[system] / "include", "-c", sample, "-o", "main.o", cwd=tmp_path)


# ---- the command ----


def test_the_command_writes_a_package_and_lists_it(tmp_path, capsys):
    assert main(["export", str(tmp_path / "new"), "--for", "cmake", "--prefix", "gait", "--f32", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)["files"]
    assert sorted(listed) == sorted(map(Path.as_posix, package(Wanted("cmake", "gait", ("f32",)))))
    assert not [name for name in listed if "f64" in name or "hopform" in name]


@pytest.mark.parametrize(
    ("arguments", "named"),
    [(["--for", "make"], "--for"), (["--prefix", "Gait"], "--prefix"), (["--prefix", "2"], "--prefix")],
)
def test_what_cannot_be_exported_is_refused_in_one_line(tmp_path, capsys, arguments, named):
    assert main(["export", str(tmp_path / "new"), *arguments]) == 2
    error = capsys.readouterr().err
    assert named in error and len(error.splitlines()) == 1
    assert not (tmp_path / "new").exists()


def test_a_folder_with_files_is_left_alone(tmp_path, capsys):
    (tmp_path / "mine").write_text("mine", "utf-8")
    assert main(["export", str(tmp_path)]) == 2
    assert [file.name for file in tmp_path.iterdir()] == ["mine"]
    assert str(tmp_path) in " ".join(capsys.readouterr().err.split())


def test_the_digests_of_the_selftest_are_printed(capsys):
    from hopform._export import selftest

    assert main(["selftest", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["hopform_selftest_f32"] == f"{selftest():08x}"
