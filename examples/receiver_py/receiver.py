"""One GPS receiver and its craft on the bench's bus: an emulator of somebody else's.

bench.py speaks on the bus, channels.py obeys commands, sky.py says what there is to measure. Environment:
GNSS_HIL_BUS; GNSS_HIL_VEHICLE, _PACE (lockstep, realtime, xN), _DURATION (s). Argument: file for the truth.
"""

import os
import sys
import time
import tomllib
from pathlib import Path

import sky
from bench import Bench
from can import CanError
from channels import TRACK, Channels

START_S, WEEK_S = 2400 * 604_800, 604_800  # GPS time of epoch 0; epochs are 1 s apart
SINGLE = Path(__file__).with_name("single.toml")


def measure(bench, channels, antenna, t_s):
    """The receiver's frames: ten for each channel that measures, tag, status, almanac."""

    def send(kind, **signals):
        bench.send(f"RX1_{kind}", **signals)

    range_m, rate_mps, phase_cyc, above_rad, r, v = sky.observe(t_s, antenna)
    tracked = channels.search(above_rad)
    for k, s in tracked:
        send("RANGE", channel=k, pseudorange_m=range_m[s])
        send("RATE", channel=k, signal=0, range_rate_mps=rate_mps[s], cn0_dbhz=45.0, lock=5)
        send("PHASE", channel=k, phase_cyc=phase_cyc[s], slips=0, half_cycle=0)
        send("SV_X", channel=k, x_m=r[s, 0])
        send("SV_Y", channel=k, y_m=r[s, 1])
        send("SV_Z", channel=k, z_m=r[s, 2], health=0)
        send("SV_VX", channel=k, vx_mps=v[s, 0], clock_drift_mps=0.0)
        send("SV_VY", channel=k, vy_mps=v[s, 1], iod=0)
        send("SV_VZ", channel=k, vz_mps=v[s, 2], frequency=0, ura=0)
        send("SV_CLOCK", channel=k, sat_system=0, sat_number=s + 1, clock_m=sky.SV_CLOCK_M[s])
    send("TAG", tag_offset_ns=round(sky.clock_m(t_s) / sky.C * 1e7) * 100, clock_domain=0)
    state = "COMMANDED" if any(channels.commanded) else "AUTONOMOUS"
    n = len(tracked)
    send("STATUS", frames=10 * n + 1, channels_tracking=n, state=state, almanac_satellites=len(sky.N))
    r, v = sky.orbit(t_s, *sky.SATELLITES)
    for s in (2 * bench.epoch % 24, 2 * bench.epoch % 24 + 1):
        sat = {"sat_system": 0, "sat_number": s + 1}
        send("ALM_XY", **sat, x_m=r[s, 0], y_m=r[s, 1])
        send("ALM_Z", **sat, z_m=r[s, 2], health=0, age_h=0)
        send("ALM_V", **sat, vx_mps=v[s, 0], vy_mps=v[s, 1], vz_mps=v[s, 2])


def play(bench, channels, antenna, epoch):
    """The emulator's block of an epoch; returns the truth, position and velocity of the centre of mass."""
    t_s, (week, second), commands = float(epoch), divmod(START_S + epoch, WEEK_S), bench.open(epoch)
    bench.send("TIME_MARK", session=bench.session, epoch=epoch)
    bench.send("TIME_GPS", week=week, second=second)
    bench.send("TIME_FINE", nanosecond=0, leap=18, mark_clock=0)
    for c in sorted(commands, key=lambda c: c["action"] == TRACK):  # RELEASEs act before TRACKs
        echo = {key: c[key] for key in ("channel", "sat_system", "sat_number", "transaction")}
        bench.send("RX1_ACK", result=channels.obey(**c), **echo)
    r, v, body, rates = sky.craft(t_s)
    q = sky.quaternion(body)
    bench.send("ATT_Q01", q0=q[0], q1=q[1])
    bench.send("ATT_Q23", q2=q[2], q3=q[3])
    bench.send("ATT_RATE", wx_rps=rates[0], wy_rps=rates[1], wz_rps=rates[2])
    measure(bench, channels, antenna, t_s)
    bench.heartbeats("RUNNING")
    return *r, *v


def the_antenna(path):
    """The one antenna of a vehicle file."""
    antennas = tomllib.loads(Path(path).read_text("utf-8-sig"))["antenna"]
    if len(antennas) != 1:
        sys.exit(f"receiver: {path} has {len(antennas)} antennas; this receiver has one")
    return antennas[0]


def main():
    told = {"GNSS_HIL_PACE": "lockstep", "GNSS_HIL_VEHICLE": SINGLE, "GNSS_HIL_DURATION": "600", **os.environ}
    if "GNSS_HIL_BUS" not in told:
        sys.exit("receiver: GNSS_HIL_BUS is not set; for example embedded:/tmp/bus or socketcan:vcan0")
    pace, epochs = told["GNSS_HIL_PACE"], int(float(told["GNSS_HIL_DURATION"]))
    period_s = None if pace == "lockstep" else 1 / float(pace.replace("realtime", "x1")[1:])
    antenna = the_antenna(told["GNSS_HIL_VEHICLE"])
    bench, channels = Bench(told["GNSS_HIL_BUS"]), Channels(antenna["channels"])
    with open(sys.argv[1] if sys.argv[1:] else os.devnull, "w", buffering=1) as truth:
        print("t_gps_s,x_ecef_m,y_ecef_m,z_ecef_m,vx_ecef_mps,vy_ecef_mps,vz_ecef_mps", file=truth)
        bench.assemble()
        start_s = time.monotonic()
        for epoch in range(epochs):
            row = play(bench, channels, antenna, epoch)
            print(START_S + epoch, *(f"{value:.6f}" for value in row), sep=",", file=truth)
            if period_s is None:
                bench.lockstep()
            else:
                bench.listen(start_s + (epoch + 1) * period_s - time.monotonic())
    bench.end(epochs)
    if bench.refused:
        print(f"receiver: {bench.refused} frames refused", file=sys.stderr)


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(130)
    except (OSError, CanError) as error:  # no such file or bus, the bus went away, no answer
        sys.exit(f"receiver: {error}")
