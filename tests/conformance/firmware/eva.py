"""`python -m tests.conformance.firmware.eva` has Frama-C's Eva look at the library on arbitrary bit patterns,
counts what it can not prove.

The driver is eva.c; no annotation stands in the product. It takes frama-c-base, of Debian 12 (Debian 13 has no such
package). Alarms beyond those that LEFT names, with the reason, are a failure, and so is less than LEAST of the
statements reached.
"""

import re
import shutil
import sys
from collections import Counter

from tests.conformance.firmware.targets import HERE, C, Failed, run

LEAST = 95
PARTS = ("ONLY_FLIGHT", "ONLY_STANCE", "ONLY_CONTROL", "ONLY_PLANT")
"""What the driver calls, in runs of their own."""

OPTIONS = (
    "-machdep", "gcc_x86_64", "-warn-special-float", "none", "-kernel-warn-key", "parser:decimal-float=inactive",
    "-eva", "-eva-precision", "0", "-eva-no-print", "-eva-domains", "octagon,equality,symbolic-locations",
    "-eva-octagon-through-calls", "-eva-auto-loop-unroll", "16", "-eva-ilevel", "64",
)  # fmt: skip
UNROLLED = {
    "": "refuse_f32:300,overlap_f32:40",
    "ONLY_FLIGHT": "hopform_flight_at_f32:40,hopform_flight_energy_f32:60,flight_reading_status_f32:40,"
                   "state_of_flight_f32:20,"
                   "has_root_in_fall_f32:200,look_at_foot_f32:40,end_of_slip_f32:100,"
                   "root_in_fall_f32:40,end_at_touchdown_f32:200",
    "ONLY_STANCE": "hopform_stance_energy_f32:60,hopform_stance_sensitivities_f32:60,hopform_stance_tangents_f32:60,"
                   "hopform_stance_grid_f32:300,samples_of_phase_f32:100,sample_behind_f32:100,"
                   "put_samples_f32:50,follow_to_f32:60,cross_f32:60,hopform_stance_forces_f32:40",
    "ONLY_CONTROL": "hopform_stance_compression_f32:60,hopform_try_currents_f32:60",
    "ONLY_PLANT": "hopform_plant_step_f32:40",
}  # fmt: skip
"""How many states are kept apart, in each part and in all, in functions whose loops run over a few phases or event
functions."""

SPLIT = {
    "": "reading_status_f32:0,refuse_f32:0",
    "ONLY_FLIGHT": "flight_reading_status_f32:0",
    "ONLY_STANCE": "sample_behind_f32:0:1:2",
    "ONLY_CONTROL": "hopform_choose_current_begin_f32:3",
    "ONLY_PLANT": "tick_status_f32:0",
}
"""Results of functions after which states are kept apart: what can be read, samples before a phase's end."""

NAN, BOOL = "non-finite float value", "trap representation of a _Bool lvalue"
LEFT = {
    (
        "kernels_f32.h",
        NAN,
    ): "a number that was compared with both bounds is converted; Eva does not conclude that it is one",
    ("states_f32.h", NAN): "the same",
    (
        "control_f32.h",
        BOOL,
    ): "flags of cells, written as bool and copied by a struct's assignment to an index that is not a constant",
}
"""What Eva can not prove, by file and kind, and why it holds. None is about memory, initialisation or integers."""

TIME = 3600.0


Alarms = Counter[tuple[str, str]]


def look(part: str) -> tuple[str, Alarms, int]:
    """The result of Eva on a part: its summary, alarms by file and kind, the share of statements reached."""
    flags = f"-cpp-extra-args=-I{C / 'include'} -I{C / 'src'} -D{part} -DHOPFORM_PORTABLE"
    unrolled, split = (f"{each['']},{each[part]}" for each in (UNROLLED, SPLIT))
    text = run(
        ["frama-c", flags, *OPTIONS, "-eva-slevel-function", unrolled, "-eva-split-return-function", split,
         str(HERE / "eva.c"), str(C / "src" / "hopform_f32.c")],
        timeout=TIME,
    )  # fmt: skip
    alarm = r"^\[eva:alarm\] (?:[^\n:]*/)?([\w.]+):\d+: Warning:\s+([A-Za-z_ \-]+)\."
    alarms = Counter(re.findall(alarm, text, re.MULTILINE))
    reached = re.search(r"(\d+) statements reached \(out of (\d+)\): (\d+)% coverage", text)
    if reached is None:
        raise Failed(text[-2000:])
    return f"{reached[1]} of {reached[2]} statements reached", alarms, int(reached[3])


def main() -> int:
    if shutil.which("frama-c") is None:
        sys.exit("hopform: frama-c is not installed (on Debian 12: apt install frama-c-base)")
    total: Alarms = Counter()
    least = 100
    for part in PARTS:
        try:
            summary, alarms, percent = look(part)
        except Failed as error:
            print(f"{part}: {error}", file=sys.stderr)
            return 1
        named = ", ".join(f"{count} {kind} in {file}" for (file, kind), count in sorted(alarms.items()))
        print(f"{part}: {summary}, {percent} %; {named or 'no alarm'}", flush=True)
        total += alarms
        least = min(least, percent)
    new = {each: count for each, count in total.items() if each not in LEFT}
    print(
        f"{total.total()} alarms, {sum(new.values())} of them not named here; "
        f"{least} % of the statements, {LEAST} asked for"
    )
    return int(least < LEAST or bool(new))


if __name__ == "__main__":
    raise SystemExit(main())
