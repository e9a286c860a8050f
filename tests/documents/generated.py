"""What is generated, by the file it stands in."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from gnss_hil.dbc.contract import document as messages
from gnss_hil.tools.schema import fault_page, json_schema, page
from tests.results import fault_library
from tests.results import page as results
from tests.verification import page as verification

ROOT = Path(__file__).parents[2]
SCHEMAS = {
    "vehicle": "dbc/vehicles",
    "scenario": "emulator/data/scenarios",
    "structure": "emulator/data/structures",
    "faults": "emulator/data/faults",
}
"""Kind of file -> where those are that ship, and their schema."""


@cache
def generated() -> dict[str, str]:
    """File, relative to the repository -> its text."""
    return {
        "docs/messages.md": messages.document(),
        "docs/scenario.md": page.page(),
        "docs/faults.md": fault_page.page(),
        "docs/faults-library.md": fault_library.page(),
        "docs/results.md": results.page(),
        "README.md": results.readme(),
        **verification.pages(),
        **{
            f"{folder}/{json_schema.file_name(kind)}": json_schema.text(kind)
            for kind, folder in SCHEMAS.items()
        },
    }
