"""What a craft measures beside signals: nodes of the bus of their own, one file a row."""
