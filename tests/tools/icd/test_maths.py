"""Formulas of the contract's page as MathML: what is what it shows is what was written."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from gnss_hil.emulator.numerics.rotations import dcm_of_quaternions
from gnss_hil.tools.icd import prose
from gnss_hil.tools.icd.maths import formula

pytestmark = pytest.mark.verifies(
    "tools/icd/maths.py",
    "tools/icd/sequence.py",
    "tools/icd/timing.py",
    what="Interface control document: formulas, sequence charts, an epoch on a time axis",
    by=(
        "every formula set, C(q) evaluated against the emulator's; charts played through both sides of the "
        "protocol, held against a real epoch: all of them ours"
    ),
    status="modelled",
)


def read(latex: str) -> str:
    """A formula's characters without their arrangement."""
    return "".join("".join(ElementTree.fromstring(formula(latex)).itertext()).split())


@pytest.mark.parametrize(
    ("written", "shown"),
    [
        (r"T = \frac{\left|p - a\right|}{c}", "T=|p−a|c"),
        (r"p = R_3(\omega_e T)\,s", "p=R3(ωeT)s"),
        (r"\mathtt{pseudorange\_m} + \mathtt{clock\_m} = c\,b + o", "pseudorange_m+clock_m=cb+o"),
        (r"\dot{\rho} = \frac{\mathrm{d}\left|p - a\right|}{\mathrm{d}t}", "ρ˙=d|p−a|dt"),
        (r"\mu = 3.986 \cdot 10^{14}\ \mathrm{m^3/s^2}", "μ=3.986·1014m3/s2"),
        ("a < b", "a<b"),
    ],
)
def test_formulas_show_what_was_written(written, shown):
    assert read(written) == shown


def test_a_signal_is_one_name_and_no_product_of_letters():
    root = ElementTree.fromstring(formula(r"\mathtt{clock\_m} + \mathtt{tag}"))
    assert [name.text for name in root.iter("mi") if name.get("class") == "signal"] == ["clock_m", "tag"]
    assert len(list(root.iter("mi"))) == 2


def test_formulas_stand_by_themselves_in_the_page_of_the_language():
    root = ElementTree.fromstring(formula("a"))
    assert (root.tag, root.get("display")) == ("math", "block")


def test_a_matrix_has_its_rows():
    root = ElementTree.fromstring(formula(r"\begin{bmatrix} a & b & c \\ d & e & f \end{bmatrix}"))
    assert [["".join(cell.itertext()) for cell in row] for row in root.iter("mtr")] == [
        list("abc"),
        list("def"),
    ]


def test_every_formula_of_the_contract_is_set():
    """Nothing of LaTeX is left over, as the library leaves what it does not know; matrices are there."""
    for title, rows in (("Measurements", 3), ("Attitude", 3)):
        markup = prose.render(prose.sections()[title])
        root = ElementTree.fromstring(f"<div>{markup}</div>")
        (formulas,) = root.iter("math")
        assert not set("".join(formulas.itertext())) & set("\\{}&")
        assert [len(list(table)) for table in formulas.iter("mtable")][-1] == rows
        assert "<pre>" not in markup


def test_the_attitude_matrix_is_the_one_of_the_emulator():
    """C(q) of the page, evaluated, against the matrix that turns the antennas."""
    quaternion = np.array([0.5, -0.1, 0.7, 0.2])
    quaternion /= np.linalg.norm(quaternion)
    root = ElementTree.fromstring(f"<div>{prose.render(prose.sections()['Attitude'])}</div>")
    cells = [[_value(cell, quaternion) for cell in row] for row in root.iter("mtr")]
    np.testing.assert_allclose(cells, dcm_of_quaternions(quaternion[None])[0], atol=1e-15)


def _value(cell: ElementTree.Element, quaternion: np.ndarray) -> float:
    """A cell of sums and products of the quaternion's components."""
    words = "".join(cell.itertext()).replace("−", "-")
    python = re.sub(r"([wxyz])2", r"\1**2", words)
    python = re.sub(r"([wxyz])([wxyz])", r"\1*\2", python).replace("2(", "2*(")
    return eval(python, dict(zip("wxyz", map(float, quaternion), strict=True)))
