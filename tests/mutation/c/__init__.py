"""Mutants of the generated C, and the tests in C that judge them."""
