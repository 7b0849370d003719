"""Processors, the compilers for them and the machines of QEMU that stand in for boards;
how a program is built and run.
"""

import math
import re
import shutil
import signal
import subprocess
import tempfile
import threading
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from derive.emit.facts import ROUNDING
from derive.solver import solver
from tests.conformance.firmware.headers import make

ROOT = Path(__file__).resolve().parents[3]
C = ROOT / "generated" / "c"
HERE = Path(__file__).resolve().parent
BOARDS = HERE / "boards"
OUT = ROOT / "out" / "firmware"

COMMON = ("-std=c99", *ROUNDING, "-ffunction-sections", "-fdata-sections")
CONTRACTION = "-ffp-contract=off"
"""For which a pragma stands where clang compiles: it is not given the flag here, on processors that multiply and add in
one rounding."""

DIGEST = r"(f32|f64) ([0-9a-f]{8})"

WAITING = 20.0
"""How much longer by the clock than by the processor a command may take: for what never ends, and waits."""

OUT_OF_TIME = (-signal.SIGXCPU, -signal.SIGKILL)
"""How a command ends whose time of the processor is over; dash sets both limits."""


class Failed(Exception):
    """A tool or an emulated program that failed, with its last words;
    `code` is how it ended, 124 where it took too long.
    """

    def __init__(self, message: str, code: int = 124) -> None:
        super().__init__(message)
        self.code = code


@dataclass(frozen=True)
class Target:
    """A processor with its tool chain, and the machine that emulates it."""

    name: str
    gcc: str
    processor: tuple[str, ...]
    clang: tuple[str, ...]
    script: str
    startup: str
    machine: tuple[str, ...]
    libraries: tuple[str, ...] = ("-lm", "-lc", "-lgcc")


def _arm(name: str, board: str, script: str, *processor: str) -> Target:
    clang = ("--target=arm-none-eabi", "-isystem", "/usr/lib/arm-none-eabi/include", *processor)
    machine = ("qemu-system-arm", "-M", board, "-icount", "shift=6")
    return Target(name, "arm-none-eabi-gcc", processor, clang, script, "arm_startup.S", machine)


TARGETS = (
    _arm("m4f", "mps2-an386", "mps2.ld", "-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"),
    _arm("m7", "mps2-an500", "mps2.ld", "-mcpu=cortex-m7", "-mthumb", "-mfpu=fpv5-d16", "-mfloat-abi=hard"),
    _arm("m33", "mps2-an505", "mps2_an505.ld", "-mcpu=cortex-m33", "-mthumb", "-mfpu=fpv5-sp-d16", "-mfloat-abi=hard"),
    _arm("m3", "mps2-an385", "mps2.ld", "-mcpu=cortex-m3", "-mthumb", "-mfloat-abi=soft"),
    Target(
        "rv32",
        "riscv64-unknown-elf-gcc",
        ("--specs=picolibc.specs", "-march=rv32imafc", "-misa-spec=2.2", "-mabi=ilp32f", "-mcmodel=medany"),
        ("--target=riscv32-unknown-elf", "-march=rv32imafc", "-mabi=ilp32f", "-mcmodel=medany", "-mno-relax",
         "-msmall-data-limit=0",
         "-isystem", "/usr/lib/picolibc/riscv64-unknown-elf/include"),
        "riscv_virt.ld",
        "riscv_startup.S",
        ("qemu-system-riscv32", "-M", "virt", "-cpu", "rv32", "-bios", "none", "-icount", "shift=0"),
    ),
)  # fmt: skip
BY_NAME = {target.name: target for target in TARGETS}


@dataclass(frozen=True)
class Build:
    """A way to compile for a target."""

    target: Target
    compiler: str
    level: str
    libm: bool = False
    """Whether exp, sin, cos, ln and roots are those of its C library."""
    model: str = "hopper"
    """Whose solver it is: the hopper's of this checkout, or that of another model that ships."""

    @property
    def name(self) -> str:
        return f"{self.target.name}-{self.compiler}{self.level}{'-libm' if self.libm else ''}"

    @property
    def folder(self) -> Path:
        return OUT / (self.name if self.model == "hopper" else f"{self.name}-{self.model}")

    @property
    def c(self) -> Path:
        return C if self.model == "hopper" else derived(self.model)

    def command(self) -> list[str]:
        """The compiler with the flags of the processor."""
        gcc = self.compiler == "gcc"
        chosen = [self.target.gcc, *self.target.processor] if gcc else ["clang", *self.target.clang]
        flags = COMMON if gcc else [flag for flag in COMMON if flag != CONTRACTION]
        option = ["-DHOPFORM_LIBM"] if self.libm else []
        return [*chosen, *flags, *option, self.level, "-I", str(self.c / "include")]


_DERIVING = threading.Lock()
"""Builds are measured side by side: none compiles files that another one writes."""


