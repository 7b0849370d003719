"""`python -m derive`: what it writes, what `--check` says of whose doing, and what it refuses.

Every test works on a copy of derive/, templates/ and generated/. Where a formula changes, or the hash seed, the command
runs as people type it; elsewhere its main function runs here, with the copy's folders in place of the real ones.
"""

import ctypes
import hashlib
import os
import re
import runpy
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

import derive.__main__ as command
from derive.emit import folder as files
from derive.emit import sources
from derive.emit.render import render
from derive.model.equations import Model
from derive.model.precisions import PRECISIONS, Precision
from derive.shipped import HOPPER
from hopform._solver.build import compile_solver
from tests import needs

pytestmark = pytest.mark.sliced  # most run the derivation
ROOT = Path(__file__).resolve().parents[2]
FORMULAS = "python/hopform_solver/formulas.py"
OLD, NEW = "C_2 = a2_0 - f2*side_2", "C_2 = a2_0 + f2*side_2"


class Ran(NamedTuple):
    """How a run ended and what it printed."""

    code: int
    out: str
    err: str


def derive(tree: Path, *options: str | Path, seed: str = "0") -> Ran:
    """`python -m derive` of a copy, as people type it."""
    done = subprocess.run(
        [sys.executable, "-m", "derive", *options],
        cwd=tree,
        env=os.environ | {"PYTHONHASHSEED": seed, "PYTHONDONTWRITEBYTECODE": "1", "PYTHONPATH": ""},
        capture_output=True,
        text=True,
        check=False,
    )
    return Ran(done.returncode, done.stdout, done.stderr)


@pytest.fixture(scope="module")
def rendered() -> Callable[..., dict[Path, str]]:
    """What `render` says, kept by all that it reads: most tests are about what the command does with the same texts."""
    known: dict[tuple[str, ...], dict[Path, str]] = {}

    def remembered(model: Model = HOPPER, precisions: tuple[Precision, ...] = PRECISIONS) -> dict[Path, str]:
        if model is not HOPPER:
            return render(model, precisions)
        made_from = (f"{name}\n{path.read_text('utf-8')}" for name, path in sources.inputs())
        key = (*map(str, precisions), *made_from)
        if key not in known:
            known[key] = render(model, precisions)
        return dict(known[key])

    return remembered


@pytest.fixture
def run(request, fresh, rendered, monkeypatch, capsys) -> Callable[..., Ran]:
    """The same in this process, of the copy that the test breaks or, if it breaks none, of the one that all share."""
    tree = request.getfixturevalue("tree") if "tree" in request.fixturenames else fresh
    monkeypatch.chdir(tree)
    monkeypatch.setattr(command, "render", rendered)
    for module, name, path in (
        (sources, "SOURCES", {name: tree / name for name in sources.SOURCES}),
        (files, "GENERATED", tree / "generated"),
        (command, "GENERATED", tree / "generated"),
    ):
        monkeypatch.setattr(module, name, path)

    def here(*options: str | Path) -> Ran:
        return Ran(command.main([str(option) for option in options]), *capsys.readouterr())

    return here


def copy(source: Path, target: Path) -> Path:
    for folder in ("derive", "templates", "runtime/engine", "generated"):
        shutil.copytree(source / folder, target / folder, ignore=shutil.ignore_patterns("__pycache__"))
    return target


@pytest.fixture(scope="module")
def fresh(tmp_path_factory) -> Iterator[Path]:
    """A copy whose generated/ was thrown away and made again."""
    tree = copy(ROOT, tmp_path_factory.mktemp("fresh"))
    shutil.rmtree(tree / "generated")
    done = derive(tree)
    assert done.code == 0, done.err
    before = contents(tree)
    yield tree
    assert contents(tree) == before, "a test has written into what all share"


@pytest.fixture
def tree(fresh, tmp_path) -> Path:
    """A copy of one's own, to break."""
    return copy(fresh, tmp_path)


def contents(folder: Path) -> dict[str, bytes]:
    found = [path for path in folder.rglob("*") if path.is_file()]
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in found}


def replace(path: Path, old: str, new: str) -> None:
    text = path.read_text("utf-8")
    assert old in text, f"{path.name} has no {old!r}"
    path.write_text(text.replace(old, new, 1), "utf-8")


