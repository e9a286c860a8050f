"""Mutants: small faults put into the code one at a time, each with the tests that must catch it.

The rows stand in the `.toml` files beside this one; `python -m tests.mutants` (`make mutants`) plays them.
A mutant that survives is a guard that no test pins.
"""
