"""`make reference-data`: solve every case with the oracle, and write the files of hopform/_reference/data."""

import sys

from tests.conformance.reference_set.cases import CASES
from tests.conformance.reference_set.solved import FOLDER, data, written


def main() -> None:
    """Write the files of the cases that are named, or of all."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    for case in CASES:
        if case.name in sys.argv[1:] or not sys.argv[1:]:
            (FOLDER / f"{case.name}.json").write_text(written(data(case)), "utf-8")
            print(case.name, flush=True)


if __name__ == "__main__":
    main()
