"""Documents that are generated are those in the repository."""

from __future__ import annotations

import pytest

from tests.documents.generated import ROOT, generated

pytestmark = pytest.mark.verifies(
    "dbc/contract/document.py",
    what="Message map",
    by="our words; the file in docs is what is generated",
    status="modelled",
)


@pytest.mark.parametrize("name", generated())
def test_generated_document_is_current(name):
    assert (ROOT / name).read_text("utf-8") == generated()[name], "make docs writes it anew"