def complaints(ran: Ran, folder: str = "generated") -> list[str]:
    """What `--check` says of a stale copy, line by line, without its last one."""
    assert ran.code == 1, ran
    *lines, last = ran.err.splitlines()
    assert last == f"derive: {folder}/ is out of date: run `make generate`"
    return lines


# ---- what --check says ----


def test_a_fresh_copy_passes_in_silence(run):
    assert run("--check") == (0, "", "")


def test_a_hand_edit_is_named_and_shown_and_left_alone(run, tree):
    replace(tree / "generated" / FORMULAS, OLD, NEW)
    before = contents(tree)
    ran = run("--check")
    assert complaints(ran) == [f"derive: {FORMULAS} is not what is derived"]
    assert [line[0] for line in ran.out.splitlines() if OLD in line or NEW in line] == ["-", "+"]
    assert contents(tree) == before


def test_a_file_that_is_missing_is_named(run, tree):
    (tree / "generated" / "c" / "src" / "version.c").unlink()
    assert complaints(run("--check")) == ["derive: c/src/version.c is missing"]


def test_a_stray_file_is_named_and_caches_are_none(run, tree):
    (tree / "generated" / "python" / "hopform_solver" / "__pycache__").mkdir()
    (tree / "generated" / "python" / "hopform_solver" / "__pycache__" / "stance.pyc").write_bytes(b"")
    (tree / "generated" / "c" / "src" / "old.c").write_text("int old;\n")
    assert complaints(run("--check")) == [
        "derive: c/src/old.c is a stray file: neither a template nor the engine makes it"
    ]


@pytest.mark.parametrize(
    ("path", "old", "new", "kind"),
    [
        ("templates/c/src/series_real.h.j2", "and tables", "and lists", "template"),
        pytest.param("runtime/engine/c/phase_real.h", "/* ", "/*  ", "engine", marks=pytest.mark.nightly),
        ("derive/model/equations.py", '"""', '"""\n', "model"),
        pytest.param("derive/emit/c.py", '"""', '"""\n', "generator", marks=pytest.mark.nightly),
    ],
)
def test_in_a_folder_of_ones_own_whoever_was_changed_is_named_even_where_no_text_changes(
    run, tree, tmp_path, path, old, new, kind
):
    out = tmp_path / "out"
    assert run("--out", out).code == 0
    replace(tree / path, old, new)
    assert complaints(run("--check", "--out", out), "out") == [f"derive: the {kind} was changed since: {path}"]


def test_what_moves_no_text_leaves_generated_fresh(run, tree):
    replace(tree / "derive/emit/c.py", '"""', '"""\n')
    assert run("--check") == (0, "", "")


@pytest.mark.nightly
def test_comments_formulas_and_the_engine_do_not_move_the_layout_and_the_number_of_a_status_does(tree):
    def layout() -> str:
        assert derive(tree).code == 0
        (word,) = re.findall(r'LAYOUT = "(\w{16})"', (tree / "generated/python/hopform_solver/__init__.py").read_text())
        return str(word)

    before = layout()
    replace(tree / "derive/maths/laplace.py", "a2_0 - model.levels[1] * side_2", "a2_0 + model.levels[1] * side_2")
    replace(tree / "templates/c/include/hopform/hopform.h.j2", "Members of hopform_robot.", "Its members.")
    replace(tree / "runtime/engine/c/phase_real.h", "/* ", "/*  ")
    assert layout() == before
    replace(tree / "derive/model/kinds.py", 'Word(3, "searching"', 'Word(4, "searching"')
    assert layout() != before


@pytest.mark.nightly
def test_a_changed_formula_is_shown_in_both_languages(tree):
    replace(tree / "derive/maths/laplace.py", "a2_0 - model.levels[1] * side_2", "a2_0 + model.levels[1] * side_2")
    before = contents(tree)
    ran = derive(tree, "--check")
    assert f"derive: {FORMULAS} is not what is derived" in complaints(ran)
    for line in (f"-    {OLD} ", f"+    {NEW} ", f"-    const double {OLD};", f"+    const float {NEW};"):
        assert any(shown.startswith(line) for shown in ran.out.splitlines()), line
    assert contents(tree) == before


