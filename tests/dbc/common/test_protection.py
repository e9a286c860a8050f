"""Windows and limits at the door: AUTOSAR's constraints, a line for each mistake."""

from __future__ import annotations

from itertools import product

import pytest
from pydantic import ValidationError

from gnss_hil.dbc.common import vehicle
from gnss_hil.dbc.common.protection import Protection
from gnss_hil.dbc.common.vehicle import VehicleError, find, load, parse

pytestmark = pytest.mark.verifies(
    "dbc/common/protection.py",
    what="Windows and limits of protected streams",
    by="constr_3176 to constr_3181 of AUTOSAR's system template, written again",
    status="modelled",
)

TEXT = find("soyuz-ms").read_text("utf-8")


def read(table: str):
    return parse(TEXT.replace("[receivers]", f"[protection]\n{table}\n[receivers]"), "mine.toml").protection


def test_shipped_vehicles_say_nothing_and_refuse_nothing():
    for path in vehicle.shipped():
        assert load(find(path)).protection == Protection()


def test_a_table_is_read():
    assert read("window_size = 20\nmin_ok_state_invalid = 3\nuse_state_init = false") == Protection(
        window_size=20, min_ok_state_invalid=3, use_state_init=False
    )


@pytest.mark.parametrize(
    ("table", "lines"),
    [
        ("window_size = 0", ["window_size: input should be greater than or equal to 1, found 0"]),
        ("window_size = 65", ["window_size: input should be less than or equal to 64, found 65"]),
        ("min_ok_state_valid = 0", ["min_ok_state_valid: input should be greater than or equal to 1"]),
        ("max_error_state_init = -1", ["max_error_state_init: input should be greater than or equal to 0"]),
        ("window = 5", ["window: unknown key; did you mean 'window_size'?"]),
        (
            "min_ok_state_init = 2\nmax_error_state_init = 8\nmax_error_state_invalid = 8",
            ["min_ok_state_invalid: below min_ok_state_init = 2 (constr_3178: 1 <= min_ok_state_valid <= "
             "min_ok_state_init <= min_ok_state_invalid), found 1"],
        ),
        (
            "min_ok_state_valid = 2\nmax_error_state_valid = 8\nmax_error_state_init = 8\n"
            "max_error_state_invalid = 8",
            ["min_ok_state_init: below min_ok_state_valid = 2 (constr_3178"],
        ),
        (
            "max_error_state_init = 4",
            ["max_error_state_invalid: above max_error_state_init = 4 (constr_3177: max_error_state_valid >= "
             "max_error_state_init >= max_error_state_invalid >= 0), found 9"],
        ),
        (
            "max_error_state_valid = 4\nmax_error_state_invalid = 4",
            ["max_error_state_init: above max_error_state_valid = 4 (constr_3177"],
        ),
        (
            "window_size = 9",
            [f"max_error_state_{state}: with min_ok_state_{state} = 1 more than window_size = 9 ({name}: "
             f"min_ok_state_{state} + max_error_state_{state} <= window_size), found 9"
             for state, name in
             (("valid", "constr_3180"), ("init", "constr_3179"), ("invalid", "constr_3181"))],
        ),
    ],
)  # fmt: skip
def test_every_mistake_has_a_line_that_names_its_constraint(table, lines):
    with pytest.raises(VehicleError) as caught:
        read(table)
    told = str(caught.value).splitlines()
    assert len(told) == len(lines)
    for found, line in zip(told, lines, strict=True):
        assert found.startswith(f"mine.toml: protection.{line}")


KEYS = (
    "window_size",
    *(f"{of}_state_{at}" for of in ("min_ok", "max_error") for at in ("valid", "init", "invalid")),
)


def allowed(w, ok_v, ok_i, ok_x, error_v, error_i, error_x) -> bool:
    return (
        w >= 1
        and 1 <= ok_v <= ok_i <= ok_x
        and error_v >= error_i >= error_x >= 0
        and all(ok + error <= w for ok, error in ((ok_v, error_v), (ok_i, error_i), (ok_x, error_x)))
    )


def taken(values) -> bool:
    try:
        Protection(**dict(zip(KEYS, values, strict=True)))
    except ValidationError:
        return False
    return True


def test_exactly_what_the_constraints_allow_is_taken():
    """All 16,384 sets of numbers from 0 to 3."""
    every = list(product(range(4), repeat=7))
    assert [taken(values) for values in every] == [allowed(*values) for values in every]
    assert 20 < sum(map(taken, every)) < 200
