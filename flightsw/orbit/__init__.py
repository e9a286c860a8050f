"""Motion: of the craft between fixes, of satellites that no channel tracks."""
