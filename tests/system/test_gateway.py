"""`gnss-hil inject`: a run through the gateway, our flight software and the one in C on its other side."""

from __future__ import annotations

import json
import re
import signal
import subprocess
from pathlib import Path

import numpy as np
import polars
import pytest

from gnss_hil.dbc.common.vehicle import find
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.frames import FrameBatch
from gnss_hil.dbc.lockstep.messages import is_bench
from gnss_hil.emulator.faults.kinds.row import GATEWAY
from gnss_hil.tools.command_line.main import main
from gnss_hil.tools.decoder.digest import Digest
from gnss_hil.tools.results import truth
from tests.support import every_kind
from tests.support.fsw_c import build
from tests.support.gateways import OURS, on_record, spoken, through
from tests.support.programs import GNSS_HIL, PROGRAM, ROOT
from tests.support.waiting import HANG_S, ended

pytestmark = [
    pytest.mark.slow,
    pytest.mark.verifies(
        "tools/gateway/session.py",
        "tools/gateway/crossing.py",
        "tools/gateway/loop.py",
        what="A gateway between two buses, in lockstep",
        by="records of runs without it and of runs whose emulator applies the same faults, byte by byte",
        status="validated",
    ),
]

VEHICLE = find("soyuz-ms")
EVERYWHERE = (
    "rx1 RANGE repetition 2 @100+8",
    "rx3 delay 1 @90+10",
    "command-late 2 @30+20",
    "0x100&0x7F0 loss @1m p=0.1",
    "mark-jump 1s @110+5",
    "stray-bench SYNC @50+5",
    "ATT restart @70+6",
)
"""More frames and fewer, both ways, held back, and bench frames of nobody."""


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """A run without a gateway."""
    return inline(tmp_path_factory.mktemp("plain"))


def inline(folder, *faults: str):
    words = [word for fault in faults for word in ("--fault", fault)]
    out = ["--out", str(folder / "inline"), "--quiet", "--no-report"]
    assert main(["run", "soyuz", "--bus", "inline", "--duration", "130", *out, *words]) == 0
    return folder / "inline"


def test_without_faults_no_byte_changes(tmp_path, plain):
    heard, said = through(tmp_path, (), OURS)
    assert spoken(heard) == on_record(plain) == on_record(tmp_path / "run")
    assert "no faults" in said and "the run ended after 130 epochs" in said


def test_faults_that_never_act_change_no_byte(tmp_path, plain):
    heard, _ = through(tmp_path, ("rx2 off @1h", "all loss @1h"), OURS)
    assert spoken(heard) == on_record(plain) == on_record(tmp_path / "run")


def test_the_flight_software_hears_what_it_hears_of_an_emulator_with_these_faults(tmp_path):
    heard, said = through(tmp_path, EVERYWHERE, OURS)
    alone = inline(tmp_path, *EVERYWHERE)
    assert spoken(heard) == on_record(alone)
    assert (tmp_path / "gateway" / "faults").read_bytes() == (alone / "faults").read_bytes()
    table = polars.read_parquet(tmp_path / "gateway" / "faults.parquet")
    assert table.equals(polars.read_parquet(alone / "faults.parquet")[table.columns])
    assert "epoch 100: repetition 1 (rx1 RANGE) acts" in said
    summary = json.loads((tmp_path / "run" / "summary.json").read_text("utf-8"))
    assert (summary["epochs_unanswered"], summary["frames"]["lost"]) == (0, 0), (
        "counts of SYNC and DONE follow"
    )


