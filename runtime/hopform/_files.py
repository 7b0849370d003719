"""Files that hopform reads and writes, by one rule each way.

What is read is a regular file of a limited size, or a link to one, in UTF-8, with or without a byte order mark. What is
written is checked before the work, against all that the command reads and writes; it is written aside and renamed, so
that a file is there in whole or not at all, and a file that is replaced keeps its mode. Names and texts from outside
reach a terminal or a message only as printable characters.
"""

import csv
import io
import os
import secrets
import stat
from collections.abc import Generator, Iterable, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hopform._checks import shown
from hopform._errors import HopformError, printable

LARGEST = 2**26
"""[B] the largest file that is read: a recording of a million samples."""

Named = tuple[str, str | Path | None]
"""What a file is to the command, an option mostly, and its path; None where it is not asked for."""


def path_of(name: str, value: object) -> Path:
    """The value as a path; HopformError for what is none."""
    try:
        path = Path(value)  # type: ignore[arg-type]
        if b"\0" not in os.fsencode(path):
            return path
    except Exception:
        pass
    raise HopformError(f"{name} must be a path, got {shown(value)}")


@contextmanager
def _possible(path: str | Path, what: str) -> Generator[None, None, None]:
    """HopformError where the system refuses what is done: `path` cannot be read, written, made."""
    try:
        yield
    except OSError as error:
        raise HopformError(f"{name_of(path)} cannot be {what}: {error.strerror}") from None


def _at_once(name: str, flags: int) -> int:
    """Open a file without waiting for the other end of a pipe."""
    return os.open(name, flags | getattr(os, "O_NONBLOCK", 0))


# ---- in ----


def read_text(path: Path, most: int = LARGEST) -> str:
    """The text of a file of at most `most` bytes; HopformError says why it cannot be read."""
    with _possible(path, "read"), open(path, "rb", opener=_at_once) as file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            raise HopformError(f"{name_of(path)} cannot be read: it is not a regular file")
        raw = file.read(most + 1)
    if len(raw) > most:
        raise HopformError(f"{name_of(path)} cannot be read: it has more than {most} bytes")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line, byte = raw.count(b"\n", 0, error.start) + 1, raw[error.start]
        got = f"got a byte {byte:#04x}: save it in UTF-8"
        raise HopformError(f"{name_of(path)}, line {line}: is not text in UTF-8, {got}") from None


def rows_of(text: str, source: str, separator: str = ",") -> list[tuple[int, list[str]]]:
    """The rows of a CSV text that are not blank, each with its line; HopformError for what is not a CSV."""
    reader = csv.reader(io.StringIO(text, newline=None), delimiter=separator)
    try:
        return [(reader.line_num, row) for row in reader if any(map(str.strip, row))]
    except csv.Error as error:
        raise HopformError(f"{source}, line {reader.line_num}: is not a CSV: {error}") from None


def read_rows(path: object) -> tuple[str, list[tuple[int, list[str]]]]:
    """A CSV file: how messages call it, and its rows that are not blank, each with its line.

    Raises HopformError for what is no path, no regular file of a limited size in UTF-8, or no CSV.
    """
    file = path_of("path", path)
    return name_of(file), rows_of(read_text(file), name_of(file))


# ---- out ----


