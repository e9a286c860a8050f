"""Vector's BLF: objects, most of them in compressed containers.

There is no public specification. Source: Vector, `binlog_objects.h` of CANoe's binlog API; the programs that
read what it writes: T. Lorenz, Vector_BLF; python-can, can/io/blf.py; Wireshark, wiretap/blf.h.
"""