@pytest.fixture(scope="module")
def fsw(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fsw_c")
    build(folder)
    return folder / "fsw"


EACH_S, SETTLED_S = 20, 12
"""Turn of each fault; so long after its begin the receivers have what it took from them again."""


ASTRAY = {"mark-jump": 7359.0, "mark-leap": 7358.0, "mark-rollover": np.inf}
"""What it believes, as it has no check against it: marks of another time. By how many metres its fixes are
off then; of a week 1,024 weeks ago nobody knows where the craft was."""


def errors_m(heard: FrameBatch, run: Path) -> np.ndarray:
    """(n,) by how much the fix of each epoch of a run errs, at the time that its mark showed the flight
    software on its own bus: nan without one, inf where truth does not reach."""
    known = truth.read(run / "truth").of("soyuz")
    digest = Digest(codec(4))
    digest.feed(heard[~is_bench(heard.can_id)])
    digest.finish()
    fixes = digest.fixes
    there = truth.at(fixes["t_ns"], known)
    off_m = np.column_stack([fixes[f"{axis}_m"] for axis in "xyz"]) - there["position_ecef_m"]
    off_m = np.where(there["t_gps_ns"] == fixes["t_ns"], np.linalg.norm(off_m, axis=1), np.inf)
    found = np.full(len(known), np.nan)
    valid = fixes["valid"] & (fixes["epoch"] < len(known))
    np.fmax.at(found, fixes["epoch"][valid], off_m[valid])
    return found


def test_the_flight_software_in_c_flies_through_every_kind(tmp_path, fsw):
    """All of the library that a gateway can do, in turn. It answers every epoch, by frames that are all in
    order; it refuses what would lead it astray, or has no fix; and when a fault is over it is as before.
    Marks of another time it believes: it is an example, and its fixes are as far off as the craft goes
    meanwhile."""
    turns = every_kind.turns(every_kind.FIRST_S + EACH_S * len(every_kind.able(GATEWAY)), GATEWAY, EACH_S)
    (tmp_path / "faults.toml").write_text(every_kind.faults(turns), "utf-8")
    command = (str(fsw), "--bus", "embedded:BUS", "--vehicle", str(VEHICLE))
    heard, _ = through(tmp_path, (str(tmp_path / "faults.toml"),), command, int(turns[-1][0]) + EACH_S)
    run = tmp_path / "run"
    summary = json.loads((run / "summary.json").read_text("utf-8"))
    assert (summary["epochs_unanswered"], summary["frames"]["rejected"]) == (0, {})
    error_m = errors_m(heard, run)
    without = []
    for begin_s, name in turns:
        struck = error_m[int(begin_s) : int(begin_s + every_kind.LASTS_S)]
        behind = error_m[int(begin_s) + SETTLED_S : int(begin_s) + EACH_S]
        assert (behind < 5).all(), name
        worst_m = np.fmax.reduce(struck, initial=0.0)
        assert worst_m == pytest.approx(ASTRAY[name], rel=1e-3) if name in ASTRAY else worst_m < 5, name
        without += [name] if np.isnan(struck).all() else []
    print("no fix at all under", *without)
    acted = polars.read_parquet(tmp_path / "gateway" / "faults.parquet").group_by("kind")
    idle = set(acted.agg(polars.sum("frames_touched")).filter(frames_touched=0)["kind"])
    assert idle <= {"ack-lost", "command-altered", "command-doubled", "command-late", "command-lost"}, (
        "only commands are not sent in every turn"
    )


def test_the_commands_of_the_documentation_run_as_they_stand(tmp_path, fsw):
    """Pasted at once: who is there first is chance. Only places and length are the test's."""
    page = (ROOT / "docs" / "faults.md").read_text("utf-8")
    block = re.search(r"\n((?:    [^\n]*\n)+)", page.partition("\n## Between two buses\n")[2])[1]
    assert "\n    gnss-hil hub /tmp/inner &\n" in block and block.count("\n") == 5
    for theirs, ours in (
        ("/tmp/", f"{tmp_path}/"), ("make -C examples/fsw_c", ":"), ("examples/fsw_c/build/fsw", str(fsw)),
        ("runs/gateway", str(tmp_path / "gateway")), ("gnss-hil", str(PROGRAM)),
        ("--flight external", f"--flight external --duration 20 --quiet --out {tmp_path / 'run'}"),
    ):  # fmt: skip
        assert theirs in block
        block = block.replace(theirs, ours)
    script = f"trap 'kill $(jobs -p) 2>/dev/null' EXIT\n{block}\nstatus=$?\nkill %1\nwait\nexit $status"
    done = subprocess.run(
        ["bash", "-c", script], cwd=ROOT, capture_output=True, text=True, timeout=HANG_S, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "the run ended after 20 epochs" in done.stdout
    summary = json.loads((tmp_path / "run" / "summary.json").read_text("utf-8"))
    assert (summary["epochs"], summary["epochs_unanswered"]) == (20, 0)


def test_a_bus_that_goes_away_is_named(tmp_path):
    hubs = [
        subprocess.Popen([*GNSS_HIL, "hub", str(tmp_path / name)], stdout=subprocess.PIPE, text=True)
        for name in "ab"
    ]
    for hub in hubs:
        hub.stdout.readline()
    buses = ["--from", f"embedded:{tmp_path / 'a'}", "--to", f"embedded:{tmp_path / 'b'}"]
    gateway = subprocess.Popen(
        [*GNSS_HIL, "inject", *buses], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert "no faults" in gateway.stdout.readline()
    hubs[1].send_signal(signal.SIGINT)
    ended(hubs[1])
    _, err = ended(gateway)
    assert (gateway.returncode, err) == (
        1,
        f"gnss-hil: bus 'embedded:{tmp_path / 'b'}' went away after 0 epochs\n",
    )
    gateway = subprocess.Popen(
        [*GNSS_HIL, "inject", *buses], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert "waiting for a bench" in gateway.stdout.readline()
    gateway.send_signal(signal.SIGINT)
    ended(gateway)
    assert gateway.returncode == 130
    hubs[0].send_signal(signal.SIGINT)
    ended(hubs[0])