LETTERS = "derive/model/equations.py", "k * c - gamma2 * u - b1 * v1", "k * c - gamma2 * u - 2 * b1 * v1"
DAMPED = "derive/models/hopper.py", "viscous(x1, b1)", "viscous(x1, 2 * b1)"
DIFFERS = (
    "(3) of derive/models/hopper.py differs from the paper's by -b1 v1/m_eff: what follows is no register of the paper"
)


@pytest.mark.parametrize("edit", [LETTERS, DAMPED])
def test_another_equation_than_the_papers_is_derived_and_the_register_claims_nothing(tree, edit):
    file, old, new = edit
    replace(tree / file, old, new)
    ran = derive(tree)
    assert (ran.code, ran.out) == (0, "")
    (line,) = ran.err.splitlines()
    assert line.startswith(f"derive: {DIFFERS}; ") and "`hopform model build`" in line
    page, *_ = equations = (tree / "generated/EQUATIONS.md").read_text("utf-8").splitlines()
    assert page == DIFFERS
    assert not any("agrees" in row or "wrong" in row for row in equations), "no verdict is left"
    assert any(r"2 b_1 \dot{x}_1" in row or r"2 \dot{x}_1 b_1" in row for row in equations), "it has the new equation"
    package = runpy.run_path(str(tree / "generated/python/hopform_solver/equations.py"))
    for each in package["EQUATIONS"]:
        assert (each.verdict, each.derived, each.reason, each.computed_by) == ("not claimed", "", DIFFERS, ())
        assert each.printed
    ran = derive(tree, "--check")
    assert (ran.code, ran.out, ran.err.splitlines()) == (1, "", [line]), "fresh, and red all the same"


def test_a_file_of_the_hopper_that_is_no_model_is_one_line(tree):
    replace(tree / "derive/models/hopper.py", 'force(x1, k * c, "offset")', 'force(x1, -k * c, "offset")')
    before = contents(tree)
    for options in ((), ("--check",), ("--model", "derive/models/cart.py", "--out", "cart")):
        ran = derive(tree, *options)
        assert (ran.code, ran.out, len(ran.err.splitlines())) == (2, "", 1)
        assert "derive/models/hopper.py: line 41: force 'offset': another entry of the ledger has its name" in ran.err
    assert contents(tree) == before


@needs.library
@pytest.mark.skipif(not shutil.which("make"), reason="make is absent")
def test_an_edited_equation_reaches_the_commands(tree):
    """Edit, generate, solve, as a user of a checkout does; and between them what is stale says so and is not used."""
    for name in ("runtime/hopform", "tools"):
        shutil.copytree(ROOT / name, tree / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "Makefile", tree)
    paths = os.pathsep.join(str(tree / path) for path in ("runtime", "generated/python", "."))
    environment = os.environ | {"PYTHONPATH": paths, "PYTHONDONTWRITEBYTECODE": "1"}

    def ran(*command: str) -> Ran:
        done = subprocess.run(command, cwd=tree, env=environment, capture_output=True, text=True, check=False)
        return Ran(done.returncode, done.stdout, done.stderr)

    def stance() -> Ran:
        code = "import sys; from hopform._front import main; sys.exit(main())"
        drop = ("stance", "--robot", "hopper_c", "--height", "0.2", "--u", "3")
        return ran(sys.executable, "-W", "always", "-c", code, *drop)

    assert "apex 0.2233 m" in stance().out
    file, old, new = DAMPED
    replace(tree / file, old, new)
    assert derive(tree).code == 0
    refused = stance()
    assert refused.code and refused.out == "" and "is stale" in refused.err, "the library has the old equation"
    made = ran("make", "-o", "venv", f"PY={sys.executable}", "generate")
    assert made.code == 0 and "built runtime/hopform/_libhopform" in made.out, made.err
    assert "apex 0.1955 m" in stance().out
    assert ran(sys.executable, "tools/build_library.py").out == "", "what is fresh is left alone"


