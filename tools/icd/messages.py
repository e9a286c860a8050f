"""The chapters that come from the DBC alone: identifiers, messages with their bits, nodes, value tables."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from gnss_hil.dbc.contract.messages import HEARTBEAT_BASE, node_names
from gnss_hil.tools.icd import bits, idmap
from gnss_hil.tools.icd.contract import GROUPS, Contract, Group, Layout
from gnss_hil.tools.icd.markup import Markup, decimal, figure, table, tag, text
from gnss_hil.tools.icd.prose import paragraph

if TYPE_CHECKING:
    from cantools.database.can import Message, Signal


def number(value: float | None) -> str:
    """All digits of a decimal; powers of ten where it is small; none of what is not given."""
    return "" if value is None else decimal(f"{value:.15g}")


def code_id(can_id: int) -> Markup:
    return tag.code(f"0x{can_id:03X}")


def _join(names: list[str]) -> Markup:
    """Nodes, as many receivers as there are told in one go."""
    receivers = [name for name in names if name.startswith("RX")]
    rest = [name for name in names if name not in receivers]
    told = [f"{receivers[0]} .. {receivers[-1]}"] if len(receivers) > 2 else receivers
    return text(", ".join(told + rest))


def readers(message: Message) -> list[str]:
    """Nodes that read any signal of a message, in the DBC's order."""
    return list(dict.fromkeys(node for signal in message.signals for node in signal.receivers))


# --- identifiers -------------------------------------------------------------------------------------


def map_chapter(contract: Contract) -> Markup:
    drawing = figure(
        idmap.draw(contract),
        "Identifiers 0x000 to 0x7FF, 64 in a row; the lower one wins the bus. Filled: in this contract, each "
        "leads to its message. Hatched: kept for further receivers.",
    )
    head = ("message", "identifiers", "from", "to", "sent", "says")
    rows = (
        (
            tag.a(layout.name, href=f"#{layout.name}"),
            _span(layout), _senders(layout), _readers(layout), layout.sent, layout.comment,
        )
        for layout in contract.layouts
    )  # fmt: skip
    return text((drawing, table(head, rows, class_="overview")))


def _span(layout: Layout) -> Markup:
    first, last = layout.messages[0].frame_id, layout.messages[-1].frame_id
    return code_id(first) if first == last else text((code_id(first), " .. ", code_id(last)))


def _senders(layout: Layout) -> Markup:
    return _join(list(dict.fromkeys(m.senders[0] for m in layout.messages)))


def _readers(layout: Layout) -> Markup:
    return _join(list(dict.fromkeys(node for m in layout.messages for node in readers(m))))


# --- messages ----------------------------------------------------------------------------------------


def messages_chapter(contract: Contract) -> Iterator[Markup]:
    yield paragraph("""
        The drawings show the eight bytes as rows, byte 0 first on the bus, and in each byte bit 7 to the
        left. Signals are little-endian: a signal begins with its lowest bit (lsb) at its start bit and goes
        on to the left, then at the right end of the next byte. The small number in a cell is the bit's weight
        in its signal: number n counts 2ⁿ steps. Signed signals are two's complement. Grey is the protection
        header; hatched bits are free and zero.
    """)
    for group in GROUPS:
        layouts = [layout for layout in contract.layouts if layout.group == group]
        yield tag.h3(group.name[0].upper() + group.name[1:], id=f"group-{group.name.replace(' ', '-')}")
        yield from (_message(contract, layout, group) for layout in layouts)


def _message(contract: Contract, layout: Layout, group: Group) -> Markup:
    head = tag.div(
        tag.h4(tag.span(class_=f"chip g{group.tone}"), layout.name, " ", _own_anchor(layout)),
        tag.p(layout.comment, class_="says"),
        _facts(layout),
        tag.figure(bits.draw(layout)),
        class_="keep",
    )
    return tag.section(head, _signal_table(contract, layout), class_="message", id=layout.name)


def _own_anchor(layout: Layout) -> Markup | None:
    """Identifier of a layout that is one message; that message's anchor is the section's."""
    return None if layout.repeats else code_id(layout.messages[0].frame_id)


