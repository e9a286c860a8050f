"""What contract, bus and both sides build on: time, satellites and signals, the vehicle file, registries."""
