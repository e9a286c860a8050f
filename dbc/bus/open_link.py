"""The table of ways onto a bus: a link by its specification."""

from __future__ import annotations

import re
from importlib import import_module

from gnss_hil.dbc.bus.base import Link, UnknownBus

_OPENERS = {
    "embedded": ("gnss_hil.dbc.bus.embedded", "connect"),
    "socketcan": ("gnss_hil.dbc.bus.socketcan", "connect"),
}
"""Links of our own; every other name is a python-can interface."""


def open_link(spec: str) -> Link:
    """The link of a specification.

    embedded:/path.sock   a hub of ours          socketcan:vcan0   a kernel CAN interface
    python-can[:CONTEXT]  python-can's own configuration: files, environment, a section of it
    INTERFACE:CHANNEL     any python-can interface

    LinkError says in one line what is missing, UnknownBus what is wrong with the specification.
    """
    interface, _, channel = spec.partition(":")
    if not interface or (interface != "python-can" and not channel):
        raise UnknownBus(f"bus '{spec}': not of the form INTERFACE:CHANNEL; {probably(spec)}")
    if interface in _OPENERS:
        module, name = _OPENERS[interface]
        return getattr(import_module(module), name)(channel)
    return import_module("gnss_hil.dbc.bus.pythoncan").connect(interface, channel)


def probably(spec: str) -> str:
    """What was probably meant by a specification without a channel."""
    named = re.fullmatch(r"v?can\d+", spec)
    return f"did you mean 'socketcan:{spec}'?" if named else "for example socketcan:vcan0 or embedded:PATH"


def is_shared(spec: str) -> bool:
    """True if others than this bench may be on the bus: everything but our own hub."""
    return not spec.startswith("embedded:")