def _facts(layout: Layout) -> Markup:
    first = layout.messages[0]
    cycle = f"{first.send_type}, {first.cycle_time} ms" if first.cycle_time else first.send_type
    key = f"the identifier and {layout.stream_key}" if layout.stream_key else "the identifier"
    facts = [
        ("sent", f"{layout.sent} (DBC: {cycle})"),
        (
            "protection",
            f"E2E Profile 11A, one stream for {key}" if layout.protected else "none: a bench frame",
        ),
        ("length", f"{first.length} bytes"),
    ]
    if not layout.repeats:
        facts.insert(0, ("from, to", text((_senders(layout), " → ", _join(readers(first))))))
        return _definitions(facts)
    rows = (
        (code_id(m.frame_id), tag.code(m.name, id=m.name), _join(m.senders), _join(readers(m)))
        for m in layout.messages
    )
    named = table(("identifier", "message", "from", "to"), rows, class_="ids")
    return tag.div(_definitions(facts), named, class_="abreast")


def _definitions(facts: list[tuple[str, Markup | str]]) -> Markup:
    return tag.dl((tag.dt(what), tag.dd(said)) for what, said in facts)


def _signal_table(contract: Contract, layout: Layout) -> Markup:
    head = ("signal", "start", "bits", "sign", "step", "unit", "range", "meaning")
    tone = bits.tones(layout.signals)
    rows = (_signal_row(contract, layout, s, tone[s.name]) for s in layout.signals)
    return table(head, rows, (1, 2), class_="signals")


def _signal_row(contract: Contract, layout: Layout, s: Signal, tone: str) -> tuple:
    values = contract.table_of(s)
    named = tag.a(values, href=f"#values-{values}") if values else None
    offset = f", from {number(s.offset)}" if s.offset else ""
    name = tag.code(s.name, id=f"{layout.name}.{s.name}")
    return (
        tag.span(tag.span(class_=f"chip {tone}"), name, class_="range"),
        s.start, s.length, "signed" if s.is_signed else "unsigned", number(s.scale) + offset, s.unit or "",
        tag.span(f"{number(s.minimum)} .. {number(s.maximum)}", class_="range"),
        text((s.comment, [" (", named, ")"] if named else None)),
    )  # fmt: skip


# --- nodes and values --------------------------------------------------------------------------------


def node_table(contract: Contract) -> Markup:
    """Nodes that send and read the same kinds share a row."""
    numbers = node_names(contract.codec.receivers)
    alike: dict[tuple[Markup, Markup], list[str]] = {}
    for node in contract.database.nodes:
        sends = {m.name for m in contract.messages if node.name in m.senders}
        reads = {m.name for m in contract.messages if node.name in readers(m)}
        alike.setdefault((_links(contract, sends), _links(contract, reads)), []).append(node.name)
    rows = (
        (
            [[", " if k else "", tag.code(name)] for k, name in enumerate(names)],
            ", ".join(str(numbers[name]) for name in names),
            [[", " if k else "", code_id(HEARTBEAT_BASE + numbers[name])] for k, name in enumerate(names)],
            *sends_reads,
        )
        for sends_reads, names in alike.items()
    )
    return table(("node", "number", "heartbeat", "sends", "reads"), rows)


def _links(contract: Contract, names: set[str]) -> Markup:
    """Layouts of messages, each once, as links."""
    own = [layout.name for layout in contract.layouts if any(m.name in names for m in layout.messages)]
    return text([", " if k else "", tag.a(name, href=f"#{name}")] for k, name in enumerate(own))


def value_tables(contract: Contract) -> Iterator[Markup]:
    used: dict[str, list[Markup]] = {}
    for layout in contract.layouts:
        for s in layout.signals:
            if name := contract.table_of(s):
                link = tag.a(f"{layout.name}.{s.name}", href=f"#{layout.name}.{s.name}")
                used.setdefault(name, []).append(link)
    for name, values in contract.value_tables().items():
        users = [[", " if k else "", link] for k, link in enumerate(used.get(name, []))]
        yield tag.section(
            tag.h4(name), tag.p("Used by ", users, ".", class_="says"),
            table(("value", "name"), ((raw, tag.code(label)) for raw, label in values.items()), (0,)),
            class_="keep values", id=f"values-{name}",
        )  # fmt: skip