def test_a_changed_template_and_a_hand_edit_are_both_named(run, tree, tmp_path):
    out = tmp_path / "out"
    assert run("--out", out).code == 0
    replace(tree / "templates/c/src/series_real.h.j2", "and tables", "and lists")
    replace(out / FORMULAS, OLD, NEW)
    assert sorted(complaints(run("--check", "--out", out), "out")) == [
        f"derive: {FORMULAS} was edited by hand or is missing",
        "derive: the template was changed since: templates/c/src/series_real.h.j2",
    ]


def test_another_text_with_the_same_hashes_is_laid_on_a_tool(run, tmp_path):
    """As if another version of a tool had written it: the file is what MANIFEST says, made from what is here."""
    out = tmp_path / "out"
    assert run("--out", out).code == 0
    path, manifest = out / FORMULAS, out / "MANIFEST"
    before = hashlib.sha256(path.read_bytes()).hexdigest()
    replace(path, OLD, NEW)
    replace(manifest, before, hashlib.sha256(path.read_bytes()).hexdigest())
    said = complaints(run("--check", "--out", out), "out")
    assert said == ["derive: all hashes agree but the text differs: a tool's version did it"]


# ---- what it writes ----


def test_a_second_run_rewrites_nothing(run, tree):
    files = [path for path in (tree / "generated").rglob("*") if path.is_file()]
    before = [(path.stat().st_mtime_ns, path.stat().st_ino) for path in files]
    assert run() == (0, "", "")
    assert [(path.stat().st_mtime_ns, path.stat().st_ino) for path in files] == before


def test_a_run_takes_away_what_is_stray_and_mends_what_was_edited(run, tree, fresh):
    replace(tree / "generated" / FORMULAS, OLD, NEW)
    (tree / "generated" / "c" / "src" / "old.c").write_text("int old;\n")
    assert run().code == 0
    assert contents(tree / "generated") == contents(fresh / "generated")


@pytest.mark.nightly
def test_another_hash_seed_gives_the_same_bytes_and_out_writes_a_whole_tree(fresh, tmp_path):
    assert derive(fresh, "--out", tmp_path / "new" / "out", seed="20261").code == 0
    made, ours = contents(tmp_path / "new" / "out"), contents(fresh / "generated")
    names = re.findall(r"(?m)^[0-9a-f]{64}  (.*)$", made.pop("MANIFEST").decode().partition("# made from")[0])
    assert "\n".join(["# made", *names]) + "\n" == ours.pop("MANIFEST").decode()
    assert made == ours


@pytest.mark.nightly
def test_an_output_folder_loses_what_an_earlier_run_made_and_keeps_what_is_not_of_the_generator(run, tmp_path):
    out = tmp_path / "out"
    assert run("--out", out).code == 0
    (out / "mine.txt").write_text("mine")
    assert run("--out", out, "--float32").code == 0
    assert (out / "mine.txt").read_text() == "mine"
    assert not list((out / "c").rglob("*_f64*"))


# ---- whose files they are ----


def sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def list_as_made(out: Path, path: str, digest: str) -> None:
    """Add a line to the MANIFEST of a folder, or make a folder of nothing but such a MANIFEST."""
    out.mkdir(exist_ok=True)
    manifest = out / "MANIFEST"
    old = manifest.read_text("utf-8") if manifest.exists() else "# made\n# made from\n"
    manifest.write_text(old.replace("# made\n", f"# made\n{digest}  {path}\n", 1), "utf-8")


def refused(ran: Ran) -> str:
    """The one line that a refusal is."""
    assert (ran.code, ran.out) == (2, ""), ran
    (line,) = ran.err.splitlines()
    assert line.startswith("derive: ")
    return line


@pytest.mark.parametrize("digest", ["0000", sha256("mine")])
@pytest.mark.parametrize("way", ["../victim.txt", "c/../../victim.txt", "absolute", "link/victim.txt"])
@pytest.mark.parametrize("own", [False, True])
def test_a_manifest_that_names_files_elsewhere_is_not_believed(run, tmp_path, own, way, digest):
    """Nothing outside the folder is removed, whatever its MANIFEST says, and nothing is written."""
    out, victim = tmp_path / "out", tmp_path / "victim.txt"
    victim.write_text("mine")
    if own:
        assert run("--out", out, "--float32").code == 0
    list_as_made(out, str(victim) if way == "absolute" else way, digest)
    (out / "link").symlink_to(tmp_path)
    before = contents(tmp_path)
    assert "MANIFEST" in refused(run("--out", out))
    assert contents(tmp_path) == before


