"""Oracles: solvers that state the physics anew and judge what the product computes."""
