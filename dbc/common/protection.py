"""Windows and limits of the state machine that AUTOSAR keeps for each protected stream.

Names are AUTOSAR's (PRS E2E Protocol, E2E state machine: WindowSize, MinOkStateInit, ...), as are the
constraints (TPS System Template, constr_3176 to constr_3181). `gnss_hil.dbc.contract.e2e_state` is the
machine.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, ValidationInfo, field_validator

from gnss_hil.dbc.common.strict import Strict

LONGEST_WINDOW = 64
"""Epochs that are kept of a stream: bits of a word. AUTOSAR's own type ends at 255."""

_Checked = Field(validate_default=True)
MinOk = Annotated[int, Field(ge=1, le=LONGEST_WINDOW), _Checked]
MaxError = Annotated[int, Field(ge=0, le=LONGEST_WINDOW - 1), _Checked]

_OK_ORDER = "constr_3178: 1 <= min_ok_state_valid <= min_ok_state_init <= min_ok_state_invalid"
_ERROR_ORDER = "constr_3177: max_error_state_valid >= max_error_state_init >= max_error_state_invalid >= 0"
_SUM = {"init": "constr_3179", "valid": "constr_3180", "invalid": "constr_3181"}
_BEFORE = {"init": "valid", "invalid": "init"}


class Protection(Strict):
    """When flight software uses the frames of a protected stream: AUTOSAR's E2E state machine. As it is given
    here, it uses all frames that pass their own checks.

    window_size              epochs over which a stream is judged
    min_ok_state_valid       good epochs in the window that keep a stream valid
    min_ok_state_init        good epochs that make a new stream valid
    min_ok_state_invalid     good epochs that make an invalid stream valid again
    max_error_state_valid    corrupted epochs in the window that a valid stream may have
    max_error_state_init     corrupted epochs that a new stream may have
    max_error_state_invalid  corrupted epochs with which an invalid stream may become valid
    use_state_init           frames of a new stream are used before it is valid; AUTOSAR uses none
    """

    window_size: Annotated[int, Field(ge=1, le=LONGEST_WINDOW)] = 10
    min_ok_state_valid: MinOk = 1
    min_ok_state_init: MinOk = 1
    min_ok_state_invalid: MinOk = 1
    max_error_state_valid: MaxError = 9
    max_error_state_init: MaxError = 9
    max_error_state_invalid: MaxError = 9
    use_state_init: bool = True

    @field_validator("min_ok_state_init", "min_ok_state_invalid")
    @classmethod
    def _no_fewer_good_ones(cls, value: int, info: ValidationInfo) -> int:
        """Constraint 3178."""
        other = f"min_ok_state_{_BEFORE[_state(info)]}"
        if value < info.data.get(other, value):
            raise ValueError(f"below {other} = {info.data[other]} ({_OK_ORDER})")
        return value

    @field_validator("max_error_state_init", "max_error_state_invalid")
    @classmethod
    def _no_more_errors(cls, value: int, info: ValidationInfo) -> int:
        """Constraint 3177."""
        other = f"max_error_state_{_BEFORE[_state(info)]}"
        if value > info.data.get(other, value):
            raise ValueError(f"above {other} = {info.data[other]} ({_ERROR_ORDER})")
        return value

    @field_validator("max_error_state_valid", "max_error_state_init", "max_error_state_invalid")
    @classmethod
    def _both_fit_the_window(cls, value: int, info: ValidationInfo) -> int:
        """Constraints 3179 to 3181."""
        state, data = _state(info), info.data
        least = f"min_ok_state_{state}"
        if {least, "window_size"} <= data.keys() and value + data[least] > data["window_size"]:
            raise ValueError(
                f"with {least} = {data[least]} more than window_size = {data['window_size']} "
                f"({_SUM[state]}: {least} + {info.field_name} <= window_size)"
            )
        return value


def _state(info: ValidationInfo) -> str:
    """The state that a field speaks of."""
    return str(info.field_name).rsplit("_", 1)[1]
