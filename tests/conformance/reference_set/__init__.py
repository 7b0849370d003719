"""How the reference set of `hopform.reference` is made, and what the page about it shows.

`python -m tests.conformance.reference_set` writes the data from the oracle, which states the physics anew; `python -m
tests.conformance.reference_set.page` scores simulators and writes the page of evidence.
"""
