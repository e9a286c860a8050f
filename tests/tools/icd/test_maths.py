"""Formulas of the contract's page as MathML: what is read back is what was typed."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

import pytest

from gnss_hil.tools.icd import maths, prose
from gnss_hil.tools.icd.chapters import _FORMULAS
from gnss_hil.tools.icd.maths import FormulaError, parse

pytestmark = pytest.mark.verifies(
    "tools/icd/maths.py",
    "tools/icd/charts.py",
    "tools/icd/sequence.py",
    "tools/icd/timing.py",
    what="Interface control document: formulas, sequence charts, an epoch on a time axis",
    by=(
        "read back as typed, played through both sides of the protocol, held against a real epoch: all of "
        "them ours"
    ),
    status="modelled",
)


def read(formula: str) -> str:
    """A formula's characters without their arrangement."""
    return "".join("".join(ElementTree.fromstring(parse(formula)).itertext()).split()).replace("\u2061", "")


@pytest.mark.parametrize(
    ("typed", "shown"),
    [
        ("T = |p - a| / c", "T=|p−a|c"),
        ("S = (2 mu / c^2) ln((|a| + |s|) / (|a| - |s|))", "S=(2μc2)ln(|a|+|s||a|−|s|)"),
        ("p = R3(omega_e T) s", "p=R3(ωeT)s"),
        ("pseudorange_m + clock_m = c b + o", "pseudorange_m+clock_m=cb+o"),
        ("rho' = d|p - a|/dt", "ρ′=d|p−a|dt"),
        ("C(q) = [[ww+xx, 2(xy+wz)], [-x, 0]]", "C(q)=[w2+x22(xy+wz)−x0]"),
        ("mu = 3.986e14", "μ=3.986·10¹⁴"),
    ],
)
def test_formulas_say_what_was_typed(typed, shown):
    assert read(typed) == shown


def test_a_fraction_has_numerator_and_denominator():
    root = ElementTree.fromstring(parse("2 mu / c^2"))
    above, below = root.find(".//mfrac")
    assert ["".join(part.itertext()) for part in (above, below)] == ["2μ", "c2"]


def test_a_matrix_has_its_rows():
    root = ElementTree.fromstring(parse("[[a, b, c], [d, e, f]]"))
    assert [["".join(cell.itertext()) for cell in row] for row in root.iter("mtr")] == [
        list("abc"),
        list("def"),
    ]


@pytest.mark.parametrize("junk", ["a +", "(a", "a )", "[[a, b]", "|a", "a ? b", "= b", "^2"])
def test_what_is_no_formula_is_refused(junk):
    with pytest.raises(FormulaError):
        parse(junk)


@pytest.mark.parametrize("title", sorted(_FORMULAS))
def test_every_formula_of_the_contract_is_read(title):
    shown = prose.render(prose.sections()[title], maths.block)
    assert shown.count("<math") >= 1
    assert "<pre>" not in shown