@pytest.mark.parametrize("folder", ["c", "python/hopform_solver"])
def test_a_folder_that_leads_elsewhere_is_not_written_into(run, tmp_path, folder):
    """A link within an own folder: what would be written through it lies outside."""
    out, elsewhere = tmp_path / "out", tmp_path / "elsewhere"
    assert run("--out", out).code == 0
    shutil.move(out / folder, elsewhere)
    (out / folder).symlink_to(elsewhere)
    before = contents(tmp_path)
    assert f"{folder}/" in refused(run("--out", out, "--float32"))
    assert contents(tmp_path) == before


@pytest.mark.parametrize("name", ["notes.txt", "EQUATIONS.md", "c/src/version.c", "c"])
def test_a_folder_that_was_not_made_by_derive_is_refused(run, tmp_path, name):
    out = tmp_path / "out"
    (out / name).parent.mkdir(parents=True)
    (out / name).write_text("mine")
    line = refused(run("--out", out))
    assert f"{out} " in line
    assert "not made by derive; choose an empty folder" in line
    assert contents(out) == {name: b"mine"}


@pytest.mark.parametrize(
    "text",
    [
        b"",
        b"mine",
        b"\xff\xfe\x00",
        b"# made\n0000  EQUATIONS.md\n# made from\n",
        b"# made\n" + b"0" * 64 + b"  a\n",
        b"# made from\n# made\n",
        b"# made\n" + b"0" * 64 + b"  a\0b\n# made from\n",
    ],
)
def test_a_manifest_that_is_none_is_refused(run, tmp_path, text):
    out = tmp_path / "out"
    out.mkdir()
    (out / "MANIFEST").write_bytes(text)
    for options in ((), ("--check",)):
        assert "not made by derive; choose an empty folder" in refused(run("--out", out, *options))
    assert contents(out) == {"MANIFEST": text}


def test_a_file_of_ones_own_where_one_would_be_made_is_refused_by_name(run, tmp_path):
    """Beside what derive made before, and listed nowhere; a text that is the derived one does no harm."""
    out = tmp_path / "out"
    assert run("--out", out, "--float32").code == 0
    (out / "c" / "src" / "hopform_f64.c").write_text("mine")
    before = contents(out)
    line = refused(run("--out", out))
    assert "c/src/hopform_f64.c" in line
    assert "not made by derive" in line
    assert contents(out) == before


@pytest.mark.parametrize("options", [(), ("--float32",)])
def test_a_file_that_was_edited_by_hand_is_refused_by_name_before_anything_is_written(run, tmp_path, options):
    """Whether the run would change this file or not."""
    out = tmp_path / "out"
    assert run("--out", out).code == 0
    edited = "EQUATIONS.md" if options else FORMULAS
    (out / edited).write_text((out / edited).read_text("utf-8") + "mine\n", "utf-8")
    before = contents(out)
    line = refused(run("--out", out, *options))
    assert f"{edited} was edited by hand" in line
    assert contents(out) == before


def test_a_stray_file_that_was_edited_by_hand_is_left(run, tmp_path):
    """It is no longer what derive made: only the others of the precision that is left out go."""
    out = tmp_path / "out"
    assert run("--out", out).code == 0
    (out / "c" / "src" / "hopform_f64.c").write_text("mine")
    assert run("--out", out, "--float32") == (0, "", "")
    assert [path for path in contents(out / "c") if "_f64" in path] == ["src/hopform_f64.c"]
    assert "stance_f64" not in (out / "MANIFEST").read_text("utf-8")


def test_an_interrupted_change_of_options_is_taken_up_again(run, tmp_path):
    """Files that are already what is asked for, while MANIFEST still has the hashes of before."""
    out, wanted = tmp_path / "out", tmp_path / "wanted"
    assert run("--out", out, "--float32").code == run("--out", wanted).code == 0
    for path in ("c/src/version.c", "c/include/hopform/hopform.h", "c/src/hopform_f64.c"):
        shutil.copy(wanted / path, out / path)
    assert run("--out", out).code == 0
    assert contents(out) == contents(wanted)


