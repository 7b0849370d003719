"""`python -m tests.firmware.eva` has Frama-C's Eva look at the library on arbitrary bit patterns, counts what it can not prove.

The driver is eva.c; no annotation stands in the product. It takes frama-c-base, of Debian 12 (Debian 13 has no such package).
Alarms about memory and integers beyond those that LEFT names, with the reason, are a failure, and so is less than LEAST of the
statements reached.
"""

import re
import shutil
import sys
from collections import Counter

from tests.firmware.targets import HERE, C, Failed, run

LEAST = 95
PARTS = {
    "ONLY_FLIGHT": ("flight", "stance", "touchdown"),
    "ONLY_STANCE": ("stance", "energy", "grid", "sensitivity", "states"),
    "ONLY_CONTROL": ("stance", "control"),
}
OPTIONS = (
    "-machdep", "gcc_x86_64", "-warn-special-float", "none", "-kernel-warn-key", "parser:decimal-float=inactive",
    "-eva", "-eva-precision", "0", "-eva-no-print",
)  # fmt: skip
UNROLLED = {
    "ONLY_FLIGHT": "hopform_flight_energy_f32:60",
    "ONLY_STANCE": "watch_thresholds:10,lost_at_once:10,hopform_stance_energy_f32:60,hopform_stance_sensitivities_f32:60,"
                   "hopform_stance_tangents_f32:60",
    "ONLY_CONTROL": "watch_thresholds:10,lost_at_once:10,hopform_trial_of_f32:60",
}  # fmt: skip
"""How many states are kept apart in functions whose loops run over a few phases or watches."""

TIME = 3600.0


def look(part: str) -> tuple[str, Counter[str], int]:
    """What Eva says of a part: its summary, alarms by kind, the share of statements reached."""
    files = [str(C / "src" / f"{unit}_f32.c") for unit in PARTS[part]]
    flags = f"-cpp-extra-args=-I{C / 'include'} -I{C / 'src'} -D{part}"
    text = run(
        ["frama-c", flags, *OPTIONS, "-eva-slevel-function", UNROLLED[part], str(HERE / "eva.c"), *files], timeout=TIME
    )
    alarms = Counter(re.findall(r"^\[eva:alarm\] [^\n]*Warning:\s+([A-Za-z_ \-]+)\.", text, re.MULTILINE))
    reached = re.search(r"(\d+) statements reached \(out of (\d+)\): (\d+)% coverage", text)
    if reached is None:
        raise Failed(text[-2000:])
    return f"{reached[1]} of {reached[2]} statements reached", alarms, int(reached[3])


def main() -> int:
    if shutil.which("frama-c") is None:
        sys.exit("hopform: frama-c is not installed (on Debian 12: apt install frama-c-base)")
    total: Counter[str] = Counter()
    least = 100
    for part in PARTS:
        try:
            summary, alarms, percent = look(part)
        except Failed as error:
            print(f"{part}: {error}", file=sys.stderr)
            return 1
        print(f"{part}: {summary}, {percent} %; {dict(alarms)}", flush=True)
        total += alarms
        least = min(least, percent)
    print(f"{total.total()} alarms; {least} % of the statements at least, {LEAST} asked for")
    return int(least < LEAST or total.total() > 0)


if __name__ == "__main__":
    raise SystemExit(main())
