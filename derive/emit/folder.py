"""The generated files: written without loss of files that are not ours, and compared with the derivation's."""

import difflib
import hashlib
import os
import re
import sys
import tempfile
from pathlib import Path

from . import sources
from .sources import DERIVE

GENERATED = DERIVE.with_name("generated")
"""The product of the paper's hopper, in a checkout."""


MANIFEST = Path("MANIFEST")


class FolderError(ValueError):
    """A folder that holds what derive did not make where it would write or remove."""


def write(texts: dict[Path, str], folder: Path) -> None:
    """Write what differs, each file aside and then renamed; remove what an earlier run made and this one does not.

    generated/ holds nothing else, so whatever lies there is replaced or removed. Any other folder must be empty, or one
    that derive made and nobody edited where this run would write; files of other names stay. Its MANIFEST is written
    first with the hashes of before and of now, and last with those of now: what a killed run leaves is ours.
    """
    refuse_what_is_not_ours(texts, folder)
    texts = _with_manifest(texts, folder)
    strays = _stray(texts, folder)
    if not _is_generated(folder):
        before, head = _read(folder / MANIFEST).partition("# made from\n")[0], "# made\n"
        _replace(folder / MANIFEST, (before or head) + texts[MANIFEST].removeprefix(head))
    for path, text in texts.items():
        target = folder / path
        if not target.is_file() or _read(target) != text:
            _replace(target, text)
    for stray in strays:
        (folder / stray).unlink()


def _with_manifest(texts: dict[Path, str], folder: Path) -> dict[Path, str]:
    """The texts and their MANIFEST. That of generated/, where version control knows the contents, has the names of what
    was made; that of any other folder a hash per file that was made, and per file that it was made from.
    """
    if _is_generated(folder):
        lines = ["# made", *(path.as_posix() for path in sorted(texts))]
    else:
        outputs = (f"{_hash(text)}  {path.as_posix()}" for path, text in sorted(texts.items()))
        inputs = (f"{_hash(file.read_text('utf-8'))}  {path}" for path, file in sources.inputs())
        lines = ["# made", *outputs, "# made from", *inputs]
    return texts | {MANIFEST: "\n".join(lines) + "\n"}


def refuse_what_is_not_ours(texts: dict[Path, str], folder: Path) -> None:
    """Refuse a folder by the first file that derive did not make, or that was edited, where it would write."""
    if _is_generated(folder):
        return
    texts = _with_manifest(texts, folder)
    _refuse_what_is_no_folder(folder)
    if not folder.is_dir() or not any(folder.iterdir()):
        return
    if not (folder / MANIFEST).is_file():
        raise FolderError(f"--out {folder} has no {MANIFEST}: {_NOT_OURS}")
    hashes, _ = _read_manifest(folder)
    for path, text in texts.items():
        target = folder / path
        if not lies_in(target, folder):
            raise FolderError(f"--out {folder}: {path.parent}/ leads out of it: {_NOT_OURS}")
        for parent in path.parents:
            if (folder / parent).exists() and not (folder / parent).is_dir():
                raise FolderError(f"--out {folder}: {parent} is not a folder: {_NOT_OURS}")
        if target.exists() and not target.is_file():
            raise FolderError(f"--out {folder}: {path} is not a file: {_NOT_OURS}")
        allowed = {None, *hashes.get(path, ()), _hash(text)}  # None: there is no file
        if path != MANIFEST and _digest(target) not in allowed:
            reason = f"{path} was edited by hand: move it away" if path in hashes else f"{path} was {_NOT_OURS}"
            raise FolderError(f"--out {folder}: {reason}")


def _refuse_what_is_no_folder(folder: Path) -> None:
    if os.path.lexists(folder) and not folder.is_dir():
        raise FolderError(f"--out {folder} is not a folder")


_NOT_OURS = "not made by derive; choose an empty folder"


def _replace(target: Path, text: str) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    handle, aside = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
    with os.fdopen(handle, "w", encoding="utf-8", newline="\n") as file:
        file.write(text)
    Path(aside).chmod(0o644)
    Path(aside).replace(target)


def _stray(texts: dict[Path, str], folder: Path) -> list[Path]:
    """Files that a former run made, by MANIFEST and as it made them, or that lie in generated/ without being made."""
    if _is_generated(folder):
        there = {path.relative_to(folder) for path in folder.rglob("*") if path.is_file()}
        present = {path for path in there if "__pycache__" not in path.parts}
    else:
        hashes, _ = _read_manifest(folder)
        present = {path for path, digests in hashes.items() if _digest(folder / path) in digests}
    return sorted(present - texts.keys())


