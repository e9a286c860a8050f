"""TOML text of plain documents, by tomli-w: the standard library reads TOML but does not write it."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from typing import Any

import tomli_w


def dumps(document: Mapping[str, Any]) -> str:
    """TOML text of a document; None values are left out, times are strings, as scenarios have them."""
    return tomli_w.dumps(_plain(document))


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _plain(inner) for key, inner in value.items() if inner is not None}
    if isinstance(value, (list, tuple)):
        return [_plain(inner) for inner in value]
    return value.isoformat() if isinstance(value, datetime) else value
