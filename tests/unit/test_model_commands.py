"""`hopform model check`, `build` and `list`: what they say, what they write, and that a second build is a look-up."""

import ast
import doctest
import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

import hopform
from derive import solver as solvers
from derive.emit import sources
from derive.emit.facts import facts
from derive.emit.toml import toml
from hopform import _front as cli
from hopform._cli import model as commands
from hopform._solver import build
from hopform.model import derive
from tests.derived import MODELS, SHIPPED, built, loaded, no_hopper, solver_of
from tests.needs import the_first

DAMPER = SHIPPED / "leg_damper.py"
THAT_SHIP = sorted(path.stem for path in SHIPPED.glob("[!_]*.py"))


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch) -> Path:
    """The cache of solvers of a user who has built none."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "hopform" / "solvers"


@pytest.fixture
def run(capsys):
    """What a command prints; its error in one line."""

    def called(*arguments: str | Path, code: int = 0) -> str:
        assert cli.main([str(each) for each in arguments]) == code
        printed = capsys.readouterr()
        assert code == 0 or (printed.out == "" and printed.err.count("\n") == 1)
        return printed.err if code else printed.out

    return called


# ---- check ----


def test_a_check_says_what_follows_and_what_the_model_can(run):
    said = run("model", "check", DAMPER)
    assert "It can: motion, fit, batches, derivatives, plots, export, stance, flight, hop, command, reach." in said
    assert re.search(r"^acc_2 +\(b12\*\(v1 - v2\).*m/s\^2 *$", said, re.MULTILINE)
    assert re.search(r"^contact_force +b12\*\(v1 - v2\) \+ k\*\(L0 \+ c \+ x1 - x2\) +N *$", said, re.MULTILINE)
    assert re.search(r"^damper_2_power +b12\*v2\*\(v1 - v2\) +W *$", said, re.MULTILINE)
    assert re.search(r"^actuator +body +2 +s\*\*2 \+ s\*\(b12 \+ b2\)/m_s \+ k/m_s *$", said, re.MULTILINE)


def test_a_check_says_what_a_model_cannot_and_which_robots_are_refused(run):
    joint = run("model", "check", MODELS / "joint.py")
    assert "No stance, flight or hop: the model has no contact()." in joint and joint.count("the model has") == 1
    assert "acc_2" not in joint and "contact_force" not in joint
    fed = run("model", "check", MODELS / "feedforward.py")
    assert re.search(r"^body +actuator +2 +s\*\*2 \+ .* \+ k/m_eff +p_1 = b1/m_eff - k_fed/m_eff *$", fed, re.MULTILINE)


@pytest.mark.sliced
def test_a_check_says_the_poles_of_the_defaults(run):
    """The eigenvalues of the file's own equations, in its coordinates; that of a motion as a whole is none of them."""
    J, link, N, k, d, b = 2e-5, 0.05, 50.0, 120.0, 0.05, 1e-5
    M, D, K = (
        np.diag([J, link]),
        d * np.outer([1 / N, -1], [1 / N, -1]) + np.diag([b, 0.0]),
        k * np.outer([1 / N, -1], [1 / N, -1]),
    )

    def poles(free: list[int]) -> str:
        at = np.ix_(free, free)
        size, inverse = len(free), np.linalg.inv(M[at])
        whole = np.block([[np.zeros((size, size)), np.eye(size)], [-inverse @ K[at], -inverse @ D[at]]])
        found = np.linalg.eigvals(whole)
        real = [f"{each.real:.4g}" for each in found if not each.imag and abs(each) > 1e-6]
        return ", ".join([*real, *(f"{each.real:.4g} +- {each.imag:.4g}i" for each in found if each.imag > 0)])

    said = run("model", "check", MODELS / "geared_sea.py")
    for held, slips, free in (("nothing", "rotor, link", [0, 1]), ("rotor", "link", [1]), ("link", "rotor", [0])):
        line = f"^{held} +{slips} +{len(free) + 1} +{re.escape(poles(free))} *$"
        assert re.search(line, said, re.MULTILINE), (line, said)
    servo = run("model", "check", SHIPPED / "servo.py")
    assert re.search(r"^nothing +joint, under the law +2 +-\d", servo, re.MULTILINE)


