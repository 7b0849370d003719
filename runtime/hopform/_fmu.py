"""An FMU of a solver, for FMI 3.0 co-simulation with Event Mode: what `hopform export --for fmu` writes.

The archive has the engine's sources with fmi3.c over them, compiled for each platform that is asked for; modelDescription.xml
and model.h, which both are written here, of the solver's facts and a robot's values: value references are the places of
`variables_of`.
"""

import io
import math
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple
from xml.etree import ElementTree

from hopform._checks import shown
from hopform._errors import HopformError, printable
from hopform._export import Wanted, check_new, sources
from hopform._files import write_folder
from hopform._motion import force_unit, layout_of, masses_of
from hopform._robots import Robot
from hopform._solver import build
from hopform._solver.choice import Solver
from hopform._solver.package import records

SYSTEM = "fmu"
"""What `hopform export --for` calls it."""
BINARIES = {
    "x86_64-linux": ("x86_64-linux-gnu.2.17", ".so"),
    "aarch64-linux": ("aarch64-linux-gnu.2.17", ".so"),
    "x86_64-windows": ("x86_64-windows-gnu", ".dll"),
    "x86_64-darwin": ("x86_64-macos", ".dylib"),
    "aarch64-darwin": ("aarch64-macos", ".dylib"),
}
"""Platforms of FMI's names: of each zig's target, and how a library's name ends."""
SOURCES = (
    "fmi3.c", "absent.h", "vendored/fmi3PlatformTypes.h", "vendored/fmi3FunctionTypes.h", "vendored/fmi3Functions.h",
)  # fmt: skip
"""What is the same for every solver; FMI's headers are the Modelica Association's, under their licence."""
EVENT_TAKEOFF, EVENT_TOUCHDOWN = 32, 33
"""Numbers of the ends of a stance and of a flight, beside those of their events."""


@dataclass(frozen=True)
class Variable:
    """A variable of modelDescription.xml; its value reference is its place."""

    kind: str
    """Float64, Int32, Boolean, or the name of an enumeration"""
    name: str
    meaning: str
    causality: str
    variability: str
    unit: str = ""
    start: float | bool | None = None
    initial: str = ""
    derivative_of: str = ""
    is_own: bool = False
    """whether the model's file names it, so that another one of its name gives way"""


class Variables(NamedTuple):
    """Those of a robot: numbers, then codes, in the order of fmi3.c."""

    numbers: tuple[Variable, ...]
    codes: tuple[Variable, ...]

    @property
    def all(self) -> tuple[Variable, ...]:
        return (*self.numbers, *self.codes)


def export(folder: Path, robot: Robot, inputs: Sequence[str] = (), binaries: Sequence[str] = ()) -> tuple[Path, ...]:
    """Write the FMU of a robot into a new or empty folder, and return the file, relative to it; as `archive`.

    Raises HopformError for a folder that holds files.
    """
    check_new(folder)
    name = Path(f"{robot.solver.name}.fmu")
    write_folder(folder, {name: archive(robot, inputs, binaries)})
    return (name,)


def archive(robot: Robot, inputs: Sequence[str] = (), binaries: Sequence[str] = ()) -> bytes:
    """The FMU of a robot, whose values are its starts: a ZIP archive with the same bytes for the same arguments and
    compilers.

    inputs: parameters that are inputs, not parameters, of the FMU. binaries: platforms to compile for, of `BINARIES`;
    none for this machine's. Raises HopformError: an unknown parameter or platform, no compiler for one of them.
    """
    solver = robot.solver
    for name in inputs:
        if name not in (names := [field.name for field in robot.fields()]):
            raise HopformError(f"--input must be a parameter, one of {', '.join(names)}, got {shown(name)}")
    for platform in binaries:
        if platform not in BINARIES:
            raise HopformError(f"--binary must be one of {', '.join(BINARIES)}, got {shown(platform)}")
    variables = variables_of(robot, frozenset(inputs))
    files = sources_of(robot, variables)
    token = sha256(repr((variables, sorted(files.items()))).encode()).hexdigest()[:32]
    files["model.h"] = f'#define TOKEN "{token}"\n{files["model.h"]}'
    entries = {"modelDescription.xml": description(solver, variables, token).encode()}
    entries |= {f"sources/{name}": text.encode() for name, text in files.items()}
    entries["sources/buildDescription.xml"] = build_description(solver).encode()
    for name, path in (("license.txt", "packages/all/LICENSE"), ("fmi-headers.txt", "packages/fmu/vendored/LICENSE")):
        entries[f"documentation/licenses/{name}"] = solver.folder.path(path).read_bytes()
    entries |= dict(compiled(solver, files, binaries))
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as file:
        for name, content in sorted(entries.items()):
            about = zipfile.ZipInfo(name)  # without a time
            about.external_attr = 0o644 << 16  # readable for whoever shares it once it is unpacked
            file.writestr(about, content, zipfile.ZIP_DEFLATED)
    return packed.getvalue()


