"""The page in headless Chromium: silent, drawn, and printable.

Where there is no Chromium this skips, loudly; with GNSS_HIL_REQUIRE_CHROMIUM set it fails.
"""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

from tests.support.browser import CHROMIUM, require
from tests.support.icd_pages import page
from tests.support.waiting import HANG_S

pytestmark = pytest.mark.verifies(
    "tools/icd/page.py",
    "tools/icd/chapters.py",
    "tools/icd/prose.py",
    "tools/report/markup.py",
    "tools/icd/documented_buses.py",
    what="Interface control document: the page",
    by=(
        "Chromium opens it without a word, prints it, scrolls nothing sideways; sound XML, every link leads "
        "somewhere"
    ),
    status="validated",
)


@pytest.fixture(autouse=True)
def _browser():
    require()


def opened(folder: Path, html: str, *options: str) -> subprocess.CompletedProcess:
    file = folder / "page.html"
    file.write_text(html, "utf-8")
    common = (
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--enable-logging=stderr",
        "--window-size=1440,900",
    )
    profile = f"--user-data-dir={folder / 'profile'}"
    return subprocess.run(
        [CHROMIUM, *common, profile, *options, file.as_uri()], capture_output=True, text=True, timeout=HANG_S
    )


def console(done: subprocess.CompletedProcess) -> list[str]:
    return re.findall(r"CONSOLE.*", done.stderr)


def test_it_opens_without_a_word_on_the_console(tmp_path):
    done = opened(tmp_path, page(), "--dump-dom")
    assert done.returncode == 0, done.stderr
    assert console(done) == []
    assert done.stdout.count("data-bit=") == page().count("data-bit=") > 2000


@pytest.mark.slow
def test_a_word_on_the_console_would_be_heard(tmp_path):
    done = opened(
        tmp_path, page().replace("</main>", "<script>console.error('ouch')</script></main>"), "--dump-dom"
    )
    assert len(console(done)) == 1


@pytest.mark.slow
def test_nothing_is_wider_than_a_phone(tmp_path):
    """Wide tables scroll in their own frames; the page itself does not."""
    script = "document.title = document.documentElement.scrollWidth - document.documentElement.clientWidth"
    narrow = page().replace("</main>", f"</main><script>{script}</script>")
    done = opened(tmp_path, narrow, "--dump-dom", "--window-size=500,900")
    assert re.search(r"<title>(-?\d+)</title>", done.stdout)[1] == "0"


@pytest.mark.slow
def test_it_prints(tmp_path):
    paper = tmp_path / "icd.pdf"
    done = opened(tmp_path, page(), f"--print-to-pdf={paper}", "--no-pdf-header-footer")
    assert done.returncode == 0, done.stderr
    assert 20 < paper.read_bytes().count(b"/Type /Page\n") < 80