@pytest.mark.parametrize("command", ["check", "build"])
def test_what_is_no_model_is_refused_by_name(run, cache, command, tmp_path):
    said = run("model", command, no_hopper(tmp_path, "hardening"), code=2)
    assert "hardening.py: line 4: spring 'hardening spring': stiffness is k3" in said
    said = run("model", command, no_hopper(tmp_path, "ground"), code=2)
    assert "ground.py: line 3: spring 'ground spring' ties x1" in said
    assert "FILE must be a model file, whose name ends in .py" in run("model", command, "leg", code=2)
    assert not cache.exists() or not any(cache.iterdir())


# ---- build ----


def test_a_solver_has_its_model_its_equations_and_numbers_to_start_from(store):
    folder = built(store, "leg_damper")
    assert (folder / "model.py").read_bytes() == DAMPER.read_bytes()
    numbers = tomllib.loads((folder / "robot.toml").read_text("utf-8"))
    assert (numbers["model"], numbers["b12"], numbers["m_eff"]) == ("leg_damper", 0.0, 25.0)
    page = (folder / "EQUATIONS.md").read_text("utf-8")
    for group in ("Lagrangian", "Numerators", "Modes", "Events", "Conditions", "Energies"):
        assert re.search(rf"^## {group}", page, re.MULTILINE), group
    derivation = derive(DAMPER)
    for formula in derivation.formulas:
        assert f"`{formula.name}`" in page and derivation.latex(formula.name) in page
    manifest = (folder / "MANIFEST").read_text("utf-8")
    assert all(f"  {name}\n" in manifest for name in ("model.py", "robot.toml", "EQUATIONS.md", "solver.toml"))


def own_parameters(name):
    """What the file of a model declares itself, by name."""
    calls = (
        node for node in ast.walk(ast.parse((SHIPPED / f"{name}.py").read_text("utf-8"))) if isinstance(node, ast.Call)
    )
    return {ast.literal_eval(each.args[0]) for each in calls if getattr(each.func, "id", "") == "parameter"}


@pytest.mark.parametrize("name", THAT_SHIP)
def test_numbers_to_start_from_are_the_defaults_that_the_file_declares(name):
    """Whatever words the hopper has for a parameter of its own: its numbers come with its parameters, by `include`."""
    model, hopper = derive(name).model, hopform.load_robot("hopper_c")
    numbers = tomllib.loads("\n".join(solvers.numbers_of(model)))
    for each in model.parameters:
        if name == "hopper" or each.name not in own_parameters(name):
            wanted = getattr(hopper, each.name)
        elif each.default is None:
            wanted = 0.0 if 0.0 in each.interval else 1.0
        else:
            wanted = each.default
        assert numbers.pop(each.name) == wanted, each.name
    assert numbers.keys() == {"name", "model", "description", *(["travel"] if model.has_contact else [])}


WITH_DEFAULTS = {each for each in THAT_SHIP if all(q.default is not None for q in derive(each).model.parameters)}


@pytest.mark.parametrize("name", the_first(sorted(WITH_DEFAULTS, key=lambda each: (each != "relief_valve", each)), 0))
def test_a_robot_without_numbers_is_the_one_that_its_solver_comes_with(store, name):
    solver = solver_of(store, SHIPPED / f"{name}.py")
    assert solver.Robot().parameters == solver.load_robot(name).parameters


def test_a_built_solver_solves_what_its_robot_says(store):
    solver = hopform.load_solver(built(store, "leg_damper"))
    stance = solver.solve_stance(solver.load_robot(built(store, "leg_damper") / "robot.toml"), v2=-1.9, u=2.0)
    assert stance.status == "takeoff"


@pytest.fixture
def joint(store) -> Path:
    """The folder of a solver of one inertia on a spring to the ground."""
    return built(store, "joint")