# ---- variables ----


def variables_of(robot: Robot, inputs: frozenset[str]) -> Variables:
    """All variables of a robot's FMU."""
    solver, facts, layout = robot.solver, robot.solver.facts, layout_of(robot.solver)
    meanings = {str(table["name"]): str(table["meaning"]) for table in facts.axes.values()}
    coordinates, stands = list(zip(layout.names, layout.units, strict=True)), "stance" in solver.can
    numbers = [Variable("Float64", "time", "time", "independent", "continuous", "s")]
    for n, (name, unit) in enumerate(coordinates):
        start, of = _begins(robot, layout.axes[n]), layout.names[n - 1] if n % 2 else ""
        about = meanings[name], "output", "continuous"
        numbers.append(Variable("Float64", name, *about, unit, start, initial="exact", derivative_of=of, is_own=True))
    for name, *_ in solver.package.structs.STRUCTS["Forces"]:
        numbers.append(_calculated("Float64", name, _force(solver, name), _unit_of_force(solver, name)))
    for energy in facts.energies:
        numbers.append(_calculated("Float64", f"energy_{energy['glyph']}", energy["meaning"], energy["unit"]))
    coming = "time of the next event, infinite where none is known"
    numbers.append(Variable("Float64", "next_event", coming, "local", "discrete", "s", initial="calculated"))
    for each in facts.inputs:
        held = f"{each['meaning']}; it holds until it is set again"
        numbers.append(Variable("Float64", each["name"], held, "input", "discrete", each["unit"], 0.0, is_own=True))
    if stands:
        ground = "height of the ground ahead over that at the start; it counts from the next flight on, or in this one"
        numbers.append(Variable("Float64", "ground", ground, "input", "discrete", "m", 0.0))
        for name, unit, per in (("return_Kp", "N/m", "displacement"), ("return_Kd", "N s/m", "velocity")):
            law = f"force of the return in flight per {per} of the actuator, where designs_return is false"
            numbers.append(Variable("Float64", name, law, "parameter", "tunable", unit, 0.0))
    for field in robot.fields():
        is_input = field.name in inputs
        kinds = ("input", "discrete") if is_input else ("parameter", "tunable")
        numbers.append(
            Variable("Float64", field.name, field.meaning, *kinds, field.unit, robot[field.name], is_own=True)
        )
    codes = [_calculated("Side", f"mode_{mass.position}", f"mode of {mass.name}", "") for mass in masses_of(solver)]
    if facts.currents:
        limited = facts.currents[0]["name"]
        codes.append(_calculated("Side", f"limit_{limited}", f"side of its limit at which {limited} is; 0 within", ""))
    codes.append(_calculated("Event", "event", "latest event", ""))
    codes.append(_calculated("Int32", "events", "events so far", ""))
    if stands:
        codes.append(_calculated("Boolean", "in_contact", "whether the foot is on the ground", ""))
        designed = "whether the gains of the return in flight are designed from the robot's parameters"
        codes.append(Variable("Boolean", "designs_return", designed, "parameter", "tunable", start=True))
    return _each_once(numbers, codes)


def _calculated(kind: str, name: str, meaning: str, unit: str) -> Variable:
    variability = "continuous" if kind == "Float64" else "discrete"
    return Variable(kind, name, meaning, "output", variability, unit, initial="calculated")


def _each_once(numbers: list[Variable], codes: list[Variable]) -> Variables:
    """The variables; one whose name another has that the model's file names gets a `_` behind its own."""
    taken = {each.name for each in (*numbers, *codes) if each.is_own}
    named = list[Variable]()
    for each in (*numbers, *codes):
        name = each.name
        while not each.is_own and name in taken:
            name += "_"
        taken.add(name)
        named.append(replace(each, name=name))
    return Variables(tuple(named[: len(numbers)]), tuple(named[len(numbers) :]))


