"""Blocks 8 and 9 of RU 2706636 C1: which antenna may track which satellite, by policy."""

from flightsw.assign.registry import POLICIES, Options, Policy, policy

__all__ = ["POLICIES", "Options", "Policy", "policy"]
