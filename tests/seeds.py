"""The seed of the test that draws random stances:
HOPFORM_SEED=fresh for another one each time, HOPFORM_SEED=123 for that one.
"""

import os
import secrets

DEFAULT = "fresh"
"""A number, or "fresh"."""


def chosen(asked: str) -> int:
    """The seed that is asked for, as a number; ValueError if it is none and not "fresh"."""
    return secrets.randbelow(2**31) if asked == "fresh" else int(asked)


SEED = chosen(os.environ.get("HOPFORM_SEED") or DEFAULT)
os.environ["HOPFORM_SEED"] = str(SEED)  # processes that are started from here draw the same ones
