"""The pages are true when they are run: examples in Python, commands as they stand there, C that compiles, the tables
that a program prints.
"""

import ast
import re
import shlex
import subprocess
import sys
from pathlib import Path
from zipfile import ZipFile

import pytest

from hopform import _front as cli
from tests import needs
from tests.bench.hopping import misses
from tests.derived import SHIPPED, built

ROOT = next(folder for folder in Path(__file__).resolve().parents if (folder / "pyproject.toml").is_file())
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(DOCS.rglob("*.md"))]


def text_of(page: str) -> str:
    return (DOCS / page).read_text("utf-8")


def commands(page: str) -> list[list[str]]:
    """The lines of a page that begin with hopform, as they are typed, without their comments."""
    return [
        shlex.split(line, comments=True) for line in re.findall(r"^(?:.venv/bin/)?hopform .*$", text_of(page), re.M)
    ]


def has_joint(cache: Path, monkeypatch: pytest.MonkeyPatch, store: Path) -> None:
    """Give the user another cache, with the joint of these sources: one that was built before keeps its own."""
    (cache / "hopform" / "solvers").mkdir(parents=True)
    (cache / "hopform" / "solvers" / "joint").symlink_to(built(store, SHIPPED / "joint.py"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(cache))


EXAMPLES = """
import doctest, sys
sys.path.insert(0, "")
outcome = doctest.testfile(sys.argv[1], module_relative=False)
sys.exit(outcome.attempted < 2 or outcome.failed > 0)
"""


SLOW = ("identification.md", "hop-over-terrain.md", "many-stances.md", "formulas-of-a-mechanism.md")
"""Pages whose examples fit, hop, derive or import for more than a second."""


IN_JAX = ("gradients-in-jax.md",)
"""Pages whose examples need JAX, which is there at night."""


def slower_if_slow(page: Path):
    if page.name in IN_JAX:
        return pytest.param(page, marks=(pytest.mark.nightly, needs.jax))
    return pytest.param(page, marks=pytest.mark.sliced if page.name in SLOW else ())


@pytest.mark.parametrize(
    "page",
    [slower_if_slow(page) for page in PAGES if ">>> " in page.read_text("utf-8")],
    ids=lambda page: page.name,
)
def test_the_examples_of_a_page_run(page):
    """As a reader runs them: in a process of their own, in which nothing is imported yet."""
    done = subprocess.run(
        [sys.executable, "-c", EXAMPLES, str(page)], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout) == (0, ""), done.stdout + done.stderr


def imports(page: Path) -> list[str]:
    """The imports of the first program of a page that is no session; empty where it imports nothing of hopform."""
    programs = re.findall(r"^```python\n((?!>>> ).*?)^```", page.read_text("utf-8"), re.DOTALL | re.MULTILINE)
    nodes = (
        [node for node in ast.parse(programs[0]).body if isinstance(node, ast.Import | ast.ImportFrom)]
        if programs
        else []
    )
    lines = [ast.unparse(node) for node in nodes]
    return lines if any("hopform" in line for line in lines) else []


@pytest.mark.parametrize("page", [slower_if_slow(page) for page in PAGES if imports(page)], ids=lambda page: page.name)
def test_the_imports_of_a_page_s_first_program_are_a_program(page):
    subprocess.run([sys.executable, "-c", "\n".join(imports(page))], cwd=ROOT, check=True)


@pytest.mark.parametrize(
    "page",
    [
        "how-to/hop-over-terrain.md",
        "how-to/use-another-robot.md",
        "reference/solvers.md",
        pytest.param("evidence/reference-set.md", marks=[pytest.mark.sliced, needs.mujoco]),
        pytest.param("how-to/another-force.md", marks=pytest.mark.sliced),
        pytest.param("how-to/formulas-of-a-mechanism.md", marks=pytest.mark.sliced),
        pytest.param("how-to/solve-a-motion.md", marks=pytest.mark.nightly),
        pytest.param("how-to/your-own-mechanism.md", marks=pytest.mark.sliced),
        pytest.param("reference/commands.md", marks=pytest.mark.sliced),
        pytest.param("tutorials/identification.md", marks=pytest.mark.nightly),
    ],
)
def test_the_commands_of_a_page_run_in_their_order_and_write_what_they_name(tmp_path, monkeypatch, capsys, page):
    monkeypatch.chdir(tmp_path)
    Path("heights.csv").write_text("height\n0\n0.01\n-0.01\n", "utf-8")
    for name, text in re.findall(r"```python\n# (\w+\.py)\n(.*?)```", text_of(page), re.DOTALL):
        Path(name).write_text(text, "utf-8")
    lines = commands(page)
    assert len(lines) >= 2
    for _, *typed in lines:
        arguments, (_, *target) = typed[: (end := (*typed, ">").index(">"))], (typed[end:] or [">"])
        assert cli.main(arguments) == 0, arguments
        printed = capsys.readouterr()
        said = re.sub(r"hopform: compiling the solver of \S+, which takes some \d+ s\n", "", printed.err)
        assert said == "" or "identification" in page, said
        for name in target:
            Path(name).write_text(printed.out, "utf-8")
        assert printed.out
        named = {word.rpartition(":")[2] for word in arguments if re.search(r"\.(svg|csv|npz|html)$", word)}
        assert all(Path(name).stat().st_size > 0 for name in named), arguments

    for program in re.findall(r"```python\n(import hopform\n.*?)```", text_of(page), re.DOTALL):
        exec(program, {})  # over what the commands have made


@pytest.mark.nightly
def test_the_page_on_a_joint_runs_from_its_first_line_to_its_last(tmp_path, monkeypatch, capsys):
    """Programs and commands in their order, in an empty folder: each reads what one before it has written."""
    monkeypatch.chdir(tmp_path)
    pieces = re.findall(
        r"^```python\n(.*?)^```|^hopform (--solver [^\n]*)$", text_of("how-to/fit-a-joint.md"), re.DOTALL | re.M
    )
    assert len(pieces) == 9
    for program, line in pieces:
        if program:
            exec(program, {})
        else:
            assert cli.main(shlex.split(line)) == 0, line
    assert "explains these recordings" in capsys.readouterr().out


@pytest.mark.sliced
def test_the_commands_of_the_readme_run_and_print_what_it_says(tmp_path, monkeypatch, capsys, store):
    """Its mechanism, of which each command prints its comment, and one command for each thing that a reader has."""
    has_joint(tmp_path / "cache", monkeypatch, store)
    monkeypatch.chdir(tmp_path)
    text = (ROOT / "README.md").read_text("utf-8")
    ((name, model),) = re.findall(r"```python\n# (\w+\.py)\n(.*?)```", text, re.DOTALL)
    Path(name).write_text(model, "utf-8")
    shown = re.findall(r"^(hopform .*?) +# (.+)$", text, re.MULTILINE)
    cells = re.findall(r"^\|[^|]*\| (`hopform [^|]*) \|", text, re.MULTILINE)
    doors = [line for cell in cells for line in re.findall(r"`([^`]+)`", cell)]
    assert (len(shown), len(cells), len(doors)) == (3, 8, 9)
    for line, words in (*shown, *((each, "") for each in doors)):
        capsys.readouterr()
        assert cli.main(shlex.split(line)[1:]) == 0, line
        assert words in capsys.readouterr().out, line


@pytest.mark.sliced
@needs.fmus
def test_the_page_on_fmus_says_what_its_programs_print(tmp_path, monkeypatch, store):
    """Its blocks in their order, as a reader runs them: programs, those that others import or build, commands. An FMU
    has the licence of the headers that it was compiled with.
    """
    has_joint(tmp_path / "cache", monkeypatch, store)
    page = text_of("how-to/use-an-fmu.md")
    rows = list[str]()
    for language, text in re.findall(r"^```(\w*)\n(.*?)^```", page, re.DOTALL | re.MULTILINE):
        if named := re.match(r"# (\w+\.py)\n", text):
            (tmp_path / named[1]).write_text(text, "utf-8")
            continue
        lines = [shlex.split(line) for line in text.splitlines() if line.startswith(("hopform ", "pythonfmu3 "))]
        runs = [["-c", text]] if language == "python" else [["-m", *words] for words in lines]
        for arguments in runs:
            command = [sys.executable, *arguments]
            done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
            assert done.returncode == 0, done.stderr
            rows += [line for line in done.stdout.splitlines() if line.startswith("| ")]
    assert len(rows) == 12 + 4 + 6 + 4 and [row for row in rows if f"{row}\n" not in page] == []
    with ZipFile(tmp_path / "joint_fmu" / "joint.fmu") as archive:
        licence = archive.read("documentation/licenses/fmi-headers.txt").decode()
        _, terms, _ = archive.read("sources/fmi3Functions.h").decode().split("-" * 76)
    assert licence.endswith(terms[1:]) and 'Modelica Association Project "FMI"' in licence


def test_the_table_of_hops_under_each_controller_is_what_the_benchmark_prints():
    page = text_of("evidence/controller.md")
    assert [row for row in misses() if not row.startswith("| exact") and row not in page] == []


def test_the_interrupt_and_the_plant_of_the_page_on_firmware_compile(tmp_path):
    interrupt, plant, _ = re.findall(r"```c\n(.*?)```", text_of("how-to/call-from-firmware.md"), re.DOTALL)
    for program in (interrupt, plant):
        compile_c(tmp_path, program, ROOT / "generated" / "c" / "include")


@pytest.mark.sliced
def test_the_calls_of_any_other_model_on_the_page_on_firmware_compile(tmp_path, store):
    """Against the library of the joint that the page builds."""
    *_, program = re.findall(r"```c\n(.*?)```", text_of("how-to/call-from-firmware.md"), re.DOTALL)
    compile_c(tmp_path, program, built(store, SHIPPED / "joint.py") / "c" / "include")


def compile_c(folder: Path, program: str, include: Path) -> None:
    (folder / "wiring.c").write_text(program, "utf-8")
    flags = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wdouble-promotion", "-Werror"]
    subprocess.run(["cc", *flags, "-I", str(include), "-c", "wiring.c"], cwd=folder, check=True)


@pytest.mark.sliced
def test_the_page_on_friction_says_what_its_program_and_its_board_print(tmp_path, monkeypatch, capsys):
    """Each row of its tables, and the compensation in C."""
    monkeypatch.chdir(tmp_path)
    page = text_of("how-to/friction-compensation-on-a-board.md")
    build, export = (line[1:] for line in commands("how-to/friction-compensation-on-a-board.md"))
    assert cli.main(build) == 0
    capsys.readouterr()
    (program,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    exec(program, {})
    rows = [line for line in capsys.readouterr().out.splitlines() if line.startswith("| ")]
    assert len(rows) == 6 and [row for row in rows if row not in page] == []
    assert cli.main(export) == 0
    package = Path("shoulder_firmware")
    folder = package / "examples" / "machine"
    (code,) = re.findall(r"```c\n(.*?)```", page, re.DOTALL)
    assert code in (folder / "control.c").read_text("utf-8")
    sources = [*folder.glob("*.c"), package / "src" / "hopform_f32.c"]
    flags = ["-std=c99", "-O1", "-ffp-contract=off", "-fno-math-errno", f"-I{package}/include"]
    subprocess.run(["cc", *flags, *map(str, sources), "-lm", "-o", "motion"], check=True)
    said = subprocess.run(["./motion"], capture_output=True, text=True, check=True).stdout
    printed = {tuple(line.rsplit(": ", 1)) for line in said.splitlines()}
    shown = re.findall(r"^\| ([^|]+) \| (\d+) \|$", page, re.MULTILINE)
    assert len(shown) == 5
    assert [
        row for row in shown if not any(text.endswith(row[0]) and row[1] == number for text, number in printed)
    ] == []
