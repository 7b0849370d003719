"""The hopper of the paper, built as a stranger."""

from hopform.model import *

include("hopper")
