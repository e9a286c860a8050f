"""How the measurements of several antennas become one fix, by policy.

    together   all ranges reduced to the centre of mass, one solution (the patent, its prototype)
    averaged   a solution for each receiver, their mean (the patent's analogue)
    single     the antenna that measures most satellites, alone

All three solve with `flightsw.position.solve`. The last two know no lever arms, so what they publish is the
place of antennas, not of the centre of mass, and they need no attitude.
"""