def derived(model: str) -> Path:
    """The C of a model that ships, derived once a process."""
    with _DERIVING:
        return _derived(model)


@cache
def _derived(model: str) -> Path:
    folder = OUT / f"model-{model}"
    for path, text in solver(model).items():
        if path.parts[0] == "c":
            target = folder / path
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(text, "utf-8")
    return folder / "c"


@cache
def tables() -> Path:
    """The folder of the headers that programs of this folder include, made of tables once a process."""
    make(OUT / "tables")
    return OUT / "tables"


def needed() -> list[str]:
    """Programs that are not installed, among those that the targets take."""
    tools = {"clang", *(target.gcc for target in TARGETS), *(target.machine[0] for target in TARGETS)}
    return sorted(tool for tool in tools if shutil.which(tool) is None)


def run(command: list[str], timeout: float = 120.0, cwd: Path | None = None) -> str:
    """Both streams of a command; raise `Failed` if it ends otherwise than with 0, or takes more than so much time of
    the processor.

    Not of the clock: on a machine that does other work, too, a program that emulates for seconds may wait for minutes.
    """
    limited = ["sh", "-c", f'ulimit -t {math.ceil(timeout)} && exec "$0" "$@"', *command]
    try:
        done = subprocess.run(
            limited, capture_output=True, text=True, errors="replace", timeout=WAITING * timeout, check=False, cwd=cwd
        )
    except subprocess.TimeoutExpired:
        raise Failed(f"{command[0]} waited for longer than {WAITING * timeout:.0f} s") from None
    if done.returncode in OUT_OF_TIME:
        raise Failed(f"{command[0]} took longer than {timeout:.0f} s of the processor")
    text = done.stdout + done.stderr
    if done.returncode != 0:
        raise Failed(f"{' '.join(command[:6])} ... ended with {done.returncode}:\n{text[-4000:]}", done.returncode)
    return text


def sources(precisions: tuple[str, ...] = ("f32", "f64"), c: Path = C) -> list[Path]:
    """The library's sources for firmware; batches are for workstations."""
    return [*(c / "src" / f"hopform_{precision}.c" for precision in precisions), c / "src" / "version.c"]


@cache
def objects(build: Build, precisions: tuple[str, ...] = ("f32", "f64"), *extra: str) -> tuple[Path, ...]:
    """The library, compiled; each object is made once a process."""
    folder = build.folder
    folder.mkdir(parents=True, exist_ok=True)
    made = []
    for source in sources(precisions, build.c):
        target = folder / f"{source.stem}.o"
        run([*build.command(), *extra, "-c", str(source), "-o", str(target)])
        made.append(target)
    return tuple(made)


def link(
    build: Build, program: str, *, precisions: tuple[str, ...] = ("f32", "f64"), define: tuple[str, ...] = ()
) -> Path:
    """An image of `program`.c of this folder with the library; boards and startup are always compiled by gcc."""
    target, folder = build.target, build.folder
    library = objects(build, precisions)
    main, board, startup = folder / f"{program}.o", folder / "board.o", folder / "startup.o"
    gcc = [target.gcc, *target.processor]
    flags = ["-I", str(build.c / "include"), "-I", str(BOARDS), "-I", str(tables()), *define]
    run([*build.command(), *flags, "-c", str(HERE / f"{program}.c"), "-o", str(main)])
    run([*gcc, "-std=c99", "-Os", "-ffunction-sections", *flags, "-c", str(BOARDS / "board.c"), "-o", str(board)])
    run([*gcc, "-c", str(BOARDS / target.startup), "-o", str(startup)])
    image = folder / f"{program}.elf"
    inputs = [str(path) for path in (startup, main, board, *library)]
    script = ["-nostartfiles", "-nodefaultlibs", "-Wl,--gc-sections", "-L", str(BOARDS), "-T", target.script]
    run([*gcc, *script, *inputs, "-Wl,--start-group", *target.libraries, "-Wl,--end-group", "-o", str(image)])
    return image


@cache
def native_digests(*more: str) -> dict[str, str]:
    """What digests.c prints on this computer, by precision, with further flags of the compiler."""
    with tempfile.TemporaryDirectory(prefix="hopform-") as folder:
        image = str(Path(folder) / "digests")
        files = [HERE / "digests.c", BOARDS / "board.c", *sources()]
        include = ["-I", str(C / "include"), "-I", str(BOARDS)]
        run(["cc", "-O2", *COMMON, *more, *include, *map(str, files), "-o", image, "-lm"])
        return dict(re.findall(DIGEST, run([image])))


def emulate(target: Target, image: Path, timeout: float = 120.0) -> str:
    """The output of a program on the terminal of its machine; raise `Failed` unless it ends with 0."""
    quiet = ["-nographic", "-monitor", "none", "-serial", "none"]
    return run(
        [*target.machine, *quiet, "-semihosting-config", "enable=on,target=native", "-kernel", str(image)], timeout
    )
