"""Mutants of the generated C, and their tests in C."""
