"""Engine sources and rendered templates, written in `real`, as C of one model and one precision.

Three things change and nothing else: the word `real`, the suffix `_real`, and literals without a suffix (in single
precision: the shortest that reads back as the same number, with its f). Names of templates stay. Lines keep their
numbers, so that what a compiler or debugger says of an instance names the line of its source.

A model without a contact has none of the regions `#if HOPFORM_HAS_CONTACT`, and where the engine says stance, which is a
motion until take-off, it says motion.
"""

import re
import struct

from ..model.precisions import F32, Precision

_TOKEN = re.compile(
    r"(?P<comment>/\*.*?\*/)"
    r'|(?P<string>"[^"\n]*"|#include[^\n]*)'
    r"|(?P<number>(?<![\w.])(?:\d+\.\d*(?:[eE][+-]?\d+)?|\d+[eE][+-]?\d+)(?![\w.]))"
    r"|(?P<word>[A-Za-z_]\w*)",
    re.DOTALL,
)


def instantiate(text: str, precision: Precision) -> str:
    """A text in `real` as C in one precision."""

    def token(match: re.Match[str]) -> str:
        text = match.group()
        if match.lastgroup == "number" and precision == F32:
            return single(float(text))
        return precision.type if text == "real" else text

    return re.sub(r"_real\b(?!\.[ch]\.j2)", f"_{precision.name}", _TOKEN.sub(token, text))


_BRANCH = re.compile(r"#(if|ifdef|ifndef|else|elif|endif)\b(.*)")
_MOTION = {"stance": "motion", "Stance": "Motion", "STANCE": "MOTION"}
_STANCE = re.compile(r"(?<![a-z])(?:[Ss]tance)(?=s?(?![a-z]))|STANCE")


def by_contact(text: str, *, has_contact: bool) -> str:
    """A text of the engine without its directives on a contact, and without the branches that do not hold.

    >>> by_contact("a\\n#if HOPFORM_HAS_CONTACT\\nb\\n#else\\nc\\n#endif\\nd", has_contact=False)
    'a\\nc\\nd'
    """
    kept, regions = (
        list[str](),
        list[bool | None](),
    )  # of each that is open whether it holds, None where that is no matter
    for line in text.split("\n"):
        kind, condition = match.groups() if (match := _BRANCH.match(line)) else ("", "")
        if kind.startswith("if"):
            regions.append(has_contact if condition.strip() == "HOPFORM_HAS_CONTACT" else None)
        of_contact = bool(kind and regions) and regions[-1] is not None
        if kind == "else" and of_contact:
            regions[-1] = not regions[-1]
        elif kind == "endif":
            regions.pop()
        if not of_contact and False not in regions:
            kept.append(line)
    return re.sub(r"\n{3,}", "\n\n", "\n".join(kept))


def as_motion(text: str) -> str:
    """A text, or a name, that says motion where it said stance.

    >>> as_motion("hopform_solve_stances, at a distance, of a stance: HOPFORM_STANCE_H")
    'hopform_solve_motions, at a distance, of a motion: HOPFORM_MOTION_H'
    """
    return _STANCE.sub(lambda match: _MOTION[match[0]], text)


def single(value: float) -> str:
    """The shortest literal that reads back as this number in single precision.

    >>> single(0.1), single(1e30)
    ('0.1f', '1e30f')
    """
    nearest: float = struct.unpack("f", struct.pack("f", value))[0]
    texts = (f"{nearest:.{digits}g}" for digits in range(1, 10))
    text = next(text for text in texts if struct.unpack("f", struct.pack("f", float(text)))[0] == nearest)
    text = re.sub(r"e\+?(-?)0*", r"e\1", text)
    return (text if "." in text or "e" in text else text + ".0") + "f"
