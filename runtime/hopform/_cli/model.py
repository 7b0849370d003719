"""The commands about model files: `hopform model check`, `build`, `list` and `show`.

A model file is a program, and reading it runs it. The derivation, and what compiles, is imported when it is asked for.
"""

import ast
import json as json_module
import os
import subprocess
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path
from typing import Any

from rich.console import RenderableType

from hopform import HopformError, __version__
from hopform import model as door
from hopform._checks import shown
from hopform._cli.options import Form
from hopform._cli.output import deliver, show, spaced, table
from hopform._errors import printable
from hopform._files import check_folder, name_of, path_of, read_text
from hopform._progress import progress_bar
from hopform._solver import build
from hopform._solver.choice import DEFAULT
from hopform._solver.folder import FACTS, Facts, built, facts_in, folder_at
from hopform._solver.loading import built_solvers, programs_of

LARGEST_MODEL = 2**20
"""[B] the largest model file."""


@contextmanager
def in_one_line() -> Generator[None, None, None]:
    """What the derivation refuses is bad input, said in one line."""
    try:
        yield
    except Exception as error:  # an interrupt loads nothing: it may have come while sympy was loaded
        if isinstance(error, door.ModelError):  # the other part cannot be loaded where the hopper is no model
            raise HopformError(str(error)) from None
        if isinstance(error, door.part("emit.folder").FolderError):
            raise HopformError(str(error)) from None
        raise


def readable(model: str) -> str:
    """A model file that can be read, or the name of a model that ships; HopformError for anything else."""
    with in_one_line():
        shipped = door.part("derivation").SHIPPED
    if model not in shipped:
        if not model.endswith(".py"):
            allowed = f"a model file, whose name ends in .py, or one of {', '.join(shipped)}"
            raise HopformError(f"FILE must be {allowed}, got {shown(model)}")
        read_text(path_of("FILE", model), LARGEST_MODEL)
    return model


def derived(model: str) -> Any:
    """The Derivation of a model file, or of a model that ships."""
    with in_one_line():
        return door.derive(readable(model))


def spelled(derivation: Any, formula: str | None, form: Form, f32: bool = False) -> str:
    """Formulas of a derivation as they are pasted."""
    if f32 and form != Form.c:
        raise HopformError(f"--f32 is for --as c, got --as {form}")
    with in_one_line():
        return str(derivation.show(formula, str(form), single=f32))


# ---- hopform model show, hopform model check ----


def model_show(model: str, formula: str | None = None, form: Form = Form.text, f32: bool = False) -> None:
    """Print the formulas that follow from a model, to paste.

    They go into a paper, a notebook or firmware. FORMULA is a name, a group (lagrangian, equations_of_motion, transfer,
    numerators, poles, partial_fractions, states, energies, control, event_functions) or a number of the paper.
    """
    print(spelled(derived(model), formula, form, f32), end="")


def model_check(model: str) -> None:
    """Check a model file: what can be solved, or why not.

    It shows what follows from the equations of motion. The file is run as Python: read it first.
    """
    derivation = derived(model)
    facts = door.part("emit.facts").facts(derivation.model, "", {})
    groups = ("equations_of_motion", "energies", "event_functions")
    formulas = {group: [each for each in derivation.formulas if each.group == group] for group in groups}
    headings = door.part("maths.formulas").GROUPS
    deliver((), (), "", lambda: spaced(
        printable(f"{facts['name']}: {facts['title']}"),
        "\n".join(map(printable, door.part("emit.facts").abilities(facts))),
        *(table(headings[group], ("name", "formula", "unit"), rows_of(formulas[group]), ("name", "formula", "unit"))
          for group in groups),
        table("Modes", ("held", "slips", "order", "must be >= 0"), list(modes(derivation)),
              ("held", "slips", "must be >= 0")),
        next_step(model),
    ))  # fmt: skip


def rows_of(formulas: list[Any]) -> list[tuple[str, str, str]]:
    return [(each.name, str(each.value), each.quantity.unit) for each in formulas]


def modes(derivation: Any) -> Iterator[tuple[str, str, str, str]]:
    """The modes of a model: what is held, what slips, the order, and the conditions that a robot may violate."""
    for each in derivation.modes:
        conditions = "; ".join(f"{name} = {value}" for name, value in each.conditions.items())
        yield ", ".join(each.held) or "nothing", ", ".join(each.slipping) or "nothing", str(each.order), conditions


def next_step(model: str) -> str:
    return printable(
        f"`hopform model build {model}` makes its solver, `hopform model show {model}` prints its formulas."
    )


# ---- hopform model build ----


def model_build(model: str, out: Path | None = None) -> None:
    """Build the solver of a model file.

    It has a package, a compiled library, equations and a robot's numbers. The file is run as Python, and the solver is
    a program: read the file first. Without --out it goes to the cache of solvers, by a hash of the model, hopform and
    the compiler: a second build is a look-up. Without a C compiler the solver has no library, and solves where there is
    one.
    """
    readable(model)
    with in_one_line():
        text = str(door.part("solver").source_of(model))
    try:
        folder = built() / hash_of(text) if out is None else out
        check_folder(folder)
    except (HopformError, RuntimeError) as error:  # RuntimeError: there is no home
        elsewhere = "; --out DIR builds it elsewhere" if out is None else ""
        raise HopformError(f"{error}{elsewhere}") from None
    compiler_in_words()  # which refuses a $CC that is no command
    known = out is None and is_whole(folder)
    if known:
        os.utime(folder / FACTS)  # the newest of its name is the one that its name means
    else:
        with progress_bar("deriving") as bar:
            make(model, folder, bar, in_cache=out is None)
    facts, library = facts_in(folder / FACTS), folder_at(folder).library
    warnings = (
        ()
        if library.is_file()
        else (f"there is no library; where a C compiler is, its first use makes it: {no_compiler()}",)
    )
    deliver((), warnings, "", lambda: summary(folder, facts, known))


