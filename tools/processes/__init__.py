"""A run while it happens: processes, buses, supervision."""