@pytest.mark.sliced
def test_the_library_of_a_joint_carries_no_cubic_no_flight_and_no_controller(joint, tmp_path):
    """As an object, without help of a linker: a joint has one mass. Of what only a contact brings it has no source."""
    unit, include = joint / "c" / "src" / "hopform_f32.c", joint / "c" / "include"
    flags = ["-std=c99", "-Os", "-ffp-contract=off", "-I", include, "-c"]
    subprocess.run(["cc", *flags, unit, "-o", tmp_path / "joint.o"], check=True)
    symbols = subprocess.run(["nm", tmp_path / "joint.o"], check=True, capture_output=True, text=True).stdout
    there = {line.split()[-1].split(".")[0] for line in symbols.splitlines()}
    text = "".join(path.read_text("utf-8") for path in (joint / "c" / "src").iterdir())
    assert "cube_root_f32(" in text and "cube_root_f32" not in there
    for name in ("moved_in_flight", "add_work", "evaluate_candidate", "report_command"):
        assert f"{name}_f32(" in (HOPPER_C / FILE_OF[name]).read_text("utf-8"), name
        assert f"{name}_f32(" not in text, name
    assert {"hopform_solve_motion_f32", "hopform_plant_step_f32"} <= there
    assert not any("stance" in name or "flight" in name or "choose" in name for name in there)


HOPPER_C = Path(__file__).parents[2] / "generated" / "c" / "src"
FILE_OF = {
    "moved_in_flight": "flight_f32.h", "add_work": "flight_f32.h", "evaluate_candidate": "control_f32.h",
    "report_command": "control_f32.h",
}  # fmt: skip
"""Where the hopper's library has what a joint's has not."""


@pytest.mark.parametrize(("name", "start", "numbers"), [
    ("joint", {"phi": 0.3}, {"phi_0": 0.5, "phi_max": 0.6, "k": 40.0}),
    pytest.param("relief_valve", {"x": 0.001}, {"x_0": 0.007}, marks=pytest.mark.sliced),
    pytest.param("sea", {"theta": 0.2, "q": 0.05}, {"k": 90.0}, marks=pytest.mark.sliced),
])  # fmt: skip
def test_the_example_in_c_solves_the_motion_of_its_start(store, tmp_path, name, start, numbers):
    """The example itself, of another robot and start, in the coordinates of the file."""
    folder = built(store, name)
    solver = hopform.load_solver(folder)
    robot = solver.Robot(**{f.name: getattr(solver.load_robot(name), f.name) for f in solver.Robot.fields()} | numbers)
    example = (folder / "packages" / "example.c").read_text("utf-8")
    members = [each.split()[0] for each in re.search(r"start = \{.*\}; /\* (.*) \*/", example)[1].split(", ")]
    u = float(re.search(r"input = \{0\.0f, (\S+)f\};", example)[1])

    def spelled(values):
        numbers = (f"{max(-1e30, min(1e30, float(each))):.9g}" for each in values)
        return ", ".join(f"{each}f" if "." in each or "e" in each else f"{each}.0f" for each in numbers)

    program = re.sub(r"(robot = \{)[^}]*(\};)", rf"\g<1>{spelled(robot.parameters)}\2", example)
    placed = spelled(start.get(member, 0.0) for member in members)
    program = re.sub(r"(start = \{)[^}]*(\};)", rf"\g<1>{placed}\2", program)
    program = re.sub(
        r"return (hopform_solve_motion_f32\(.*\)) < 0;",
        r'const int32_t status = \1; return printf("%d %.9g %.9g", (int)status, motion.duration, motion.end.x1) < 0;',
        program,
    )
    (tmp_path / "example.c").write_text(f"#include <stdio.h>\n{program}", "utf-8")
    unit, include = folder / "c" / "src" / "hopform_f32.c", folder / "c" / "include"
    subprocess.run(
        ["cc", "-std=c99", "-O0", "-I", include, "example.c", unit, "-o", "example", "-lm"], cwd=tmp_path, check=True
    )
    status, duration, end = subprocess.run(
        ["./example"], cwd=tmp_path, check=True, capture_output=True, text=True
    ).stdout.split()
    motion = solver.solve_motion(robot, start=start, u=u, horizon=2.0, dtype="float32")  # to the bits
    first = next(iter(start.values()))
    assert (status, float(duration), float(end)) == (
        "0",
        float(f"{motion.duration:.9g}"),
        float(f"{motion.end[0]:.9g}"),
    )
    assert abs(motion.end[0] - first) > 1e-4


