"""A flight software as others would write one for `gnss-hil replay --flight`."""

from __future__ import annotations

import os
import sys

from gnss_hil.flightsw.__main__ import main

if __name__ == "__main__":
    bus, vehicle = os.environ["GNSS_HIL_BUS"], os.environ["GNSS_HIL_VEHICLE"]
    assert os.environ["GNSS_HIL_CRAFT"] == "soyuz"
    sys.exit(main(["--vehicle", vehicle, "--bus", bus, "--once", "--quiet"]))
