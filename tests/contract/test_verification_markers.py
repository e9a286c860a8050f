"""The markers `verifies`: what is read, what is refused."""

from __future__ import annotations

import pytest

from tests.verification.rows import Row, Unclear, extra, joined, marks

GOOD = """
import pytest

pytestmark = [
    pytest.mark.slow,
    pytest.mark.verifies("dbc/bus/hub.py", what="A", by="a book", status="modelled"),
]

@pytest.mark.verifies(
    "dbc/bus/hub.py",
    "dbc/bus/base.py",
    what="B",
    by=("a longer "
        "book"),
    status="validated",
)
@pytest.mark.parametrize("x", [1])
def test_b(x): ...

@pytest.mark.verifies(what="B")
def test_more_of_b(): ...
"""


def read(tmp_path, text: str) -> list[Row]:
    (tmp_path / "tests").mkdir(exist_ok=True)
    path = tmp_path / "tests" / "test_it.py"
    path.write_text(text)
    return marks(path, tmp_path)


def test_markers_are_read(tmp_path):
    rows = joined(read(tmp_path, GOOD))
    assert rows == (
        Row("A", ("dbc/bus/hub.py",), "a book", "modelled", ("tests/test_it.py",)),
        Row(
            "B", ("dbc/bus/hub.py", "dbc/bus/base.py"), "a longer book", "validated",
            ("tests/test_it.py::test_b", "tests/test_it.py::test_more_of_b"),
        ),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('status="validated"', 'status="checked"', "status 'checked'"),
        ('status="validated",', "", "takes files, what, by and status"),
        ('by="a book"', 'by=""', "says what it is and who"),
        ('by="a book"', "by=BOOK", "plain strings"),
        ('what="A"', 'what="B"', "described twice"),
        ('verifies(what="B")', 'verifies(what="C")', "no marker describes 'C'"),
    ],
)
def test_what_is_not_clear_is_refused(tmp_path, old, new, words):
    with pytest.raises(Unclear, match=words):
        joined(read(tmp_path, GOOD.replace(old, new)))


def test_rows_without_a_test(tmp_path):
    path = tmp_path / "extra.toml"
    path.write_text('[[row]]\nwhat = "A"\nwhere = ["dbc/bus/hub.py"]\nby = "a person"\nstatus = "modelled"\n')
    assert extra(path) == [Row("A", ("dbc/bus/hub.py",), "a person", "modelled")]
    path.write_text(path.read_text().replace("modelled", "done"))
    with pytest.raises(Unclear, match="status 'done'"):
        extra(path)
