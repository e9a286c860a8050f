"""The flight software: reads the bus, decides which antenna tracks which satellite, publishes fixes.

Reproduces blocks 3 and 5 to 9 of RU 2706636 C1, claim 2 (blocks 1, 2 and 4 are on the other side of the bus):

    intake      arrows 2->3, 2->7, 4->5   frames of an epoch into measurements, attitude, almanac
    position    block 3                   position and velocity from all signals of all antennas
    attitude    input from block 4        body axes in the Greenwich frame
    boresight   blocks 5, 6               boresight directions in the Greenwich frame
    angles      block 7                   angles between satellites and boresights
    assign      blocks 8, 9               masks and tracking permission
    commander   arrow 9->1                permissions as channel commands, repeated until acknowledged
    almanac     (patent silent)           where satellites are that nobody tracks
    coast       (patent silent)           position between fixes
"""