def test_the_examples_of_a_joint_run(joint):
    """Nothing of it falls: it starts at rest."""
    package = loaded(joint, "joint_of_examples")
    sys.modules["hopform_solver_of_joint"] = package
    text = (package.__doc__ or "").replace("from hopform_solver import", "from hopform_solver_of_joint import")
    example = doctest.DocTestParser().get_doctest(text, {}, "joint", None, None)
    assert doctest.DocTestRunner().run(example) == doctest.TestResults(failed=0, attempted=4)


@pytest.mark.sliced
def test_the_page_names_what_a_robot_must_obey():
    page = solvers.page(derive(MODELS / "feedforward.py"))
    assert "| body | `p_1` = `b1/m_eff - k_fed/m_eff` >= 0 |" in page
    assert "No motion of a mode grows" in solvers.page(derive(DAMPER))
    joint = solvers.page(derive(MODELS / "joint.py"))
    assert "x2_reverses" not in joint and "takeoff" not in joint and "the model has no contact()" in joint


@pytest.fixture
def quick(monkeypatch):
    """A build writes what is small, and compiles one source: a count of each."""
    made = {"derived": 0, "compiled": 0}

    def texts(model, *_):
        made["derived"] += 1
        known = toml(facts(solvers.model_of(model), "0" * 16, {}))
        return {Path("solver.toml"): known, solvers.MODEL: solvers.source_of(model)}

    def compiled(folder, output, progress):
        made["compiled"] += 1
        output.write_bytes(b"a library")
        build.sealed(output)
        progress(1, 1)

    monkeypatch.setattr(solvers, "solver", texts)
    monkeypatch.setattr(build, "compile_solver", compiled)
    return made


def test_a_second_build_is_a_look_up(run, cache, quick, tmp_path):
    first, second = run("model", "build", DAMPER), run("model", "build", DAMPER)
    assert quick == {"derived": 1, "compiled": 1}
    assert "The solver is built in" in first and "The solver was built before, in" in second
    (folder,) = cache.iterdir()
    assert (folder / "model.py").read_bytes() == DAMPER.read_bytes()


def test_another_model_another_compiler_or_another_derivation_is_built_anew(run, cache, quick, tmp_path, monkeypatch):
    model = tmp_path / "leg.py"
    shutil.copy(DAMPER, model)
    run("model", "build", model)
    model.write_text(model.read_text("utf-8") + "\n")
    run("model", "build", model)
    monkeypatch.setenv("CC", f"{sys.executable} -c pass")
    run("model", "build", model)
    engine = tmp_path / "engine.h"
    engine.write_text("another engine")
    inputs = [*sources.inputs(), ("runtime/engine/c/more.h", engine)]
    monkeypatch.setattr(sources, "inputs", lambda: inputs)
    run("model", "build", model)
    assert quick["derived"] == len(list(cache.iterdir())) == 4


def test_the_name_means_what_was_built_last(run, cache, quick, tmp_path):
    for text in ("", "\n", ""):
        (tmp_path / "leg.py").write_text(DAMPER.read_text("utf-8") + text)
        run("model", "build", tmp_path / "leg.py")
        for n, folder in enumerate(sorted(cache.iterdir(), key=lambda each: os.path.getmtime(each / "solver.toml"))):
            os.utime(folder / "solver.toml", (n + 1, n + 1))
    newest = max(cache.iterdir(), key=lambda each: os.path.getmtime(each / "solver.toml"))
    said = run("model", "list")
    assert re.findall(r"^leg .*solvers/(\S+)", said, re.MULTILINE) == [newest.name]
    assert said.endswith("older builds of these names: 1; --json lists them\n")
    listed = json.loads(run("model", "list", "--json"))
    assert [each["folder"] for each in listed if each["folder"]][-1] == str(newest)
    assert (newest / "model.py").read_text("utf-8") == DAMPER.read_text("utf-8")


def test_nothing_is_left_of_a_build_that_fails(cache, quick, monkeypatch, capsys):
    def broken(folder, output, progress):
        raise build.LibraryNotBuilt("cc does not compile c: error: no")

    monkeypatch.setattr(build, "compile_solver", broken)
    assert cli.main(["model", "build", str(DAMPER)]) == 2
    begun, refused = capsys.readouterr().err.splitlines()
    assert begun.startswith("hopform: compiling the solver of ") and "cc does not compile c: error: no" in refused
    assert not cache.exists()