def _is_generated(folder: Path) -> bool:
    return os.path.realpath(folder) == os.path.realpath(GENERATED)


def lies_in(path: Path, folder: Path) -> bool:
    """Whether a path leads into a folder, or to it, once links and dots are resolved."""
    return Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder))


def _digest(path: Path) -> str | None:
    """The hash of a file's bytes, as MANIFEST has it; None where there is no file."""
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else None


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def check(texts: dict[Path, str], folder: Path) -> int:
    """Print how a folder differs from what the derivation says, and whose doing it is; 1 if it does."""
    _refuse_what_is_no_folder(folder)
    texts = _with_manifest(texts, folder)
    differing = [path for path, text in sorted(texts.items()) if _read(folder / path) != text]
    stray = _stray(texts, folder)
    for path in differing:
        old, new = _read(folder / path).splitlines(True), texts[path].splitlines(True)
        sys.stdout.writelines(list(difflib.unified_diff(old, new, str(folder / path), "as derived"))[:40])
    reasons = [f"{path} is a stray file: neither a template nor the engine makes it" for path in stray]
    reasons += _reasons(texts, folder, differing)
    if reasons:
        reasons.append(f"{folder.name}/ is out of date: run `make generate`")
    for reason in reasons:
        print(f"derive: {reason}", file=sys.stderr)
    return 1 if reasons else 0


def _reasons(texts: dict[Path, str], folder: Path, differing: list[Path]) -> list[str]:
    """Each file that differs. Of a folder other than generated/, whose MANIFEST has hashes, the kind of change: the
    model, a template, the generator, a file itself, or none of them.
    """
    if not differing:
        return []
    if _is_generated(folder):
        missing = {path for path in differing if not (folder / path).exists()}
        return [f"{path} is {'missing' if path in missing else 'not what is derived'}" for path in differing]
    outputs, inputs = _read_manifest(folder)
    _, inputs_now = _parse_manifest(texts[MANIFEST])
    reasons = [
        f"{path} was edited by hand or is missing"
        for path in differing
        if path != MANIFEST and outputs.get(path) != {_hash(_read(folder / path))}
    ]
    changed = {path for path in inputs.keys() | inputs_now.keys() if inputs.get(path) != inputs_now.get(path)}
    reasons += [f"the {_kind(path)} was changed since: {path}" for path in sorted(changed)]
    return reasons or ["all hashes agree but the text differs: a tool's version did it"]


def _kind(path: Path) -> str:
    """The kind of a file among the inputs."""
    derived = "generator" if path.parts[1] == "emit" or len(path.parts) == 2 else "model"
    return {"templates": "template", "runtime": "engine"}.get(path.parts[0], derived)


def _read(path: Path) -> str:
    """A file's text; bytes that are none differ from whatever is derived."""
    return path.read_text("utf-8", errors="replace") if path.is_file() else ""


_MANIFEST_LINE = r"[0-9a-f]{64}  [^\x00-\x1f]+\n"
_MANIFEST = re.compile(rf"# made\n(?:{_MANIFEST_LINE})*# made from\n(?:{_MANIFEST_LINE})*")


Hashes = dict[Path, set[str]]


def _read_manifest(folder: Path) -> tuple[Hashes, Hashes]:
    """Hashes of what was made and of what it was made from, by path; none without a MANIFEST. A run that was killed
    leaves two of what it would replace.

    Whoever handed a folder over may have written its MANIFEST: one that names a file outside the folder is refused.
    """
    text = _read(folder / MANIFEST)
    if not _MANIFEST.fullmatch(text):
        if (folder / MANIFEST).exists():
            raise FolderError(f"--out {folder}: its {MANIFEST} was {_NOT_OURS}")
        return {}, {}
    outputs, inputs = _parse_manifest(text)
    for path in outputs:
        if path.is_absolute() or ".." in path.parts or not lies_in(folder / path, folder):
            raise FolderError(f"--out {folder}: its {MANIFEST} names {path}, outside of it: {_NOT_OURS}")
    return outputs, inputs


def _parse_manifest(text: str) -> tuple[Hashes, Hashes]:
    outputs, inputs = Hashes(), Hashes()
    for part, hashes in zip(text.partition("# made from\n")[::2], (outputs, inputs), strict=True):
        for digest, path in re.findall("^(.+?)  (.+)$", part, re.MULTILINE):
            hashes.setdefault(Path(path), set()).add(digest)
    return outputs, inputs
