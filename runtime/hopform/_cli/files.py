"""The files of a command: checked before it begins, written when it is done."""

import os
from collections.abc import Iterable
from pathlib import Path

from hopform._errors import HopformError

Named = tuple[str, str | Path | None]
"""What a file is to the command, an option mostly, and its path; None where it is not asked for."""


def check_files(reads: Iterable[Named], writes: Iterable[Named]) -> None:
    """HopformError for an output that cannot be written, would overwrite an input, or is another output too."""
    inputs = [(what, path) for what, path in reads if path is not None]
    outputs = list[tuple[str, str | Path]]()
    for what, path in writes:
        if path is None:
            continue
        check_writable(Path(path))
        for other, read in inputs:
            if are_one(read, path):
                raise HopformError(f"{what} {path} would overwrite {other} {read}: name another file")
        for other, written in outputs:
            if are_one(written, path):
                raise HopformError(f"two outputs name the same file: {other} {written} and {what} {path}")
        outputs.append((what, path))


def check_writable(path: Path) -> None:
    """HopformError for a folder, and for a file in a folder that is not there."""
    try:
        is_folder, has_folder = path.is_dir(), path.parent.is_dir()
    except OSError as error:
        raise HopformError(f"{path} cannot be written: {error.strerror}") from None
    if is_folder:
        raise HopformError(f"{path} cannot be written: it is a folder")
    if not has_folder:
        raise HopformError(f"{path} cannot be written: there is no folder {path.parent}")


def are_one(first: str | Path, second: str | Path) -> bool:
    """Whether two paths lead to one file, through links and by other names; also where it is not there yet."""
    if os.path.realpath(first) == os.path.realpath(second):
        return True
    return os.path.exists(first) and os.path.exists(second) and os.path.samefile(first, second)


def write(path: Path, content: bytes) -> None:
    """Write aside and rename, so that a file is there in whole or not at all; a device is written as it is."""
    target = Path(os.path.realpath(path))
    aside = target.with_name(f".{target.name}.{os.getpid()}.tmp")
    try:
        if target.exists() and not target.is_file():
            target.write_bytes(content)
        else:
            aside.write_bytes(content)
            os.replace(aside, target)
    except OSError as error:
        raise HopformError(f"{path} cannot be written: {error.strerror}") from None
    finally:
        aside.unlink(missing_ok=True)
