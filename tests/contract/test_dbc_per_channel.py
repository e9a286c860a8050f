"""The DBC in which channels are apart: other programs read in a frame what the plain one says."""

from __future__ import annotations

import logging

import pytest
from cantools.database import load_string

from gnss_hil.dbc.common.limits import CHANNELS
from gnss_hil.dbc.contract.codec import codec
from gnss_hil.dbc.contract.generate import dbc_text
from gnss_hil.dbc.contract.messages import messages
from gnss_hil.tools.command_line.main import main
from tests.support.live_runs import epochs
from tests.support.outside import peer

pytestmark = pytest.mark.verifies(
    "dbc/contract/generate.py",
    what="DBC with signals for each channel",
    by="cantools (strict), canmatrix and asammdf, on the frames of a run",
    status="validated",
)

OF_CHANNELS = {
    "COMMAND", "ACK", "RANGE", "RATE", "PHASE", "SV_X", "SV_Y", "SV_Z", "SV_VX", "SV_VY", "SV_VZ", "SV_CLOCK",
}  # fmt: skip


@pytest.fixture(scope="module")
def text() -> str:
    return dbc_text(4, per_channel=True)


@pytest.fixture(scope="module")
def frames() -> list[tuple[int, bytes]]:
    """A minute and more of a Soyuz: identifier and data."""
    return [
        (int(can_id), data.tobytes())
        for block in epochs()[0]
        for can_id, data in zip(block.can_id, block.data, strict=True)
    ]


def apart(values: dict, kind_of_channel: bool) -> dict:
    """Values of the plain file under the names that they have per channel."""
    if not kind_of_channel:
        return values
    names = list(values)
    after = names.index("channel") + 1
    suffix = f"_ch{int(values['channel']):02d}"
    return {name if k < after else f"{name}{suffix}": values[name] for k, name in enumerate(names)}


def test_cantools_decodes_a_run_alike(text, frames):
    plain, variant = load_string(dbc_text(4), "dbc"), load_string(text, "dbc", strict=True)
    assert {m.frame_id for m in variant.messages} == {m.frame_id for m in plain.messages}
    assert {m.name.partition("_")[2] for m in variant.messages if m.is_multiplexed()} == OF_CHANNELS
    of_channel = {m.can_id: m.kind.name in OF_CHANNELS for m in messages(4)}
    seen = set()
    for can_id, data in frames:
        expected = apart(plain.decode_message(can_id, data, decode_choices=False), of_channel[can_id])
        assert variant.decode_message(can_id, data, decode_choices=False) == expected
        seen |= {name for name in expected if name.endswith("_ch05")}
    assert {"pseudorange_m_ch05", "range_rate_mps_ch05", "transaction_ch05"} <= seen


def test_every_channel_that_a_frame_can_name_has_its_signals(text):
    variant = load_string(text, "dbc", strict=True)
    for message in variant.messages:
        if message.is_multiplexed():
            assert [(s.name, s.is_multiplexer) for s in message.signals if not s.multiplexer_ids][3:] == [
                ("channel", True)
            ]
            assert {k for s in message.signals for k in s.multiplexer_ids or ()} == set(range(CHANNELS))
        assert all(len(s.name) <= 32 and s.comment for s in message.signals)


def test_canmatrix_decodes_a_run_alike(text, frames, caplog):
    formats = peer("canmatrix.formats")
    with caplog.at_level(logging.DEBUG, "canmatrix"):
        (matrix,) = formats.loads(text.encode(), "dbc").values()
    assert [r for r in caplog.records if r.levelno >= logging.WARNING] == []
    assert matrix.load_errors == []
    variant = load_string(text, "dbc")
    by_id = {frame.arbitration_id.id: frame for frame in matrix.frames}
    for can_id, data in frames[-300:]:
        read = {name: value.raw_value for name, value in by_id[can_id].decode(data).items()}
        assert read == variant.decode_message(can_id, data, decode_choices=False, scaling=False)


def test_asammdf_plots_channels_apart(text, tmp_path):
    asammdf = peer("asammdf")
    (tmp_path / "per.dbc").write_text(text, "ascii")
    folder = tmp_path / "run"
    assert main(["run", "soyuz", "--bus", "inline", "--duration", "50", "--out", str(folder), "--quiet"]) == 0
    assert main(["convert", str(folder), str(tmp_path / "run.mf4")]) == 0
    with asammdf.MDF(tmp_path / "run.mf4") as log:
        read = log.extract_bus_logging(database_files={"CAN": [(str(tmp_path / "per.dbc"), 0)]})
    names = [channel.name for group in read.groups for channel in group.channels]
    ranges = {name for name in names if name.startswith("pseudorange_m")}
    assert {f"pseudorange_m_ch{k:02d}" for k in range(6)} == ranges


def test_the_contract_is_the_plain_file_and_the_variant_says_so(text, capsys):
    assert main(["icd", "dbc", "--per-channel", "--receivers", "4"]) == 0
    assert capsys.readouterr().out == text
    assert main(["icd", "hash"]) == 0
    assert capsys.readouterr().out == f"{codec(4).hash:08x}\n"
    assert codec(4).text == dbc_text(4) != text
    assert "and its hash, are those of the file without --per-channel" in text.partition("CM_ BO_")[0]
    assert main(["icd", "hash", "--per-channel"]) == 2
    assert capsys.readouterr().err == "gnss-hil: icd hash: --per-channel is for dbc\n"