def hash_of(text: str) -> str:
    """A word for all that a solver in the cache depends on: model, derivation, version, compiler and flags."""
    digest = sha256(f"{__version__}\n{compiler_in_words()}\n{text}\n".encode())
    for name, path in door.part("emit.sources").inputs():
        digest.update(f"{name}\n".encode() + path.read_bytes())
    digest.update(Path(build.__file__).read_bytes())
    return digest.hexdigest()[:16]


def compiler_in_words() -> str:
    """The compiler and its version; nothing where there is none."""
    try:
        command = build.compiler()
        asked = [*command, "--version"]
        done = subprocess.run(
            asked, stdin=subprocess.DEVNULL, capture_output=True, check=False, text=True, errors="replace"
        )
    except (build.NoCompiler, OSError):
        return ""
    except build.LibraryNotBuilt as error:
        raise HopformError(error.args[0]) from None
    return " ".join([*command, *done.stdout.splitlines()[:1]])


def no_compiler() -> str:
    try:
        return f"{build.compiler()[0]} does not run"
    except build.NoCompiler as error:
        return str(error)


def is_whole(folder: Path) -> bool:
    """Whether a solver in the cache is as it was built; one without a compiler has no library."""
    library = folder_at(folder).library
    try:
        programs_of(folder)
    except HopformError:
        return False
    return not library.exists() or build.damage(library) is None


def make(model: str, folder: Path, bar: Callable[..., None], *, in_cache: bool) -> None:
    """Derive and compile a solver aside, and rename it as a whole. A folder of the user's that is there already keeps
    its files of other names: the library goes first and comes last, the MANIFEST says what is ours at any time.
    """
    with in_one_line():
        texts = door.part("solver").solver(model)
    files, renamed = door.part("emit.folder"), in_cache or not folder.exists()
    if not renamed:
        with in_one_line():
            files.refuse_what_is_not_ours(texts, folder)
    parent = folder.parent if renamed else folder
    parent.mkdir(parents=True, exist_ok=True)
    with build.aside_in(parent, folder.resolve().name or "solver") as aside:
        with in_one_line():
            files.write(texts, aside)
        made, target = folder_at(aside).library, folder_at(folder).library
        try:
            build.compile_solver(aside, made, progress=lambda done, of: bar(done, of, "compiling"))
        except build.NoCompiler:
            pass
        except build.LibraryNotBuilt as error:
            raise HopformError(f"{name_of(folder)}: {error.args[0]}") from None
        if in_cache:
            build.put(aside, folder)
        elif renamed:
            aside.rename(folder)
        else:
            target.unlink(missing_ok=True)  # an old one would pass for the new sources'
            with in_one_line():
                files.write(texts, folder)
            build.move_libraries(made, target)


def summary(folder: Path, facts: Facts, known: bool) -> Iterator[RenderableType]:
    """What there is now, and how it is used."""
    done = "was there already, in" if known else "is built in"
    yield printable(f"{facts.name}: {facts.title}")
    yield f"The solver {done} {name_of(folder)}. It can: {', '.join(facts.can)}."
    yield f"{name_of(folder / 'EQUATIONS.md')} has its equations, {name_of(folder / 'robot.toml')} numbers to start from."


# ---- hopform model list ----


def model_list(json: bool = False) -> None:
    """List the solvers that there are, and the models that ship.

    Solvers are the one that ships and those in the cache that `model build` made; `model build NAME` makes one of a model
    that ships.
    """
    found = [entry(DEFAULT.facts, DEFAULT.folder.library, None)]
    found += [entry(facts_in(at / FACTS), folder_at(at).library, at) for at, _ in built_solvers()]
    there = {each["name"] for each in found}
    for name, path in door.shipped().items():
        title = (ast.get_docstring(ast.parse(path.read_text("utf-8"))) or "").partition("\n")[0]
        if name not in there:
            found.append({"name": name, "title": title, "can": [], "compiled": False, "folder": None})
    if json:
        print(json_module.dumps(found, indent=2))
        return
    rows = [(each["name"], ", ".join(each["can"]), "yes" if each["compiled"] else "no", where_of(each), each["title"])
            for each in found]  # fmt: skip
    head = ("name", "can", "compiled", "where", "title")
    show([table("", head, [tuple(map(printable, row)) for row in rows], head)])


def where_of(found: dict[str, Any]) -> str:
    """Where a solver of the list is, or how it is made."""
    made = "ships with hopform" if found["can"] else f"`hopform model build {found['name']}` makes it"
    return found["folder"] or made


def entry(facts: Facts, library: Path, folder: Path | None) -> dict[str, Any]:
    """A solver in the list; a folder of None is that of hopform itself."""
    where = None if folder is None else str(folder)
    return {
        "name": facts.name,
        "title": facts.title,
        "can": list(facts.can),
        "compiled": library.is_file(),
        "folder": where,
    }
