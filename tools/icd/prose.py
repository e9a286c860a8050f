"""The words of `docs/contract.md`, which ships in this package: they are written once."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import cache
from importlib import resources

from markdown_it import MarkdownIt
from markdown_it.renderer import RendererHTML
from markdown_it.token import Token

from gnss_hil.tools.icd import maths
from gnss_hil.tools.icd.markup import Markup, tag

Block = Callable[[str], Markup]


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
        return '<div class="wide"><table>'

    def table_close(self, tokens: Sequence[Token], idx: int, options, env) -> str:
        return "</table></div>"

    def th_open(self, tokens: Sequence[Token], idx: int, options, env) -> str:
        right = "right" in str(tokens[idx].attrGet("style"))
        return f'<{tokens[idx].tag} class="n">' if right else f"<{tokens[idx].tag}>"

    td_open = th_open

    def fence(self, tokens: Sequence[Token], idx: int, options, env) -> str:
        words = tokens[idx]
        return maths.block(words.content) if words.info == "math" else code(words.content)

    def code_block(self, tokens: Sequence[Token], idx: int, options, env) -> str:
        return env["block_of"](tokens[idx].content)


@cache
def _markdown() -> MarkdownIt:
    options = {"html": False, "xhtmlOut": True}
    return MarkdownIt("commonmark", options, renderer_cls=_Renderer).enable("table")


def paragraph(words: str, **attributes: object) -> Markup:
    return tag.p(Markup(_markdown().renderInline(" ".join(words.split()))), **attributes)


def code(content: str) -> Markup:
    return tag.pre(content.rstrip("\n"))


def render(markdown: str, block_of: Block = code) -> Markup:
    """A section as markup; `block_of` turns its indented blocks into it."""
    return Markup(_markdown().render(markdown, {"block_of": block_of}))