def _begins(robot: Robot, axis: str) -> float:
    """Where a coordinate or velocity starts: at 0, or at the stop next to it; a body that stands where its leg carries
    nothing.
    """
    if axis == "x1":
        return robot.home
    return robot.standing_height + robot.home if axis == "x2" and "stance" in robot.solver.can else 0.0


def _force(solver: Solver, name: str) -> str:
    of, _, coordinate = name.partition("_")
    if of in ("friction", "stop"):
        whose = next(mass.name for mass in masses_of(solver) if coordinate in (mass.position, f"x{mass.number}"))
        return f"force of {'friction' if of == 'friction' else 'the stop'} on {whose}"
    return {"input": "force of the input", "contact": "force of the ground"}.get(name, name)


def _unit_of_force(solver: Solver, name: str) -> str:
    """Along the coordinate that a force acts on."""
    coordinate = name.partition("_")[2]
    units = {mass.position: mass.unit for mass in masses_of(solver)}
    units |= {f"x{mass.number}": mass.unit for mass in masses_of(solver)}
    return force_unit(units.get(coordinate, layout_of(solver).units[0]))


# ---- C ----


def sources_of(robot: Robot, variables: Variables) -> dict[str, str]:
    """The sources of an FMU by their paths in its folder of sources; model.h without its token."""
    solver, wanted = robot.solver, Wanted(precisions=("f64",), solver=robot.solver)
    files = {
        path.relative_to("src").as_posix() if path.parts[0] == "src" else path.as_posix(): text
        for path, text in sources(wanted).items()
        if path.suffix in (".h", ".c") and path.name != "version.c"
    }
    folder = solver.folder.path("packages/fmu")
    files |= {Path(name).name: (folder / name).read_text("utf-8") for name in SOURCES}
    return files | {"model.h": model_header(robot, variables)}


def model_header(robot: Robot, variables: Variables) -> str:
    """What fmi3.c has to know of a solver: how many values of each kind there are, their starts, domains and names."""
    solver, package = robot.solver, robot.solver.package
    structs, masses, facts = package.structs.STRUCTS, masses_of(solver), solver.facts
    stands = "stance" in solver.can
    names = [each.name for each in variables.numbers]
    forces = [name for name, *_ in structs["Forces"]]
    energies = [name for name, *_ in structs["Energy"]]
    low, high, unit = package.records.ENDS
    counts = {
        "COORDINATES": len(structs["Start"]), "FORCES": len(forces), "ENERGIES": len(facts.energies),
        "ALL_ENERGIES": len(energies), "INPUTS": len(facts.inputs), "PARAMETERS": len(structs["Robot"]),
        "MASSES": len(masses), "HAS_LIMIT": int(bool(facts.currents)),
        "STOPS_HOLD_FIRST": int(bool(low) and masses[0].number == 1),
    }  # fmt: skip
    if stands:
        counts |= {"EVENT_TAKEOFF": EVENT_TAKEOFF, "EVENT_TOUCHDOWN": EVENT_TOUCHDOWN}
        counts["CONTACT_FORCE"] = forces.index("contact")
    domains = [_domain(package.records.DOMAINS[field.domain], field) for field in robot.fields()]
    starts = [_literal(float(each.start or 0.0)) for each in variables.numbers]
    refusals = [f"{{{number}, {_quoted(words)}}}" for number, words in package.records.REFUSALS.items()]
    chosen = [energies.index(each["name"]) for each in facts.energies]
    return "\n".join([
        "/* What fmi3.c has to know of this solver and robot. SPDX-License-Identifier: MIT-0 */",
        "#include <math.h>",
        "#include <stdbool.h>",
        *(f"#define {name} {count}" for name, count in counts.items()),
        f"#define LOWER_STOP {_quoted(low)}",
        f"#define UPPER_STOP {_quoted(high)}",
        f"#define UNIT_OF_STOPS {_quoted(unit)}",
        "typedef struct {",
        "    const char *name, *allowed, *unit;",
        "    double low, high;",
        "    bool with_low, with_high;",
        "} Parameter;",
        _table("Parameter parameter", domains),
        _table("double start_of", starts),
        _table("char *const name_of", map(_quoted, names)),
        _table("char *const unit_of", (_quoted(_behind(each.unit)) for each in variables.numbers)),
        _table("int mass_of", (str(mass.number - 1) for mass in masses)),
        _table("int energy_of", map(str, chosen)),
        "typedef struct {",
        "    int status;",
        "    const char *meaning;",
        "} Refusal;",
        _table("Refusal refusals", refusals),
        "",
    ])  # fmt: skip


