"""Options of a run that contradict each other."""

from __future__ import annotations

from gnss_hil.tools.common.errors import Mistake
from gnss_hil.tools.run_config import sides
from gnss_hil.tools.run_config.config import OURS, RunConfig


def check_combination(config: RunConfig) -> None:
    """Mistake if one option of a run leaves another no place."""
    changes = config.overrides
    if config.seeds and (changes.seed is not None or "seed" in {k.strip('"') for k, _ in changes.sets}):
        raise Mistake("--seeds with a seed: one of the two")
    if config.bus == "inline" and config.wait_s is not None:
        raise Mistake("--wait with --bus inline: both sides are one process, nobody is awaited")
    if config.bus == "inline" and config.pace != "lockstep":
        raise Mistake(
            f"--pace {config.pace} with --bus inline: inline goes in lockstep, as fast as it can; "
            "use --bus embedded"
        )
    if (config.flight, config.emulator) != (OURS, OURS):
        own = {"policy": changes.policy, "navigator": changes.navigator, "option": changes.options}
        sides.check(config.flight, config.emulator, config.bus, own)
