"""The words of `docs/contract.md`, which ships in this package: they are written once."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache
from importlib import resources

from markdown_it import MarkdownIt
from markdown_it.renderer import RendererHTML
from markdown_it.token import Token

from gnss_hil.tools.icd import maths
from gnss_hil.tools.report.markup import Markup, tag


@cache
def sections() -> dict[str, str]:
    """Title -> Markdown of each section of the contract's page, in its order."""
    page = resources.files("gnss_hil").joinpath("contract.md").read_text("utf-8")
    parts = re.split(r"^## (.+)\n", page, flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def anchor(title: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-")


class _Renderer(RendererHTML):
    """Elements as the style sheet wants them: tables in a box that scrolls, numbers flush right, formulas."""

    def table_open(self, tokens: Sequence[Token], idx: int, options, env) -> str:
        return '<div class="scroll"><table>'

    def table_close(self, tokens: Sequence[Token], idx: int, options, env) -> str:
        return "</table></div>"

    def th_open(self, tokens: Sequence[Token], idx: int, options, env) -> str:
        right = "right" in str(tokens[idx].attrGet("style"))
        return f'<{tokens[idx].tag} class="n">' if right else f"<{tokens[idx].tag}>"

    td_open = th_open

    def heading_open(self, tokens: Sequence[Token], idx: int, options, env) -> str:
        return f'<{tokens[idx].tag} id="{anchor(tokens[idx + 1].content)}">'

    def fence(self, tokens: Sequence[Token], idx: int, options, env) -> str:
        words = tokens[idx].content
        return maths.block(words) if tokens[idx].info == "math" else tag.pre(words.rstrip("\n"))

    code_block = fence


@cache
def _markdown() -> MarkdownIt:
    options = {"html": False, "xhtmlOut": True}
    return MarkdownIt("commonmark", options, renderer_cls=_Renderer).enable("table")


def render(markdown: str) -> Markup:
    """Markdown as markup."""
    return Markup(_markdown().render(markdown))