def _table(declared: str, entries: Iterable[str]) -> str:
    return f"static const {declared}[] = {{\n    {', '.join(entries)},\n}};".replace(", {", ",\n    {")


def _quoted(text: str) -> str:
    """A string of C."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(each if each.isprintable() else "?" for each in escaped) + '"'


def _behind(unit: str) -> str:
    """A unit behind a number or a bound, nothing of what has none."""
    return "" if unit in ("", "1") else f" {unit}"


def _literal(value: float) -> str:
    return repr(value) if math.isfinite(value) else "INFINITY" if value > 0.0 else "-INFINITY"


def _domain(domain: records.Domain, field: records.Field) -> str:
    ends = f"{_literal(domain.low)}, {_literal(domain.high)}"
    with_ends = f"{str(domain.with_low).lower()}, {str(domain.with_high).lower()}"
    texts = ", ".join(map(_quoted, (field.name, domain.allowed, _behind(field.unit))))
    return f"{{{texts}, {ends}, {with_ends}}}"


# ---- binaries ----


def this_platform() -> str | None:
    """FMI's name of this machine, None for one that BINARIES lacks."""
    system = {"linux": "linux", "darwin": "darwin", "win32": "windows"}.get(sys.platform, "")
    machine = sysconfig.get_platform().rpartition("-")[2].lower()
    name = f"{ {'amd64': 'x86_64', 'arm64': 'aarch64'}.get(machine, machine) }-{system}"
    return name if name in BINARIES else None


def compiled(solver: Solver, files: dict[str, str], binaries: Sequence[str]) -> Iterable[tuple[str, bytes]]:
    """The library of each platform, by its path in the archive; none where nothing is asked for and there is no compiler."""
    own = this_platform()
    with TemporaryDirectory(prefix="hopform-fmu-") as folder:
        root = Path(folder)
        for name, text in files.items():
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(text, "utf-8", newline="\n")
        if not binaries and own is None:
            say_it_has_no_binary(f"{sysconfig.get_platform()} is none of {', '.join(BINARIES)}")
        for platform in binaries or ([own] if own else []):
            target, suffix = BINARIES[platform]
            try:
                command = build.compiler() if platform == own else zig(platform, target)
            except build.LibraryNotBuilt as error:
                if binaries or not isinstance(error, build.NoCompiler):
                    raise HopformError(error.args[0]) from None
                say_it_has_no_binary(error.args[0])
                return
            library = root / f"{solver.name}{suffix}"
            flags = [flag for flag in build.plan(_facts(solver)).flags if not flag.startswith("-fvisibility")]
            if suffix == ".dll":
                flags.remove("-fPIC")
            try:
                build.run([
                    *command, *flags, "-fvisibility=hidden", f"-I{root}", f"-I{root / 'include'}", str(root / "fmi3.c"),
                    "-lm", "-o", str(library),
                ])  # fmt: skip
            except OSError as error:
                raise HopformError(f"no C compiler: {command[0]}: {error.strerror}") from None
            except subprocess.CalledProcessError as error:
                said = str(error.stderr)
                first = next((line for line in said.splitlines() if "error" in line), f"exit code {error.returncode}")
                raise HopformError(f"{command[0]} does not compile the FMU for {platform}: {first}") from error
            yield f"binaries/{platform}/{library.name}", library.read_bytes()


def say_it_has_no_binary(why: str) -> None:
    """That the FMU has sources alone, which an importer has to compile."""
    if sys.stderr is not None:
        print(printable(f"hopform: the FMU has sources, and no binary: {why}"), file=sys.stderr)


def _facts(solver: Solver) -> Path:
    return solver.folder.path("solver.toml").parent


def zig(platform: str, target: str) -> list[str]:
    """The compiler of zig for another platform; HopformError where there is none."""
    command = [sys.executable, "-m", "ziglang"] if find_spec("ziglang") else ["zig"] if shutil.which("zig") else []
    if not command:
        raise HopformError(f"--binary {platform} needs zig: pip install 'hopform[compiler]'")
    return [*command, "cc", "-fno-sanitize=undefined", "-target", target]


# ---- XML ----


