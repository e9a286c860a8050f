"""The chapters that come from the DBC alone: identifiers, messages with their bits, nodes, value tables."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from cantools.database.can import Message, Signal

from gnss_hil.dbc.contract.messages import HEARTBEAT_BASE, node_names
from gnss_hil.tools.icd import bits, idmap
from gnss_hil.tools.icd.contract import GROUPS, Contract, Group, Layout
from gnss_hil.tools.report.markup import Markup, figure, joined, table, tag, text

_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def number(value: float | None) -> str:
    """All digits of a decimal; powers of ten where it is small (1.25·10⁻⁷); none of what is not given."""
    digits = "" if value is None else f"{value:.15g}"
    mantissa, e, power = digits.replace("-", "−", digits.startswith("-")).partition("e")
    return f"{mantissa}·10{str(int(power)).translate(_SUPERSCRIPT)}" if e else mantissa


def code_id(can_id: int) -> Markup:
    return tag.code(f"0x{can_id:03X}")


def _nodes(names: Iterable[str]) -> str:
    """Nodes, each once; three receivers and more as a range."""
    once = list(dict.fromkeys(names))
    receivers = [name for name in once if name.startswith("RX")]
    short = [f"{receivers[0]} .. {receivers[-1]}"] if len(receivers) > 2 else receivers
    return ", ".join(short + [name for name in once if name not in receivers])


def readers(message: Message) -> list[str]:
    """Nodes that read any signal of a message, in the DBC's order."""
    return list(dict.fromkeys(node for signal in message.signals for node in signal.receivers))


def overview(contract: Contract) -> Markup:
    """The map of the identifiers, and a row for each kind of message."""
    drawing = figure(
        idmap.draw(contract),
        "Identifiers 0x000 to 0x7FF, 64 in a row; the lower one wins the bus. Filled: in this contract, each "
        "leads to its message. Hatched: kept for further receivers.",
    )
    head = ("message", "identifiers", "from", "to", "sent", "says")
    rows = (
        (
            tag.a(layout.name, href=f"#{layout.name}"),
            joined(dict.fromkeys(code_id(layout.messages[k].frame_id) for k in (0, -1)), " .. "),
            _nodes(m.senders[0] for m in layout.messages),
            _nodes(node for m in layout.messages for node in readers(m)),
            layout.sent,
            layout.comment,
        )
        for layout in contract.layouts
    )
    return text((drawing, table(head, rows, class_="overview")))


def groups(contract: Contract) -> Iterator[Markup]:
    """All messages with their bits and signals, by group."""
    for group in GROUPS:
        layouts = [layout for layout in contract.layouts if layout.group == group]
        yield tag.h3(group.name[0].upper() + group.name[1:], id=f"group-{group.name.replace(' ', '-')}")
        yield from (_message(contract, layout, group) for layout in layouts)


def _message(contract: Contract, layout: Layout, group: Group) -> Markup:
    identifier = None if layout.repeats else code_id(layout.messages[0].frame_id)
    head = tag.div(
        tag.h4(tag.span(class_=f"chip g{group.tone}"), layout.name, " ", identifier),
        tag.p(layout.comment, class_="says"),
        _facts(layout),
        tag.figure(bits.draw(layout)),
        class_="keep",
    )
    return tag.section(head, _signal_table(contract, layout), class_="message", id=layout.name)


def _facts(layout: Layout) -> Markup:
    """How it is sent and protected; of a kind that repeats, its messages beside it."""
    first = layout.messages[0]
    cycle = f"{first.send_type}, {first.cycle_time} ms" if first.cycle_time else first.send_type
    key = f"the identifier and {layout.stream_key}" if layout.stream_key else "the identifier"
    protection = f"E2E Profile 11A, one stream for {key}" if layout.protected else "none: a bench frame"
    ways = () if layout.repeats else (f"{_nodes(first.senders)} → {_nodes(readers(first))}",)
    facts = (
        *(("from, to", way) for way in ways),
        ("sent", f"{layout.sent} (DBC: {cycle})"),
        ("protection", protection),
        ("length", f"{first.length} bytes"),
    )
    listed = tag.dl((tag.dt(what), tag.dd(value)) for what, value in facts)
    if not layout.repeats:
        return listed
    rows = (
        (code_id(m.frame_id), tag.code(m.name, id=m.name), _nodes(m.senders), _nodes(readers(m)))
        for m in layout.messages
    )
    return tag.div(
        listed, table(("identifier", "message", "from", "to"), rows, class_="ids"), class_="abreast"
    )


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
            joined(map(tag.code, names)),
            joined(numbers[name] for name in names),
            joined(code_id(HEARTBEAT_BASE + numbers[name]) for name in names),
            *sends_reads,
        )
        for sends_reads, names in alike.items()
    )
    return table(("node", "number", "heartbeat", "sends", "reads"), rows)


def _links(contract: Contract, names: set[str]) -> Markup:
    """Layouts of messages, each once, as links."""
    own = (layout.name for layout in contract.layouts if any(m.name in names for m in layout.messages))
    return joined(tag.a(name, href=f"#{name}") for name in own)


def value_tables(contract: Contract) -> Iterator[Markup]:
    used: dict[str, list[Markup]] = {}
    for layout in contract.layouts:
        for s in layout.signals:
            if name := contract.table_of(s):
                link = tag.a(f"{layout.name}.{s.name}", href=f"#{layout.name}.{s.name}")
                used.setdefault(name, []).append(link)
    for name, values in contract.value_tables().items():
        yield tag.section(
            tag.h4(name), tag.p("Used by ", joined(used.get(name, [])), ".", class_="says"),
            table(("value", "name"), ((raw, tag.code(label)) for raw, label in values.items()), (0,)),
            class_="keep values", id=f"values-{name}",
        )  # fmt: skip
