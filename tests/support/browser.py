"""A real browser without a window: what a page becomes in it, what it complains of, how it looks."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import zlib
from dataclasses import dataclass
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np

from tests.support.outside import missing
from tests.support.waiting import HANG_S

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
LIGHT, DARK = 1, 0

_PROBE = """
<script>
let loaded = null, onPaper = null;
const widths = () => [...document.querySelectorAll(".plot")].map(
  (plot) => +(plot.querySelector("svg.main-svg")?.getAttribute("width") ?? 0));
addEventListener("load", () => { loaded = widths(); });
setInterval(() => {
  const root = document.documentElement;
  if (!("drawn" in root.dataset)) return;
  if (!loaded) return;
  if (!onPaper) {
    dispatchEvent(new Event("beforeprint"));
    onPaper = widths();
    dispatchEvent(new Event("afterprint"));
    return;
  }
  const plots = [...document.querySelectorAll(".plot")].map((plot) => ({
    id: plot.id,
    surfaces: plot.querySelectorAll("svg.main-svg").length,
    traces: plot.querySelectorAll("g.trace, g.hm").length,
    asked: (plot.data || []).length,
    time: plot.layout?.xaxis?.type === "date" ? plot.layout.xaxis.range : null,
  }));
  const naming = [...document.querySelectorAll("[src], [href]")];
  const addresses = naming.map((e) => e.src || e.href.baseVal || e.href);
  const fetched = performance.getEntriesByType("resource").map((e) => e.name);
  root.dataset.probe = JSON.stringify({
    plots, addresses, fetched, width: innerWidth, scroll: root.scrollWidth,
    cut: [...document.querySelectorAll(".scroll")].filter((e) => e.scrollWidth > e.clientWidth).length,
    told: [...document.querySelectorAll(".scroll[tabindex]")].filter(
      (e) => getComputedStyle(e, "::after").content.includes("sideways")).length,
    stays: [...document.querySelectorAll(".scroll[tabindex] td:first-child")].every(
      (e) => getComputedStyle(e).position === "sticky"),
    round: [...document.querySelectorAll(".round")].map((e) => [e.clientWidth, e.clientHeight]),
    colour: getComputedStyle(root).colorScheme, loaded, printed: onPaper,
  });
}, 50);
</script>
"""


@dataclass(frozen=True, slots=True)
class Seen:
    """probe      what the page's own document says after drawing; None if it never drew
    complaints    console messages and uncaught exceptions
    """

    probe: dict[str, Any] | None
    complaints: list[str]


def require() -> None:
    """Skips without a browser; fails where one is part of the verdict."""
    if CHROMIUM is None:
        missing("CHROMIUM", "NO CHROMIUM: pages are not looked at in a real browser")


def _chromium(page: Path, profile: Path, width: int, height: int, scheme: int, *more: str):
    command = [
        CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
        f"--user-data-dir={profile}",
        "--host-resolver-rules=MAP * ~NOTFOUND", "--virtual-time-budget=30000", "--enable-logging=stderr",
        "--run-all-compositor-stages-before-draw", f"--window-size={width},{height}",
        f"--blink-settings=preferredColorScheme={scheme}", *more, page.absolute().as_uri(),
    ]  # fmt: skip
    return subprocess.run(command, capture_output=True, text=True, timeout=HANG_S)


def look(page: Path, folder: Path, width: int = 1200, scheme: int = LIGHT) -> Seen:
    """A page as it is after its scripts; a copy of it, with the probe at its end, is what is opened."""
    copy = folder / f"probed-{page.name}"
    text = page.read_text("utf-8")
    assert text.rstrip().endswith("</html>")
    copy.write_text(text.replace("</body>", f"{_PROBE}</body>"), "utf-8")
    done = _chromium(copy, folder / "profile", width, 900, scheme, "--dump-dom")
    found = re.search(r'<html[^>]* data-probe="([^"]*)"', done.stdout)
    complaints = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    return Seen(json.loads(unescape(found[1])) if found else None, complaints)


def screenshot(page: Path, folder: Path, scheme: int, width: int = 500, height: int = 1400) -> np.ndarray:
    """(height, width, 3) pixels of the top of a page."""
    picture = folder / f"{page.stem}-{scheme}.png"
    _chromium(page, folder / "profile", width, height, scheme, f"--screenshot={picture}")
    return pixels(picture.read_bytes())


def strokes(page: Path, folder: Path, width: int = 1400) -> int:
    """Lines on the paper of a page that is printed as soon as it says that it is loaded."""
    paper = folder / f"{page.stem}.pdf"
    command = [
        CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={folder / 'profile'}",
        "--host-resolver-rules=MAP * ~NOTFOUND", f"--window-size={width},900", "--no-pdf-header-footer",
        f"--print-to-pdf={paper}", page.absolute().as_uri(),
    ]  # fmt: skip
    subprocess.run(command, capture_output=True, timeout=HANG_S, check=True)
    streams = re.findall(rb"stream\r?\n(.*?)endstream", paper.read_bytes(), re.DOTALL)
    return sum(zlib.decompressobj().decompress(s).count(b" l\n") for s in streams if s[:1] == b"\x78")


def pixels(png: bytes) -> np.ndarray:
    """(height, width, 3) of an eight-bit PNG without interlace. Source: W3C PNG (third edition), 9.2."""
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    at, packed = 8, b""
    while at < len(png):
        length, kind = int.from_bytes(png[at : at + 4], "big"), png[at + 4 : at + 8]
        body = png[at + 8 : at + 8 + length]
        if kind == b"IHDR":
            width, height = int.from_bytes(body[:4], "big"), int.from_bytes(body[4:8], "big")
            depth, colour, interlace = body[8], body[9], body[12]
            assert (depth, interlace) == (8, 0) and colour in (2, 6)
            step = {2: 3, 6: 4}[colour]
        packed += body if kind == b"IDAT" else b""
        at += 12 + length
    rows = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(height, 1 + width * step)
    above, out = np.zeros(width * step, np.uint8), np.empty((height, width * step), np.uint8)
    for y, row in enumerate(rows):
        above = out[y] = _unfiltered(int(row[0]), row[1:], above, step)
    return out.reshape(height, width, step)[..., :3]


def _unfiltered(kind: int, row: np.ndarray, above: np.ndarray, step: int) -> np.ndarray:
    if kind == 0:
        return row
    if kind == 1:
        return np.cumsum(row.reshape(-1, step), axis=0, dtype=np.uint8).ravel()
    if kind == 2:
        return row + above
    out, line, up = [0] * step, row.tolist(), [0] * step + above.tolist()
    for i, value in enumerate(line):
        a, b, c = out[i], up[i + step], up[i]
        out.append((value + ((a + b) // 2 if kind == 3 else _paeth(a, b, c))) & 255)
    return np.array(out[step:], np.uint8)


def _paeth(a: int, b: int, c: int) -> int:
    p = a + b - c
    pa, pb, pc = abs(p - a), abs(p - b), abs(p - c)
    return a if pa <= pb and pa <= pc else b if pb <= pc else c