@pytest.mark.parametrize("options", [(), ("--check",)])
@pytest.mark.parametrize("where", ["file.txt", "loop", "nowhere", "/dev/full"])
def test_a_place_that_is_no_folder_is_refused_by_name(run, tmp_path, monkeypatch, where, options):
    here = tmp_path / "here"
    here.mkdir()
    (here / "file.txt").write_text("mine")
    (here / "loop").symlink_to("loop")
    (here / "nowhere").symlink_to("not_there")
    monkeypatch.chdir(here)
    assert refused(run("--out", where, *options)) == f"derive: --out {where} is not a folder"
    assert contents(here) == {"file.txt": b"mine"}


@pytest.mark.parametrize("where", ["file.txt/out", "/dev/full/out", "/proc/hopform", "n" * 300])
def test_a_folder_that_cannot_be_made_is_refused_by_name(run, tmp_path, monkeypatch, where):
    here = tmp_path / "here"
    here.mkdir()
    (here / "file.txt").write_text("mine")
    monkeypatch.chdir(here)
    assert where in refused(run("--out", where))
    assert contents(here) == {"file.txt": b"mine"}


@pytest.mark.parametrize("path", ["c/src/version.c", "MANIFEST", "c"])
def test_a_folder_where_a_file_belongs_or_the_other_way_round_is_refused(run, tmp_path, path):
    out = tmp_path / "out"
    assert run("--out", out).code == 0
    if (out / path).is_dir():
        shutil.rmtree(out / path)
        (out / path).write_text("mine")
    else:
        (out / path).unlink()
        (out / path).mkdir()
        (out / path / "mine.txt").write_text("mine")
    before = contents(out)
    assert path in refused(run("--out", out))
    assert contents(out) == before


def test_bytes_that_are_no_text_are_a_hand_edit_in_generated(run, tree, fresh):
    (tree / "generated" / FORMULAS).write_bytes(b"\xff\xfe\x00")
    assert complaints(run("--check")) == [f"derive: {FORMULAS} is not what is derived"]
    assert run().code == 0
    assert contents(tree / "generated") == contents(fresh / "generated")


def test_a_manifest_that_is_none_is_made_anew_in_generated(run, tree, fresh):
    (tree / "generated" / "MANIFEST").write_bytes(b"\xff\xfe\x00")
    assert run("--check").code == 1
    assert run().code == 0
    assert contents(tree / "generated") == contents(fresh / "generated")


# ---- one precision ----


@pytest.mark.parametrize(
    ("option", "kept", "left_out"),
    [("--float32", "f32", "f64"), pytest.param("--float64", "f64", "f32", marks=pytest.mark.nightly)],
)
def test_one_precision_leaves_the_other_out(run, fresh, tmp_path, option, kept, left_out):
    out = tmp_path / "out"
    assert run("--out", out, option) == (0, "", "")
    everything, made = contents(fresh / "generated"), contents(out)
    assert made.keys() == {path for path in everything if left_out not in path or path.startswith("python/")}
    assert not [path for path, data in made.items() if path.startswith("c/") and f"_{left_out}\n".encode() in data]
    library = tmp_path / "libone.so"
    compile_solver(out, library, "-O0")
    handle = ctypes.CDLL(str(library))
    assert hasattr(handle, f"hopform_solve_stance_{kept}")
    assert not hasattr(handle, f"hopform_solve_stance_{left_out}")


# ---- what it refuses ----


@pytest.mark.parametrize(
    ("options", "why"),
    [
        (("--float32",), "need --out DIR"),
        (("--model", "robot.py"), "need --out DIR"),
        (("--model", "nowhere.py", "--out", "out"), "there is no file nowhere.py"),
        (("--out", "derive/model/equations.py"), "derive/model/equations.py"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line_and_nothing_is_written(run, tree, options, why):
    before = contents(tree)
    ran = run(*options)
    assert ran.code == 2
    (line,) = ran.err.splitlines()
    assert line.startswith("derive: ")
    assert why in line
    assert contents(tree) == before


def test_two_precisions_exclude_each_other(run, tree):
    with pytest.raises(SystemExit) as refused:
        run("--out", "out", "--float32", "--float64")
    assert refused.value.code == 2
    assert not (tree / "out").exists()
