"""Errors: every one is a `HopformError` with one clear message."""

from collections.abc import Generator
from contextlib import contextmanager


class HopformError(ValueError):
    """Bad input: the message names the field, the value and what is allowed."""


class MissingExtra(HopformError, ImportError):
    """A part of hopform whose extra is not installed; the message has the command that adds it to this installation."""

    def __init__(self, what: str, extra: str) -> None:
        super().__init__(f"{what} needs the extra `{extra}`: {_installs(extra)}")


class BackendError(HopformError):
    """The solver cannot be used: there is no library, or a stale one."""


@contextmanager
def noted(before: str = "", after: str = "") -> Generator[None, None, None]:
    """A `HopformError` in this block says before or after its message where in what was handed in it is."""
    try:
        yield
    except HopformError as error:
        raise HopformError(f"{before}{error}{after}") from None


def printable(text: str) -> str:
    """A text of printable characters, others as Python escapes them: no terminal obeys it."""
    return "".join(each if each.isprintable() else ascii(each)[1:-1] for each in text)


def _installs(extra: str) -> str:
    """The command that adds an extra to the Python that runs, from where hopform was installed: a checkout, a file or
    an address (PEP 610), or an index."""
    import json
    import shlex
    import sys
    from importlib.metadata import PackageNotFoundError, distribution
    from typing import Any
    from urllib.parse import unquote, urlsplit

    try:
        text = distribution("hopform").read_text("direct_url.json")
    except PackageNotFoundError:
        text = None
    origin: dict[str, Any] = json.loads(text) if text else {}
    url = str(origin.get("url", ""))
    wanted = [f"hopform[{extra}] @ {url}" if url else f"hopform[{extra}]"]
    folder: dict[str, Any] = origin.get("dir_info", {})
    if folder.get("editable"):
        wanted = ["--editable", f"{unquote(urlsplit(url).path)}[{extra}]"]
    return shlex.join([sys.executable, "-m", "pip", "install", *wanted])
