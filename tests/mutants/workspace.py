"""A copy of the checkout with a Python environment of its own, in which code may be changed and tests run.

Its interpreter finds the copy's code, also in processes that a test starts isolated; the installed libraries
are those of the interpreter that made it.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from tests.mutants.table import PACKAGES, ROOT, Mutant
from tests.support.outside import DATA

NOT_COPIED = (".*", "__pycache__", "build", "dist", "runs", "*.egg-info")

HANG_S = 60.0
"""So long a test waits for a state before it fails, see `tests.support.waiting`."""

PASSED, FAILED = 0, 1
"""Exit statuses of pytest; others say that tests could not be run."""


class Hung(Exception):
    """Tests did not end in the time they had."""


@dataclass(frozen=True, slots=True)
class Workspace:
    root: Path
    python: Path

    def test(self, tests: Sequence[str], seconds: float) -> tuple[int, str]:
        """Exit status and output of pytest, which ends at the first failure. Hung after so many seconds."""
        command = [
            self.python,
            "-m",
            "pytest",
            "-x",
            "-q",
            "-p",
            "no:cacheprovider",
            *tests,
        ]
        environment = {**os.environ, "GNSS_HIL_DATA": str(DATA), "GNSS_HIL_HANG_S": str(HANG_S)}
        process = subprocess.Popen(
            command, cwd=self.root, env=environment, text=True, start_new_session=True,
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )  # fmt: skip
        try:
            output, _ = process.communicate(timeout=seconds)
        except subprocess.TimeoutExpired:
            raise Hung(f"not ended after {seconds:.0f} s") from None
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        return process.returncode, output

    @contextmanager
    def mutated(self, mutant: Mutant) -> Iterator[None]:
        """With the mutant's change in the copy."""
        path = self.root / mutant.file
        text, times = path.read_bytes(), path.stat()
        try:
            path.write_bytes(text.replace(mutant.old.encode(), mutant.new.encode(), 1))
            _forget(path)
            yield
        finally:
            path.write_bytes(text)
            os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
            _forget(path)


def _forget(path: Path) -> None:
    """Drop the compiled form: it is told from the source's only by size and by time in seconds."""
    for compiled in (path.parent / "__pycache__").glob(f"{path.stem}.*.pyc"):
        compiled.unlink()


def made(root: Path) -> Workspace:
    """A workspace in a folder that does not exist yet."""
    shutil.copytree(ROOT, root, ignore=shutil.ignore_patterns(*NOT_COPIED), symlinks=True)
    # A development install of the copy, as packaging lays it.
    package = root / "build" / "dev" / "gnss_hil"
    package.mkdir(parents=True)
    for name in PACKAGES:
        (package / name).symlink_to(root / name)
    (package / "__init__.py").symlink_to(root / "tools" / "packaging" / "package.py")
    environment = root / ".venv"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", environment], check=True)
    python = environment / "bin" / "python"
    query = [python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"]
    site = Path(subprocess.run(query, check=True, capture_output=True, text=True).stdout.strip())
    libraries = [entry for entry in sys.path if entry.endswith(("site-packages", "dist-packages"))]
    (site / "mutants.pth").write_text("\n".join([str(root / "build" / "dev"), *libraries]) + "\n")
    _programs(Path(sys.executable).parent, environment / "bin", python)
    return Workspace(root, python)


def _programs(there: Path, here: Path, python: Path) -> None:
    """Programs of the environment, such as `gnss-hil`, run by the copy's interpreter."""
    for program in there.iterdir():
        if (here / program.name).exists() or not program.is_file():
            continue
        with suppress(UnicodeDecodeError):
            first, _, rest = program.read_text("utf-8").partition("\n")
            if first.startswith("#!") and "python" in first:
                (here / program.name).write_text(f"#!{python}\n{rest}")
                (here / program.name).chmod(0o755)
