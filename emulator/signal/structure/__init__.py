"""The spacecraft's structure: boxes and panels, some of which turn; what it hides and reflects."""
