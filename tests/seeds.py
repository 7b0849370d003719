"""The seed of the tests that draw random stances, the same in each run unless HOPFORM_SEED is another number, or
"fresh" for another one each time.
"""

import os
import secrets

DEFAULT = "20261128"
"""A number, or "fresh"."""


def chosen(asked: str) -> int:
    """The seed that is asked for, as a number; ValueError if it is none and not "fresh"."""
    return secrets.randbelow(2**31) if asked == "fresh" else int(asked)


SEED = chosen(os.environ.get("HOPFORM_SEED") or DEFAULT)
os.environ["HOPFORM_SEED"] = str(SEED)  # processes that are started from here draw the same ones
