"""Vector's ASC, the text that CANoe and CANalyzer log, and other programs write in their own ways.

Source: Vector, "CAN, Log & Trigger ASC Logging Format" 1.3.5; can-utils, asc2log.c (what the format's CANFD
events really hold); files of CANoe, BUSMASTER, Kvaser's converter, log2asc, python-can.
"""
