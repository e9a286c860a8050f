"""Formulas of the contract's page, which are typed on one line, as MathML.

Read is: names (`omega_e`: a subscript, `mu`: a Greek letter, `clock_m`: a signal), numbers, + - / ^ = | |,
brackets, matrices `[[a, b], [c, d]]`, functions `ln(...)` and `cos x`, products by standing side by side.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from gnss_hil.tools.icd.markup import Markup, decimal, tag, text
from gnss_hil.tools.icd.prose import inline

_TOKEN = re.compile(r"\s*(?:(\d+(?:\.\d+)?(?:e[+-]?\d+)?)|([A-Za-z]\w*'*)|([-+/^=|()\[\],]))")
_CONSTANT = re.compile(r"(\w+) = ([\d.]+(?:e[+-]?\d+)?) (\S+)")
_REMARK = re.compile(r" \(([A-Za-z' ]+ [A-Za-z' ]+)\)$")
_GREEK = {"omega": "ω", "mu": "μ", "rho": "ρ"}
_FUNCTIONS = frozenset({"ln", "cos", "sin"})
_MINUS = "−"


class FormulaError(ValueError):
    """Something that is not a formula."""


def block(lines: list[str]) -> Markup:
    """An indented block: every line a formula or several, a list of constants, or words."""
    return tag.div(map(_line, _whole(lines)), class_="maths")


def _whole(lines: list[str]) -> Iterator[str]:
    """Lines of which none ends within brackets."""
    line = ""
    for part in filter(None, map(str.strip, lines)):
        line = f"{line} {part}".strip()
        if line.count("[") == line.count("]"):
            yield line
            line = ""


def _line(line: str) -> Markup:
    pieces = line.split(", ")
    constants = [found for found in map(_CONSTANT.fullmatch, pieces) if found]
    if len(constants) == len(pieces):
        return tag.p([", " if k else "", _constant(*c.groups())] for k, c in enumerate(constants))
    if ":" in line:
        return tag.p(inline(line))
    return text(tag.p(_statement(piece)) for piece in _statements(line))


def _statements(line: str) -> Iterator[str]:
    """Formulas of a line stand apart by a comma and several blanks outside brackets."""
    start = 0
    for gap in re.finditer(r",\s{2,}", line):
        piece = line[start : gap.start()]
        if piece.count("[") == piece.count("]"):
            yield piece
            start = gap.end()
    yield line[start:]


def _constant(name: str, number: str, unit: str) -> Markup:
    return tag.math(
        tag.mrow(_name(name), tag.mo("="), _number(number), tag.mspace(width="0.3em"), _unit(unit))
    )


def _unit(unit: str) -> Markup:
    return tag.mtext(re.sub(r"\^(\d)", lambda power: "⁰¹²³⁴⁵⁶⁷⁸⁹"[int(power[1])], unit))


def _statement(formula: str) -> Markup:
    remark = _REMARK.search(formula)
    if remark:
        formula = formula[: remark.start()]
    shown = tag.math(parse(formula), display="block" if not remark else None)
    return text((shown, f"  ({remark[1]})" if remark else None))


def parse(formula: str) -> Markup:
    """One formula as a MathML row."""
    reader = _Reader(formula)
    row = reader.relation()
    if reader.peek():
        raise FormulaError(f"'{formula}': '{reader.peek()}' is not expected")
    return row


def _tokens(formula: str) -> list[str]:
    out, at = [], 0
    while at < len(formula.rstrip()):
        found = _TOKEN.match(formula, at)
        if not found:
            raise FormulaError(f"'{formula}': '{formula[at:].strip()}' is no part of a formula")
        out.append(found[0].strip())
        at = found.end()
    return out


def _number(digits: str) -> Markup:
    return tag.mn(decimal(digits))


def _name(name: str) -> Markup:
    bare = name.rstrip("'")
    base, _, below = bare.partition("_")
    if base in _GREEK or (len(base) == 1 and below):
        shown = tag.mi(_GREEK.get(base, base))
        shown = tag.msub(shown, tag.mi(below)) if below else shown
    elif re.fullmatch(r"[A-Z]\d", bare):
        shown = tag.msub(tag.mi(bare[0]), tag.mn(bare[1]))
    elif len(bare) == 2 and (set(bare) <= set("wxyz") or bare[0] == "d"):  # a product, a differential
        shown = tag.mrow(tag.mi(bare[0]), tag.mi(bare[1]))
        shown = tag.msup(tag.mi(bare[0]), tag.mn(2)) if bare[0] == bare[1] else shown
    elif len(bare) == 1:
        shown = tag.mi(bare)
    else:
        shown = tag.mi(bare, class_="signal")
    primes = len(name) - len(bare)
    return tag.mrow(shown, tag.mo("′" * primes, form="postfix")) if primes else shown


_OPEN, _CLOSE = tag.mo("("), tag.mo(")")


def _bare(parts: list[Markup]) -> Markup:
    """A product without the brackets around the whole of it: a fraction's bar does their work."""
    if len(parts) == 1 and parts[0].startswith(f"<mrow>{_OPEN}") and parts[0].endswith(f"{_CLOSE}</mrow>"):
        return Markup(parts[0].replace(_OPEN, "", 1)[: -len(f"{_CLOSE}</mrow>")] + "</mrow>")
    return tag.mrow(parts)


