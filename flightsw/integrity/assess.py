"""What a solution is worth, after the navigator has excluded what it could.

Navigators exclude satellites while they solve (`integrity.exclusion`), since a solution of less is another
solution. What is left to be judged is the outcome: ranges that disagree but were to make a fix all the same
make the uncertainty larger.
"""

from __future__ import annotations

from dataclasses import replace

from gnss_hil.flightsw.records.solution import Solution


def assess(solution: Solution) -> Solution:
    """With the covariance grown by the misfit, the variance of unit weight: 1 where the ranges agree."""
    fix = solution.fix
    if fix is None or fix.misfit == 1.0:
        return solution
    clock = None if fix.clock_variance_m2 is None else fix.clock_variance_m2 * fix.misfit
    larger = replace(fix, covariance_m2=fix.covariance_m2 * fix.misfit, clock_variance_m2=clock)
    return replace(solution, fix=larger)