def description(solver: Solver, variables: Variables, token: str) -> str:
    """modelDescription.xml."""
    root = ElementTree.Element("fmiModelDescription", {
        "fmiVersion": "3.0", "modelName": solver.name, "instantiationToken": token, "description": solver.facts.title,
        "version": solver.facts.version, "license": "MIT-0", "generationTool": f"hopform {version('hopform')}",
        "variableNamingConvention": "flat",
    })  # fmt: skip
    ElementTree.SubElement(root, "CoSimulation", {
        "modelIdentifier": solver.name, "canHandleVariableCommunicationStepSize": "true", "canGetAndSetFMUState": "true",
        "canSerializeFMUState": "true", "mightReturnEarlyFromDoStep": "true", "hasEventMode": "true",
    })  # fmt: skip
    units = ElementTree.SubElement(root, "UnitDefinitions")
    for unit in sorted({each.unit for each in variables.numbers}):
        ElementTree.SubElement(ElementTree.SubElement(units, "Unit", name=unit), "BaseUnit", _base(solver, unit))
    types = ElementTree.SubElement(root, "TypeDefinitions")
    for name, items in enumerations(solver).items():
        kind = ElementTree.SubElement(types, "EnumerationType", name=name)
        for value, word in items.items():
            ElementTree.SubElement(kind, "Item", name=word, value=str(value))
    logs = ElementTree.SubElement(root, "LogCategories")
    ElementTree.SubElement(logs, "Category", name="logStatusError", description="why a call is refused")
    ElementTree.SubElement(root, "DefaultExperiment", startTime="0", stopTime="2", stepSize="0.01")
    listed = ElementTree.SubElement(root, "ModelVariables")
    places = {each.name: str(place) for place, each in enumerate(variables.all)}
    for place, each in enumerate(variables.all):
        tag = each.kind if each.kind in ("Float64", "Int32", "Boolean") else "Enumeration"
        about = {"name": each.name, "valueReference": str(place), "causality": each.causality}
        about |= {"variability": each.variability, "description": each.meaning}
        if tag == "Enumeration":
            about["declaredType"] = each.kind
        if each.unit:
            about["unit"] = each.unit
        if each.initial:
            about["initial"] = each.initial
        if each.start is not None:
            about["start"] = str(each.start).lower() if tag == "Boolean" else _number(float(each.start))
        if each.derivative_of:
            about["derivative"] = places[each.derivative_of]
        ElementTree.SubElement(listed, tag, about)
    structure = ElementTree.SubElement(root, "ModelStructure")
    outputs = [each for each in variables.all if each.causality == "output"]
    for each in outputs:
        ElementTree.SubElement(structure, "Output", valueReference=places[each.name])
    for each in outputs:
        if each.initial == "calculated":
            ElementTree.SubElement(structure, "InitialUnknown", valueReference=places[each.name])
    return _text(root)


def build_description(solver: Solver) -> str:
    """sources/buildDescription.xml."""
    root = ElementTree.Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = ElementTree.SubElement(root, "BuildConfiguration", modelIdentifier=solver.name)
    options = " ".join(flag for flag in build.plan(_facts(solver)).flags if flag.startswith("-f") and "vis" not in flag)
    files = ElementTree.SubElement(configuration, "SourceFileSet", language="C99", compilerOptions=options)
    ElementTree.SubElement(files, "SourceFile", name="fmi3.c")
    for folder in (".", "include"):
        ElementTree.SubElement(files, "IncludeDirectory", name=folder)
    return _text(root)


def _text(root: ElementTree.Element) -> str:
    ElementTree.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ElementTree.tostring(root, "unicode")}\n'


def _number(value: float) -> str:
    """A number of XML Schema."""
    return repr(value) if math.isfinite(value) else "INF" if value > 0.0 else "-INF"


def _base(solver: Solver, unit: str) -> dict[str, str]:
    return {name: str(power) for name, power in solver.facts.dimensions.get(unit, {}).items()}


def enumerations(solver: Solver) -> dict[str, dict[int, str]]:
    """Enumerations by their names: items by their values."""
    own = solver.package.records
    events = {0: "none", **own.EVENTS}
    if "stance" in solver.can:
        events |= {**own.FLIGHT_EVENTS, EVENT_TAKEOFF: "takeoff", EVENT_TOUCHDOWN: "touchdown"}
    return {"Side": {-1: "backward", 0: "held", 1: "forward"}, "Event": dict(sorted(events.items()))}