class _Reader:
    """Recursive descent over one formula; every method reads what it is named after and returns MathML."""

    def __init__(self, formula: str):
        self._formula = formula
        self._left = _tokens(formula)
        self._bars = 0

    def peek(self) -> str:
        return self._left[0] if self._left else ""

    def _take(self, wanted: str = "") -> str:
        if not self._left or (wanted and self._left[0] != wanted):
            raise FormulaError(
                f"'{self._formula}': {wanted or 'something'} is missing before '{self.peek()}'"
            )
        return self._left.pop(0)

    def relation(self) -> Markup:
        parts = [self.sum()]
        while self.peek() == "=":
            parts += [tag.mo(self._take()), self.sum()]
        return tag.mrow(parts)

    def sum(self) -> Markup:
        parts = [tag.mo(_MINUS, form="prefix")] if self.peek() == "-" and self._take() else []
        parts.append(self.product())
        while self.peek() in ("+", "-"):
            parts += [tag.mo(self._take().replace("-", _MINUS)), self.product()]
        return tag.mrow(parts)

    def product(self) -> Markup:
        parts = [self.power()]
        while self._more():
            if self.peek() == "/":
                self._take()
                parts = [tag.mfrac(_bare(parts), _bare([self.power()]))]
            else:
                parts += [tag.mspace(width="0.15em"), self.power()]
        return tag.mrow(parts)

    def _more(self) -> bool:
        if self.peek() == "|":
            return not self._bars
        return bool(self.peek()) and self.peek() not in "+-=)],^"

    def power(self) -> Markup:
        base = self.primary()
        if self.peek() != "^":
            return base
        self._take()
        return tag.msup(base, self.primary())

    def primary(self) -> Markup:
        token = self._take()
        if token == "(":
            return self._fenced()
        if token == "|":
            return self._norm()
        if token == "[":
            return self._matrix()
        if token[0].isdigit():
            return _number(token)
        if token in _FUNCTIONS or self._applied(token):
            shown = tag.mi(token, mathvariant="normal") if token in _FUNCTIONS else _name(token)
            gap = tag.mspace(width="0.15em")
            return tag.mrow(shown, tag.mo("\u2061"), gap if token in _FUNCTIONS else None, self.primary())
        if not token[0].isalpha():
            raise FormulaError(f"'{self._formula}': '{token}' is not expected")
        return _name(token)

    def _applied(self, name: str) -> bool:
        return self.peek() == "(" and re.fullmatch(r"[A-Z]\d?", name) is not None

    def _fenced(self) -> Markup:
        bars, self._bars = self._bars, 0
        inner = self.sum()
        self._take(")")
        self._bars = bars
        return tag.mrow(_OPEN, inner, _CLOSE)

    def _norm(self) -> Markup:
        self._bars += 1
        inner = self.sum()
        self._take("|")
        self._bars -= 1
        return tag.mrow(tag.mo("|", form="prefix"), inner, tag.mo("|", form="postfix"))

    def _matrix(self) -> Markup:
        rows = [self._row()]
        while self.peek() == ",":
            self._take()
            rows.append(self._row())
        self._take("]")
        return tag.mrow(tag.mo("["), tag.mtable(rows), tag.mo("]"))

    def _row(self) -> Markup:
        self._take("[")
        cells = [self.sum()]
        while self.peek() == ",":
            self._take()
            cells.append(self.sum())
        self._take("]")
        return tag.mtr(tag.mtd(cell) for cell in cells)
