"""Where receiver.py's craft flies, as a CCSDS orbit ephemeris message (OEM): what its fixes are judged by.

python orbit.py [SECONDS] > orbit.oem
"""

import sys
from datetime import datetime, timedelta

import numpy as np
import sky
from receiver import START_S

HEAD = """\
CCSDS_OEM_VERS = 2.0
META_START
OBJECT_NAME = RECEIVER
CENTER_NAME = EARTH
REF_FRAME = ITRF2000
TIME_SYSTEM = GPS
META_STOP"""
START = datetime(1980, 1, 6) + timedelta(seconds=START_S)


def main():
    t_s = np.arange(int(sys.argv[1]) if sys.argv[1:] else 600)
    position_m, velocity_mps = sky.orbit(t_s, *sky.CRAFT)
    print(HEAD)
    for t, state in zip(t_s.tolist(), np.hstack([position_m, velocity_mps]) / 1e3, strict=True):
        print((START + timedelta(seconds=t)).isoformat(), *(f"{value:.9f}" for value in state))


if __name__ == "__main__":
    main()
