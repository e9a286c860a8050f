"""Formulas of the contract's page, LaTeX, as MathML."""

from __future__ import annotations

import re

from latex2mathml.converter import convert

from gnss_hil.tools.report.markup import Markup, tag

_NAMESPACE = ' xmlns="http://www.w3.org/1998/Math/MathML"'
_SIGNAL = re.compile(r'(?:<mi mathvariant="monospace">[^<]+</mi>)+')


def formula(latex: str) -> Markup:
    """A formula, set apart. The page is HTML, whose parser knows the namespace of MathML by itself."""
    return Markup(_SIGNAL.sub(_signal, convert(latex, display="block").replace(_NAMESPACE, "", 1)))


def _signal(letters: re.Match[str]) -> str:
    r"""Letters of a `\mathtt{name}` as one name: browsers know no monospace of single letters."""
    return tag.mi(Markup(re.sub(r"<[^>]+>", "", letters[0])), class_="signal")


def block(latex: str) -> Markup:
    return tag.div(formula(latex), class_="maths")
