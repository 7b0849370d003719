"""Errors: every one is a `HopformError` with one clear message."""


class HopformError(ValueError):
    """Bad input: the message names the field, the value and what is allowed."""


class MissingExtra(HopformError, ImportError):
    """A part of hopform whose extra is not installed."""

    def __init__(self, what: str, extra: str) -> None:
        super().__init__(f"{what} needs the extra `{extra}`: pip install 'hopform[{extra}]'")


class BackendError(HopformError):
    """A back end that cannot be used: no library, or a stale one."""


def printable(text: str) -> str:
    """A text of printable characters, others as Python escapes them: no terminal obeys it."""
    return "".join(each if each.isprintable() else ascii(each)[1:-1] for each in text)
