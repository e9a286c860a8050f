"""From a scenario to a world that can be stepped."""

from gnss_hil.emulator.assemble.world import build_world, initial_state

__all__ = ["build_world", "initial_state"]
