"""gnss-hil: a hardware-in-the-loop bench for spacecraft satellite navigation on CAN.

    gnss_hil.dbc        the bus contract, and ways onto a bus
    gnss_hil.emulator   truth: sky, craft, receivers
    gnss_hil.flightsw   flight software
    gnss_hil.tools      the person at the bench

The four are the folders of the same names in a checkout. This file is the package's `__init__.py`.
"""
