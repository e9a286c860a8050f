"""Truth: a sky, craft with receivers and sensors, and the frames these put on the bus."""
