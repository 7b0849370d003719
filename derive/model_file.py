"""A model from a file of elements: `python -m derive --model FILE.py`.

The file is run as Python. What it declares ends up in the names, comments and numbers of generated code, so whatever
could not stand there is refused in one line: the file, the element, the value and what is allowed.
"""

import difflib
import re
import runpy
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType, SimpleNamespace

from . import model
from .model.declare import Draft, drafted, shown
from .model.equations import Model, ModelError
from .model.mechanism import model_of


def read_model(path: Path) -> Model:
    """The model of a file; errors name the file, and the line that is at fault."""
    if not path.is_file():
        raise ModelError(f"--model: there is no file {path}")
    try:
        with drafted(path) as draft:
            docstring = _run(path)
        return model_of(draft, _name_of(path), _title_of(path, docstring), path.read_text("utf-8"))
    except ModelError as error:
        line = f"line {error.line}: " if error.line else ""
        raise ModelError(f"{path}: {line}{error}", error.line) from None


def draft_of(path: Path) -> Draft:
    """What a file declares, its elements as they stand in it; the file has been read as a model before."""
    with drafted(path) as draft:
        _run(path)
    return draft


def _run(path: Path) -> object:
    """Run a file, which fills the draft, and return its docstring; an exception becomes one line with the place."""
    try:
        with _door():
            return runpy.run_path(str(path)).get("__doc__")
    except (Exception, SystemExit) as error:
        line = _line_in(path, error)
        text = error.msg if isinstance(error, SyntaxError) else f"{error}{_known(path, error)}"
        kind = "" if isinstance(error, ModelError) else type(error).__name__
        message = ": ".join(part for part in (kind, shown(text, 400)) if part)
        raise ModelError(message, line) from None


def _known(path: Path, error: BaseException) -> str:
    """What there is in place of a name that a file does not have: a name of the file, the elements, or what an included
    file declares."""
    if isinstance(error, AttributeError) and isinstance(error.obj, SimpleNamespace):
        return f"; what is included has {', '.join(vars(error.obj))}"
    if not isinstance(error, NameError) or isinstance(error, UnboundLocalError):
        return ""
    if error.name in FUNCTIONS:
        return f": a force is linear in coordinates; {error.name} of a parameter is declared as a parameter of its own"
    frames = (frame for frame, _ in traceback.walk_tb(error.__traceback__) if frame.f_code.co_filename == str(path))
    names = {name: None for frame in frames for name in frame.f_globals if not name.startswith("_")}
    near = difflib.get_close_matches(str(error.name), names, 1)
    return f", did you mean {near[0]!r}?" if near else f"; hopform.model has {', '.join(model.__all__)}"


@contextmanager
def _door() -> Iterator[None]:
    """While a file runs, `hopform.model` is this derivation's own, whether or not hopform is installed beside it."""
    standing = {"hopform.model": model}
    if "hopform" not in sys.modules and find_spec("hopform") is None:
        standing["hopform"] = ModuleType("hopform")
    before = {name: sys.modules.get(name) for name in standing}
    sys.modules.update(standing)
    try:
        yield
    finally:
        for name, module in before.items():
            if module is None:
                del sys.modules[name]
            else:
                sys.modules[name] = module


FUNCTIONS = ("acos", "asin", "atan", "cos", "exp", "log", "sign", "sin", "sqrt", "tan", "tanh")


def _line_in(path: Path, error: BaseException) -> int | None:
    """The line of the file where an exception came from: the innermost one."""
    if isinstance(error, SyntaxError) and error.filename == str(path):
        return error.lineno
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)]
    return lines[-1] if lines else None


def _name_of(path: Path) -> str:
    """The name of a model is that of its file."""
    return re.sub(r"[^A-Za-z0-9_-]+", "_", path.stem)


def _title_of(path: Path, docstring: object) -> str:
    """The first line of the docstring."""
    lines = docstring.strip().splitlines() if isinstance(docstring, str) else []
    title = next(iter(lines), "")
    return title if title and title.isprintable() else f"The model {_name_of(path)}."


__all__ = ["Draft", "draft_of", "read_model"]
