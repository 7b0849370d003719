"""What the library costs per target: instructions and stack per call, flash, structs; and whether that has grown.

`measure` runs costs.c and costs_motion.c of this folder on the emulated target, links images for the flash, and adds up the
frames of the compiler's call graph. docs/evidence/firmware-costs.json is the committed record,
docs/evidence/firmware-costs.md the same as a page.
"""

import json
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from derive.model.selftest import CASES
from tests.conformance.firmware.cases import HOPS
from tests.conformance.firmware.targets import BY_NAME, ROOT, Build, Failed, emulate, link, objects, run

RECORD = ROOT / "docs" / "evidence" / "firmware-costs.json"
PAGE = RECORD.with_suffix(".md")
GROWTH = 1.02
F32 = ("f32",)

BUILDS = tuple(
    Build(BY_NAME[name], "gcc", level) for name in ("m4f", "m7", "m33", "m3", "rv32") for level in ("-O2", "-Os")
)
QUICK = tuple(build for build in BUILDS if build.name in ("m4f-gcc-O2", "m4f-gcc-Os"))

IMAGES = {
    1: "stance: plan_init, solve_stance, stance_at",
    2: "with choose_current",
    3: "with choose_current and solve_flight",
    4: "with energies, grid, flight",
    5: "with sensitivities",
    6: "with selftest",
}
MOTION_IMAGES = {1: "plan_init, solve_motion, motion_at", 2: "with a plant, ticked"}
MODELS = ("joint", "servo")
"""Models without a contact whose solvers are counted, too."""
CALLS = ("plan_init", "solve_stance", "stance_at", "stance_energy", "stance_grid", "solve_flight",
         "choose_current_begin", "choose_current_step", "choose_current", "selftest")  # fmt: skip
MOTION_CALLS = ("plan_init", "solve_motion", "motion_at", "plant_step")

PAID = (
    ("solve_stance, after a drop", "solve_stance drops"),
    ("solve_stance, every mode and ending", "solve_stance modes"),
    ("solve_flight, in a run of hops", "solve_flight hops"),
    ("choose_current_step, a candidate", "choose_current_step drops"),
    ("choose_current, the height is reached", "choose_current_reached drops"),
    ("choose_current, it is not: the nearest", "choose_current_missed drops"),
    ("choose_current_near, the next command", "choose_current_near drops"),
)
"""What users pay for, and the name of its figures."""

BOUNDED = "m4f-gcc-O2"
"""The build whose search for a current is attacked (bound.c)."""

REGIMES = {
    "a/w=0.26": ("nodes", "friction_at_rest"),
    "a/w=3": ("nodes, a fast pole", "a/w=6"),
    "a/w=6": ("nodes, a fast pole", "a/w=3"),
    "a/w=30": ("nodes, a pole far off", "a/w=6"),
    "a/w=33": ("nodes, a pole far off", "a/w=30"),
    "a/w=60": ("nodes, a pole far off", "a/w=33"),
    "three_real_poles": ("nodes that grow", "a/w=30"),
    "near-equal_poles": ("nodes", "a/w=0.26"),
    "friction_at_rest": ("nodes", "a/w=0.26"),
    "joint": ("one mass", "friction_at_rest"),
    "servo": ("one mass, a law", "joint"),
    "hops": ("flight", "a/w=0.26"),
}
"""What is counted apart, in the order of the page: how its phases are evaluated, and the regime next to it."""

ALIKE = 1.3
"""How many times as much a phase of a regime may cost as that of the one next to it, if both are evaluated alike."""

CLOCK = 168
"""[MHz] of a common Cortex-M4F, for times."""


def measure(build: Build) -> dict[str, Any]:
    """All figures of one build, flat: name to number."""
    figures: dict[str, Any] = {}
    images = [link(build, "costs", precisions=F32)]
    for model in MODELS:
        images.append(link(replace(build, model=model), "costs_motion", precisions=F32, define=(f"-D{model.upper()}",)))
    for line in "".join(emulate(build.target, image) for image in images).splitlines():
        words = line.split()
        if words[:1] == ["sizeof"]:
            figures[f"bytes of {words[1]}"] = int(words[2])
        elif len(words) == 6:
            name = f"{words[0]} {words[1]}"
            figures[f"{name} mean"], figures[f"{name} max"] = int(words[3]), int(words[4])
            figures[f"{name} painted stack"] = int(words[5])
    figures |= flash(build, IMAGES) | static_stack(build, CALLS)
    for model in MODELS:
        its, motion = replace(build, model=model), f"{model}: "
        figures |= flash(its, MOTION_IMAGES, motion, "-DMOTION") | static_stack(its, MOTION_CALLS, f" {model}")
    return figures | (caps(build) if build.name == BOUNDED else {})


