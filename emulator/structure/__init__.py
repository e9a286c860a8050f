"""The spacecraft's structure: boxes and panels in body axes, some of which turn."""
