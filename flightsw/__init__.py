"""The flight software: reads the bus, decides which antenna tracks which satellite, publishes fixes.

Reproduces blocks 3 and 5 to 9 of RU 2706636 C1, claim 2 (blocks 1, 2 and 4 are on the other side of the bus):

    app           one epoch: stages, modes, configuration, state
    io            arrows 2->3, 2->7, 4->5   frames into records and back; nodes and rejected frames
    attitude      input from block 4        body axes in the Greenwich frame
    measurement   channels as ranges: signals, noise, what a receiver at a place would measure
    estimation    block 3                   navigators: position, velocity and clocks from the measurements
    integrity     faulty satellites isolated and excluded; what a solution is worth
    assignment    blocks 5 to 9             boresights, angles, masks, tracking permission: the policies
    receivers     arrow 9->1                permissions as channel commands, repeated until acknowledged
    orbit         (patent silent)           motion of the craft between fixes, and of all satellites
    records       what the stages hand to each other

Imports go down: app, assignment, estimation, integrity and receivers, measurement, attitude and io, orbit,
records. Policy and navigator are chosen apart: rows of `assignment.registry` and `estimation.registry`.
"""