def caps(build: Build) -> dict[str, int]:
    """The most that an adversary found, by the caps of a search."""
    figures = {}
    for line in emulate(build.target, link(build, "bound", precisions=F32), timeout=300.0).splitlines():
        evaluations, candidates, step, command, capped = map(int, line.split())
        name = f"caps {evaluations} {candidates}"
        figures |= {f"{name} step": step, f"{name} command": command, f"{name} capped": capped}
    return figures


def bounds(figures: dict[str, Any]) -> list[tuple[int, int, int, int, int, int]]:
    """Evaluations and candidates; bound of a candidate and the most reached; the same of a command.

    A candidate costs in proportion to its evaluations. What one of 40 costs at most is the most that an evaluation does,
    with all that follows from it, and the start of the search beside it.
    """
    of_40 = figures["caps 40 24 step"]
    found = []
    for name, step in figures.items():
        if name.startswith("caps ") and name.endswith(" step"):
            evaluations, candidates = map(int, name.split()[1:3])
            most = of_40 * evaluations // 40
            command = figures[name.replace(" step", " command")]
            found.append((evaluations, candidates, most, step, most * candidates, command))
    return found


def sections(path: Path) -> dict[str, int]:
    """Bytes of text (constants included), data and bss, as binutils count them."""
    line = run(["size", str(path)]).splitlines()[1].split()
    return dict(zip(("text", "data", "bss"), map(int, line[:3]), strict=True))


def flash(build: Build, images: dict[int, str], of: str = "", *define: str) -> dict[str, int]:
    """What the functions of each image take, and what the library has in RAM; `of` names the model."""
    sizes = {}
    for uses in (0, *images):
        sizes[uses] = sections(link(build, "uses", precisions=F32, define=(f"-DUSES={uses}", *define)))["text"]
    figures = {f"flash {of}{text}": sizes[uses] - sizes[0] for uses, text in images.items()}
    parts = [sections(path) for path in objects(build, F32)]
    return figures | {f"{of}data + bss": sum(part["data"] + part["bss"] for part in parts)}


FOLLOWS = "carry_variation_f32"
"""What the controller has called with each phase of a stance, through a pointer."""

_NODE = re.compile(r'node: \{ title: "([^"]+)" label: "[^"]*?(\d+) bytes \((static|dynamic[^)]*)\)')
_EDGE = re.compile(r'edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"')


def static_stack(build: Build, calls_of_users: Sequence[str], of: str = "") -> dict[str, int]:
    """The deepest sum of frames below each call, from gcc's call graph; library routines of the tool chain count 0."""
    frames: dict[str, int] = {}
    calls: dict[str, set[str]] = {}
    for path in objects(build, F32, "-fcallgraph-info=su"):
        text = path.with_suffix(".ci").read_text("utf-8")
        for title, size, kind in _NODE.findall(text):
            if kind != "static":
                raise Failed(f"{title} has a frame that is {kind}")
            frames[title] = int(size)
        for caller, callee in _EDGE.findall(text):
            calls.setdefault(caller, set()).add(callee)

    follows = next((title for title in frames if title.endswith(FOLLOWS)), "")

    def depth(title: str, above: tuple[str, ...] = ()) -> int:
        if title in above:
            raise Failed(f"{title} is recursive")
        if title == "__indirect_call":  # the only one: a stance is followed where the controller asks for it
            return depth(follows, above) if any(each.startswith("hopform_choose_current") for each in above) else 0
        below = (depth(callee, (*above, title)) for callee in calls.get(title, ()))
        return frames.get(title, 0) + max(below, default=0)

    return {f"{name}{of} static stack": depth(f"hopform_{name}_f32") for name in calls_of_users}


def compilers() -> dict[str, str]:
    return {name: run([name, "--version"]).splitlines()[0] for name in sorted({b.target.gcc for b in BUILDS})}


def call_of(regime: str) -> str:
    form = REGIMES[regime][0]
    return "flight" if form == "flight" else "motion" if form.startswith("one mass") else "stance"


def cost_of_a_phase(figures: dict[str, Any], regime: str) -> int:
    cost: int = figures[f"phase_of_{call_of(regime)} {regime} mean"]
    return cost


