"""A fit by itself: without the old model, the hold-out and the diagnoses, at which most tests do not look."""

from typing import Any

ALONE: dict[str, Any] = {"compare": False, "holdout": False, "diagnose": False}
