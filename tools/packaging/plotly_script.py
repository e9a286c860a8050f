"""Take plotly's script, and its licence, out of the Python package: the report needs nothing else of it.

pip download --no-deps plotly==VERSION && python tools/packaging/plotly_script.py plotly-VERSION-*.whl
"""

from __future__ import annotations

import gzip
import sys
import zipfile
from pathlib import Path

REPORT = Path(__file__).parents[1] / "report"


def take(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        licence = next(name for name in names if name.endswith("/licenses/LICENSE.txt"))
        script = archive.read("plotly/package_data/plotly.min.js")
        (REPORT / "plotly.min.js.gz").write_bytes(gzip.compress(script, 9, mtime=0))
        (REPORT / "plotly.LICENSE.txt").write_bytes(archive.read(licence))


if __name__ == "__main__":
    take(Path(sys.argv[1]))