def apart(figures: dict[str, Any]) -> list[str]:
    """Regimes that cost more than `ALIKE` times as much as the one next to them, or as little, though both are evaluated
    alike.
    """
    wrong = []
    for name, (form, beside) in REGIMES.items():
        cost, near = cost_of_a_phase(figures, name), cost_of_a_phase(figures, beside)
        if form == REGIMES[beside][0] and max(cost, near) > ALIKE * min(cost, near):
            wrong.append(f"{name}: a phase costs {cost}, of {beside} {near}, and both are {form}")
    return wrong


def grown(build: Build, now: dict[str, Any]) -> list[str]:
    """Figures that are more than 2 % above the record, or missing from it."""
    record = json.loads(RECORD.read_text("utf-8"))
    if record["compilers"][build.target.gcc] != compilers()[build.target.gcc]:
        print(f"{build.name}: not compared, the record is from {record['compilers'][build.target.gcc]}")
        return []
    then = record["builds"][build.name]
    return [
        f"{build.name}: {name} is {value}, was {then.get(name, 'not recorded')}"
        for name, value in now.items()
        if name not in then or value > then[name] * GROWTH
    ]


def report() -> None:
    """Measure every build; write the record and the page."""
    builds = {build.name: measure(build) for build in BUILDS}
    RECORD.write_text(json.dumps({"compilers": compilers(), "builds": builds}, indent=1) + "\n", "utf-8")
    PAGE.write_text(page(builds), "utf-8")


def spaced(number: int) -> str:
    return f"{number:,}".replace(",", " ")


