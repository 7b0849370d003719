"""What the compilers make of generated/c, without the names:
functions and constants of each precision, for each target.

Two trees whose functions are the same instructions in another file, under another name, count as equal; one literal or
one operation more does not.
"""

import re
import shutil
import subprocess
import tempfile
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fno-math-errno", "-ffunction-sections", "-fdata-sections", "-c")
M4F = ("-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard")
COMPILERS = {
    "x86-64 gcc": (("gcc",), "objdump"),
    "x86-64 clang": (("clang",), "objdump"),
    "Cortex-M4F gcc": (("arm-none-eabi-gcc", *M4F), "arm-none-eabi-objdump"),
    "Cortex-M4F clang": (
        ("clang", "--target=arm-none-eabi", "-isystem", "/usr/lib/arm-none-eabi/include", *M4F),
        "arm-none-eabi-objdump",
    ),
}
"""Command and disassembler by target and compiler."""

_FUNCTION = re.compile(r"^[0-9a-f]+ <(.*)>:$")
_INSTRUCTION = re.compile(r"^\s*[0-9a-f]+:\s+(.*)$")
_RELOCATION = re.compile(r"^(R_\w+)\s+(\S+)$")
_SYMBOL = re.compile(r"\b[0-9a-f]+ <[^>+]*(\+0x[0-9a-f]+)?>")
_WORD = re.compile(r"^ [0-9a-f]+ ((?:[0-9a-f]{2,8} ?){1,4})", re.MULTILINE)

Part = tuple[str, str]
"""A function's name and its text, or a section's name and its bytes."""


def here() -> list[str]:
    """The targets whose compiler and disassembler are installed."""
    return [name for name, (command, tool) in COMPILERS.items() if shutil.which(command[0]) and shutil.which(tool)]


def parts(tree: Path, target: str) -> dict[str, list[Part]]:
    """Functions and constants of the library in `tree`, by precision; without the unit that holds the source hash."""
    command, tool = COMPILERS[target]
    include = tree / "generated" / "c" / "include"
    units = [unit for unit in sorted((tree / "generated" / "c" / "src").glob("*.c")) if unit.stem != "version"]
    if target.startswith("Cortex"):
        units = [unit for unit in units if not re.match(r"batch|flights|hops", unit.name)]
    found: dict[str, list[Part]] = {"f32": [], "f64": []}
    with tempfile.TemporaryDirectory() as folder:

        def compiled(unit: Path) -> tuple[str, list[Part]]:
            made = str(Path(folder, f"{unit.stem}.o"))
            subprocess.run(
                [*command, *FLAGS, "-I", str(include), str(unit), "-o", made], check=True, capture_output=True
            )
            code = subprocess.run([tool, "-dr", "--no-show-raw-insn", made], check=True, capture_output=True, text=True)
            data = subprocess.run([tool, "-s", made], check=True, capture_output=True, text=True)
            return unit.stem[-3:], [*_functions(code.stdout), *_constants(data.stdout)]

        with ThreadPoolExecutor(2) as pool:
            for precision, list_of_parts in pool.map(compiled, units):
                found[precision] += list_of_parts
    return found


def _functions(text: str) -> Iterator[Part]:
    """Each function with its instructions; of a reference only its kind is left,
    and where within this function it leads.
    """
    name, lines = "", list[str]()
    for line in [*text.splitlines(), "0 <>:"]:
        if start := _FUNCTION.match(line):
            if name:
                yield name, "\n".join(lines)
            name, lines = start.group(1), []
        elif instruction := _INSTRUCTION.match(line):
            words = " ".join(instruction.group(1).split())
            relocation = _RELOCATION.match(words)
            lines.append(relocation.group(1) if relocation else _SYMBOL.sub(_target, words).partition(" @ ")[0])


def _target(match: re.Match[str]) -> str:
    return f"here{match.group(1) or ''}"


def _constants(text: str) -> Iterator[Part]:
    """Each section of constants with its bytes; those that the linker merges as one set of numbers each."""
    for section in text.split("Contents of section ")[1:]:
        name, _, dump = section.partition(":")
        if not name.startswith(".rodata"):
            continue
        words = "".join("".join(match.group(1).split()) for match in _WORD.finditer(dump))
        merged = re.search(r"\.cst(\d+)$", name)
        if merged:
            size = 2 * int(merged.group(1))
            yield from ((".rodata.cst", words[at : at + size]) for at in range(0, len(words), size))
        else:
            yield ".rodata", words


def difference(old: list[Part], new: list[Part]) -> tuple[list[str], list[str]]:
    """The names of what only the old tree and only the new tree has;
    merged numbers count once however often they stand.
    """

    def only(one: list[Part], other: list[Part]) -> list[str]:
        left = Counter(text for _, text in one) - Counter(text for _, text in other)
        pool = {text for kind, text in other if kind == ".rodata.cst"}
        names = []
        for name, text in one:
            if left[text] > 0 and not (name == ".rodata.cst" and text in pool):
                left[text] -= 1
                names.append(name)
        return sorted(set(names))

    return only(old, new), only(new, old)
