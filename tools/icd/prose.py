"""The words of `docs/contract.md`, which ships in this package: they are written once.

Read is the Markdown which that page uses: sections, paragraphs, lists, tables, indented blocks, code,
emphasis and links. A link to another page of the repository becomes one to the chapter that holds the same.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from functools import cache
from importlib import resources

from gnss_hil.tools.icd.markup import Markup, table, tag, text

Block = Callable[[list[str]], Markup]

_INLINE = re.compile(
    r"`(?P<code>[^`]+)`|\*\*(?P<strong>[^*]+)\*\*|\*(?P<em>[^*\s][^*]*)\*|\[(?P<link>[^]]+)\]\((?P<to>[^)]+)\)"
)
_CHAPTER_OF = {"messages.md": "#messages", "contract.md": "#conventions"}


@cache
def sections() -> dict[str, str]:
    """Title -> Markdown of each section of the contract's page, in its order."""
    page = resources.files("gnss_hil").joinpath("contract.md").read_text("utf-8")
    parts = re.split(r"^## (.+)\n", page, flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def anchor(title: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-")


def inline(line: str) -> Markup:
    """Code, emphasis and links of a line."""
    out, end = [], 0
    for found in _INLINE.finditer(line):
        out += [line[end : found.start()], _span(found)]
        end = found.end()
    return text([*out, line[end:]])


def _span(found: re.Match) -> Markup:
    kind = next(name for name, words in found.groupdict().items() if words is not None)
    if kind == "link":
        href = _CHAPTER_OF.get(found["to"])
        return tag.a(inline(found["link"]), href=href) if href else inline(found["link"])
    return getattr(tag, kind)(found[kind] if kind == "code" else inline(found[kind]))


def _blocks(markdown: str) -> Iterator[list[str]]:
    """Lines that belong together: split at empty lines, and before a list or table."""
    block: list[str] = []
    for line in markdown.splitlines():
        if not line.strip():
            if block and not block[0].startswith("    "):
                yield block
                block = []
            elif block:
                block.append("")
            continue
        if block and block[0].startswith("    ") and not line.startswith("    "):
            yield block
            block = []
        if block and _kind(line) != _kind(block[0]) and _kind(line) in ("list", "table"):
            yield block
            block = []
        block.append(line)
    if block:
        yield block


def _kind(line: str) -> str:
    return next(
        (
            kind
            for start, kind in (("    ", "code"), ("- ", "list"), ("|", "table"))
            if line.startswith(start)
        ),
        "paragraph",
    )


def paragraph(words: str, **attributes: object) -> Markup:
    return tag.p(inline(" ".join(words.split())), **attributes)


def _paragraph(lines: list[str]) -> Markup:
    return paragraph("\n".join(lines))


def _list(lines: list[str]) -> Markup:
    items = re.split(r"^- ", "\n".join(lines), flags=re.MULTILINE)[1:]
    return tag.ul(tag.li(inline(" ".join(item.split()))) for item in items)


def _table(lines: list[str]) -> Markup:
    rows = [[inline(cell.strip()) for cell in line.strip().strip("|").split("|")] for line in lines]
    ruler = [cell.strip() for cell in lines[1].strip().strip("|").split("|")]
    return table(rows[0], rows[2:], [k for k, cell in enumerate(ruler) if cell.endswith(":")])


def code(lines: list[str]) -> Markup:
    return tag.pre("\n".join(line[4:] for line in lines).strip("\n"))


def render(markdown: str, block_of: Block = code) -> Markup:
    """A section as markup; `block_of` turns its indented blocks into it."""
    by_kind = {"paragraph": _paragraph, "list": _list, "table": _table, "code": block_of}
    return text(by_kind[_kind(lines[0])](lines) for lines in _blocks(markdown))
