"""A signal on its way from the satellite to the receiver: path, power, what is in the way."""
