"""A run while it happens: processes, buses, the recorder."""