def table(head: list[str], rows: list[list[str]]) -> str:
    lines = [head, ["---", *["--:"] * (len(head) - 1)], *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def page(builds: dict[str, dict[str, Any]]) -> str:
    """The record as Markdown."""
    names = list(builds)
    m4f = builds["m4f-gcc-O2"]
    names_of = list(m4f)
    paid = [[what, spaced(m4f[f"{name} mean"]), spaced(m4f[f"{name} max"])] for what, name in PAID]
    small = builds["m4f-gcc-Os"]

    def both(name: str) -> str:
        return f"{spaced(m4f[name])} / {spaced(small[name])} B"

    def stacks(call: str, over: str) -> str:
        return f"{m4f[f'{call} static stack']} / {m4f[f'{call} {over} painted stack']} B"

    memory = [
        ["flash, stance alone, -O2 / -Os", both(f"flash {IMAGES[1]}")],
        ["flash, everything, -O2 / -Os", both(f"flash {IMAGES[6]}")],
        ["stack of solve_stance, static / painted", stacks("solve_stance", "modes")],
        ["stack of choose_current, static / painted", stacks("choose_current", "drops")],
        [".data + .bss", f"{m4f['data + bss']} B"],
    ]
    capped = [
        [str(evaluations), str(candidates), *map(spaced, numbers)] for evaluations, candidates, *numbers in bounds(m4f)
    ]

    def times(name: str) -> list[str]:
        return [f"{builds[build][name] / CLOCK:.1f}" for build in ("m4f-gcc-O2", "m4f-gcc-Os")]

    timed = [name.removesuffix(" mean") for name in names_of if re.search(r"drops mean|_flight hops mean", name)]
    microseconds = [
        [name.split()[0], *times(f"{name} mean"), *times(f"{name} max")] for name in timed if "phase" not in name
    ]

    def part(ending: str) -> str:
        rows = [[name.removesuffix(ending).strip(), *(spaced(builds[b][name]) for b in names)]
                for name in names_of if name.endswith(ending)]  # fmt: skip
        return table(["", *names], rows)

    def group(start: str) -> str:
        rows = [[name.removeprefix(start), *(spaced(builds[b][name]) for b in names)]
                for name in names_of if name.startswith(start)]  # fmt: skip
        return table(["", *names], rows)

    regimes = []
    for name, (form, beside) in REGIMES.items():
        whole = (spaced(m4f[f"solve_{call_of(name)} {name} {of}"]) for of in ("mean", "max"))
        a_phase, near = cost_of_a_phase(m4f, name), cost_of_a_phase(m4f, beside)
        regimes.append([name.replace("_", " "), form, *whole, spaced(a_phase), f"{a_phase / near:.2f}",
                        beside.replace("_", " ")])  # fmt: skip
    rows = {
        **{f"flash: {text} [B]": f"flash {{0}}: {text}" for text in MOTION_IMAGES.values()},
        **{f"{call}, instructions": f"{call} {{0}} mean" for call in MOTION_CALLS},
        **{f"{call}, stack, painted [B]": f"{call} {{0}} painted stack" for call in MOTION_CALLS},
        **{f"sizeof {name} [B]": f"bytes of {{0}}_{name}" for name in ("plan", "motion", "phase", "plant")},
    }
    of_models = [[what, *(spaced(figures[name.format(model)]) for model in MODELS for figures in (m4f, small))]
                 for what, name in rows.items()]  # fmt: skip
    versions = "; ".join(compilers().values())
    stances = m4f["choose_current drops mean"] / m4f["choose_current_step drops mean"]
    return f"""# What the C library costs on a processor

Written by `make firmware-report`. `make firmware-test` fails when a figure of the two Cortex-M4F builds is more than 2 %
above firmware-costs.json, `make firmware-test-all` when any is. Instructions per call in single precision, counted by
QEMU ({versions}).

| set | what is solved |
| --- | --- |
| `modes` | {len(CASES)} stances of `hopform_selftest`, which visit every mode, kind of event and ending |
| `drops` | `hopper_c` and `hopper_b` at -0.7, -1.93 and -2.6 m/s under three currents each; `choose_current` for hop heights of 5, 10 and 15 cm from each of them |
| `hops` | the flights of `hopper_c` in a run of {len(HOPS)} hops of {100 * min(HOPS):.0f} to {100 * max(HOPS):.0f} cm, from take-offs with the actuator out and moving |
| `joint` | nine moves of up to 2 s of a joint on its spring under currents, and 200 ticks of a plant, by the solver of this model |
| `servo` | the same of a servo to targets near and far |

`choose_current_step` solves one stance more. `choose_current_near` searches for the same height, where it was reached,
from a touchdown 1 % faster, begun near the last command.

## Cortex-M4F, gcc -O2

{table(["instructions", "mean", "max"], paid)}
Where the height is out of reach, the search ends only when it knows that no apex is nearer. A command takes
{stances:.1f} stances on average.

The cost of a stance depends on its poles and on the evaluation of its phases, so each regime is counted separately: the
drops of `hopper_c` by a robot between the same stops, a its real pole and w the frequency of its pair; moves of `joint`
and of `servo`, under its law; the flights of `hops`. The last two columns compare a phase with one of the next regime.
Phases that are evaluated alike cost at most {ALIKE} times one another, which `make firmware-test` checks. Beside a [fast
pole](../explanation/certificate.md#a-fast-real-pole), from a/w = 1.02 on, a root is located by E and Phi in place of a
short series: at a/w = 3 a phase costs {cost_of_a_phase(m4f, "a/w=3") / cost_of_a_phase(m4f, "a/w=0.26"):.2f} times as much as
at 0.26.

{table(["regime", "evaluated as", "mean", "max", "a phase", "times", "a phase of"], regimes)}
{table(["memory", ""], memory)}
A stance after a drop has 2.9 phases on average.

## A joint and a servo on a Cortex-M4F

Models of one mass, without a contact: `hopform --solver joint export`. Instructions are means.

{table(["", "joint, -O2", "joint, -Os", "servo, -O2", "servo, -Os"], of_models)}
## A bound for a task with a deadline

`max_evaluations` and `max_candidates` of the target [cap a search](../explanation/controller.md#branch-and-bound); before
it has an admissible command the current is u = 0. The table has the bound by these caps, beside the most that an
adversary reached. It draws robots, states and desired heights, and varies the most expensive so far
(`tests/conformance/firmware/bound.c`).

{table(["evaluations", "candidates", "a candidate, at most", "reached", "a command, at most", "reached"], capped)}
The bound is proportional to the most that the adversary found for 40 evaluations; it is measured, not proven. A tick of
1 kHz at {CLOCK} MHz has {spaced(1000 * CLOCK)} instructions: {1000 * CLOCK // m4f["caps 40 24 step"]} candidates of at most 40 evaluations fit.

## Microseconds on a Cortex-M4F at {CLOCK} MHz, computed

Instructions of the set `drops` over the clock: one a cycle, flash without wait states. A core takes more cycles for
divisions, square roots, loads and branches, so these are lower bounds; only a cycle counter measures the time.

{table(["", "-O2, mean", "-Os, mean", "-O2, max", "-Os, max"], microseconds)}
## Instructions, mean

{part(" mean")}
## Instructions, max

{part(" max")}
## Flash in bytes, --gc-sections

{group("flash ")}
## Stack in bytes, by gcc's call graph

It lacks routines of the tool chain, such as arithmetic on a processor without floating point; the painted stack has them.

{part(" static stack")}
## Stack in bytes, painted

{part(" painted stack")}
## Structs in bytes

{group("bytes of ")}"""
