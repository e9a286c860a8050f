"""What another's program says is kept and passed on."""

from __future__ import annotations

import sys

import pytest

from gnss_hil.tools.processes.children import start
from tests.support.waiting import until

pytestmark = pytest.mark.verifies(
    "tools/processes/tee.py",
    what="Output of other programs",
    by="every byte that a program writes, in the file and on stderr",
    status="validated",
)

TALKS = "import sys; print('out'); sys.stdout.flush(); sys.stderr.write('err' * {times}); sys.stderr.flush()"


@pytest.mark.parametrize("times", [1, 100_000], ids=["a-word", "more-than-a-pipe-holds"])
def test_all_that_a_program_says_is_kept_and_passed_on(tmp_path, capfd, times):
    log = tmp_path / "flight.log"
    child = start("flight", [sys.executable, "-c", TALKS.format(times=times)], None, log=log)
    until(lambda: not child.running)
    child.leave()
    said = "out\n" + "err" * times
    assert log.read_text() == said
    assert capfd.readouterr().err == said


def test_a_file_that_cannot_be_written_costs_the_record_and_not_the_program(tmp_path, capfd):
    log = tmp_path / "full"
    log.symlink_to("/dev/full")
    child = start("flight", [sys.executable, "-c", TALKS.format(times=200_000)], None, log=log)
    until(lambda: not child.running)
    child.leave()
    assert child.process.returncode == 0
    assert capfd.readouterr().err.endswith("err")
