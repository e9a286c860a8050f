"""Where a craft is: forces and their integration, or a trajectory from a file."""
