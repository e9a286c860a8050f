"""What is told of a process that ended."""

from __future__ import annotations

import signal

from gnss_hil.tools.processes.children import start
from tests.support.waiting import until


def ended(tmp_path, lose_the_words: bool) -> str:
    words = tmp_path / "words"
    child = start("emulator", ["sh", "-c", "echo last words >&2; sleep 60"], words)
    until(words.read_text, child.process)
    if lose_the_words:
        words.unlink()
    child.process.send_signal(signal.SIGKILL)
    child.process.wait()
    return child.how_it_ended()


def test_who_died_is_told_with_its_last_words(tmp_path):
    assert ended(tmp_path, lose_the_words=False) == "emulator killed by SIGKILL: last words"


def test_who_died_is_told_where_a_cleaner_took_its_last_words(tmp_path):
    assert ended(tmp_path, lose_the_words=True) == "emulator killed by SIGKILL"