def csv_of(columns: Mapping[str, ArrayLike]) -> str:
    """Columns of one length as CSV; every number reads back to the same bits."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*(np.asarray(column).tolist() for column in columns.values()), strict=True))
    return text.getvalue()


def check_files(reads: Iterable[Named], writes: Iterable[Named]) -> None:
    """HopformError for an output that cannot be written, would overwrite an input, or is another output too."""
    inputs = [(what, path_of(what, path)) for what, path in reads if path is not None]
    outputs = [(what, path) for what, path in writes if path is not None]
    for n, (what, path) in enumerate(outputs):
        check_writable(path_of(what, path))
        for other, read in inputs:
            if are_one(read, path):
                raise HopformError(f"{what} {name_of(path)} would overwrite {other} {name_of(read)}: name another file")
        for other, written in outputs[:n]:
            if are_one(written, path):
                message = f"two outputs name the same file: {other} {name_of(written)} and {what} {name_of(path)}"
                raise HopformError(message)


def check_writable(path: Path) -> None:
    """HopformError for a folder, for a file that may not be written, and for one in a folder where none can be made."""
    target = Path(os.path.realpath(path))
    with _possible(path, "written"):
        if target.is_dir():
            raise HopformError(f"{name_of(path)} cannot be written: it is a folder")
        if target.exists() and not os.access(target, os.W_OK):
            raise HopformError(f"{name_of(path)} cannot be written: it is write-protected")
        if not path.parent.is_dir():
            raise HopformError(f"{name_of(path)} cannot be written: there is no folder {name_of(path.parent)}")
        if not target.exists() or target.is_file():
            _written_aside(target.parent, b"").unlink()


def check_folder(folder: Path) -> None:
    """HopformError unless a folder is there, or can be made with those above it, and files can be made in it."""
    with _possible(folder, "made"):
        folder.exists()  # which raises for a name that no folder can have
        place = next(each for each in (folder, *folder.parents) if os.path.lexists(each))
        if not place.is_dir():
            raise HopformError(f"{name_of(folder)} cannot be made: {name_of(place)} is a file, not a folder")
        _written_aside(place, b"").unlink()


def are_one(first: str | Path, second: str | Path) -> bool:
    """Whether two paths lead to one file, through links and by other names; also where it is not there yet."""
    if os.path.realpath(first) == os.path.realpath(second):
        return True
    return os.path.exists(first) and os.path.exists(second) and os.path.samefile(first, second)


Content = bytes | str | Mapping[str, ArrayLike]
"""What is written: bytes, a text, or columns of one length, which become a CSV."""


def text_of(content: str | Mapping[str, ArrayLike]) -> str:
    """A text, or columns as CSV."""
    return content if isinstance(content, str) else csv_of(content)


def write(files: Mapping[Any, Content]) -> None:
    """Write files, by their paths, aside, then rename them all; a device is written as it is, if somebody reads it.

    Raises HopformError for what is no path, and where a file cannot be written.
    """
    asides = list[tuple[Path, Path, Path]]()
    try:
        for name, given in files.items():
            path = path_of("path", name)
            content = given if isinstance(given, bytes) else text_of(given).encode()
            with _possible(path, "written"):
                target = Path(os.path.realpath(path))
                if target.exists() and not target.is_file():
                    with open(target, "wb", opener=_at_once) as file:
                        os.set_blocking(file.fileno(), True)
                        file.write(content)
                    continue
                asides.append((path, _written_aside(target.parent, content), target))
                if target.exists():
                    asides[-1][1].chmod(stat.S_IMODE(target.stat().st_mode))
        for path, aside, target in asides:
            with _possible(path, "written"):
                aside.replace(target)
    finally:
        for _, aside, _ in asides:
            aside.unlink(missing_ok=True)


def write_folder(folder: Path, files: Mapping[Path, bytes]) -> None:
    """Write files into a folder, which is made, and those in it; what was made goes again if one cannot be written."""
    made = list[Path]()
    try:
        for place in sorted({folder, *(folder / path.parent for path in files)}):
            for each in reversed([each for each in (place, *place.parents) if not each.exists()]):
                with _possible(folder, "made"):
                    each.mkdir()
                made.append(each)
        write({folder / path: content for path, content in files.items()})
    except HopformError:
        for each in reversed(made):
            each.rmdir()
        raise


def _written_aside(folder: Path, content: bytes) -> Path:
    """A new file in a folder, under a name that no other process takes and that is never too long."""
    aside = folder / f".hopform-{secrets.token_hex(8)}.tmp"
    try:
        with aside.open("xb") as file:
            file.write(content)
    except OSError:
        aside.unlink(missing_ok=True)
        raise
    return aside


# ---- text ----


def name_of(path: str | Path) -> str:
    """A path as a message shows it: of a very long one both ends."""
    text = printable(str(path))
    return text if len(text) <= 2 * _END else f"{text[:_END]}...{text[-_END:]}"


_END = 200
"""Characters of either end of a path that is too long to be shown."""