def test_without_a_compiler_there_is_a_solver_without_a_library(capsys, cache, quick, monkeypatch):
    def absent(*_, **__):
        raise build.NoCompiler("there is no C compiler: set CC")

    monkeypatch.setattr(build, "compile_solver", absent)
    monkeypatch.setattr(build, "compiler", absent)
    assert cli.main(["model", "build", str(DAMPER)]) == 0
    assert (
        "warning: the library is not compiled (there is no C compiler: set CC); it is compiled at first use"
        in capsys.readouterr().err
    )
    assert cli.main(["model", "list"]) == 0
    assert re.search(r"^leg_damper .* no  .*solvers", capsys.readouterr().out, re.MULTILINE)


def test_a_folder_that_is_not_the_generators_is_refused(run, quick, tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").write_text("years of work")
    said = run("model", "build", DAMPER, "--out", tmp_path / "mine", code=2)
    assert "has no MANIFEST: not made by derive; choose an empty folder" in said
    assert [path.name for path in (tmp_path / "mine").iterdir()] == ["thesis.tex"]
    assert "is a file, not a folder" in run("model", "build", DAMPER, "--out", tmp_path / "mine/thesis.tex", code=2)


def test_zig_compiles_where_nothing_else_does(monkeypatch):
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr(build.shutil, "which", lambda _: None)
    monkeypatch.setattr(build, "find_spec", lambda name: name == "ziglang")
    assert build.compiler()[:4] == [sys.executable, "-m", "ziglang", "cc"]
    monkeypatch.setattr(build, "find_spec", lambda name: None)
    with pytest.raises(build.NoCompiler, match=r"set CC, or install one \(Debian: gcc; PyPI: hopform\[compiler\]\)"):
        build.compiler()
    monkeypatch.setenv("CC", "gcc -m32")
    assert build.compiler() == ["gcc", "-m32"]


@pytest.mark.parametrize("where", [(), ("--out", "out")])
@pytest.mark.parametrize("said", ["gcc '", 'gcc "', "gcc \\"])
def test_a_compiler_that_is_no_command_is_refused_before_anything_is_derived(
    run, quick, tmp_path, monkeypatch, said, where
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("CC", said)
    found = run("model", "build", DAMPER, *where, code=2)
    assert "CC must be a command, as a shell splits it, got" in found and quick["derived"] == 0


WARNED = """
import warnings
import numpy as np
warnings.warn("a thing of\\n two lines, \\x1b[1m loud")
warnings.warn("an old thing", FutureWarning)
np.float64(1.0) / np.float64(0.0)
assert 1 is 1
"""


@pytest.mark.sliced
@pytest.mark.parametrize("words", [("check",), ("show",)])
def test_a_warning_of_python_is_its_text_alone(tmp_path, words):
    """Of the author, of a library, of the interpreter: no file, no number, no line of a source."""
    (tmp_path / "leg.py").write_text(DAMPER.read_text("utf-8") + WARNED)
    command = [sys.executable, "-m", "hopform", "model", *words, "leg.py"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    lines = done.stderr.splitlines()
    assert len(lines) == 4 and all(line.startswith("hopform: warning: ") for line in lines), done.stderr
    assert "hopform: warning: a thing of two lines, \\x1b[1m loud" in lines
    assert "hopform: warning: divide by zero encountered in scalar divide" in lines
    assert not any(".py" in line for line in lines)


# ---- list ----


def test_the_list_has_the_hopper_and_needs_no_derivation(run, monkeypatch):
    monkeypatch.setattr(commands.door, "part", None)
    hopper, *models = json.loads(run("model", "list", "--json"))
    assert (hopper["name"], hopper["folder"]) == ("hopper", None) and "hop" in hopper["can"]
    assert {each["name"] for each in models} == {path.stem for path in SHIPPED.glob("[!_]*.py")} - {"hopper"}
    assert all(each["title"] and each["folder"] is None and not each["can"] for each in models)
    said = run("model", "list")
    assert said.count("ships with hopform") == 1
    assert all(f"`--solver {each['name']}` builds it" in said for each in models)


def test_help_says_that_a_model_file_is_run(run):
    for words in (("model", "--help"), ("model", "check", "--help"), ("model", "build", "--help")):
        assert re.search(r"runs (it|the file as Python)", " ".join(run(*words).split())), words
