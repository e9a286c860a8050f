"""A receiver's channels: what commands do to them, and what they do by themselves."""

SATELLITES = 24  # PRN 1 to 24 are the rows 0 to 23 of sky.py
IDLE, TRACK, AUTONOMOUS = -1, 1, 2


class Channels:
    """The satellite of each channel (row of sky.py, or IDLE), and whether a command chose it."""

    def __init__(self, count):
        self.sat, self.commanded = [IDLE] * count, [False] * count

    def obey(self, channel, action, sat_system, sat_number, signal, **_):
        """The AckResult of a command; where it is 0 the channel does what the command says."""
        sat, track = sat_number - 1, action == TRACK
        others = [s for k, s in enumerate(self.sat) if self.commanded[k] and k != channel]
        refused = {
            1: channel >= len(self.sat),
            2: track and (sat_system != 0 or sat not in range(SATELLITES)),
            7: track and signal != 0,
            6: track and sat in others,
            8: action > AUTONOMOUS,
        }
        result = next((number for number, applies in refused.items() if applies), 0)
        if result == 0:
            self.sat = [IDLE if track and s == sat else s for s in self.sat]
            self.sat[channel], self.commanded[channel] = (sat if track else IDLE), action != AUTONOMOUS
        return result

    def search(self, above_rad):
        """Channels without a command take what stands highest; (channel, satellite) of those that measure.

        above_rad  (24,) angle of each satellite inside the antenna's mask
        """
        spare = (int(s) for s in (-above_rad).argsort() if above_rad[s] > 0 and s not in self.sat)
        for k, s in enumerate(self.sat):
            if not self.commanded[k] and (s == IDLE or above_rad[s] <= 0):
                self.sat[k] = next(spare, IDLE)
        return [(k, s) for k, s in enumerate(self.sat) if s != IDLE and above_rad[s] > 0]
