"""Engine sources and rendered templates, written in `real`, as C of one precision.

Three things change and nothing else: the word `real`, the suffix `_real`, and literals without a suffix (in single
precision: the shortest that reads back as the same number, with its f). Names of templates stay. Lines keep their
numbers, so that what a compiler or debugger says of an instance names the line of its source.
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
