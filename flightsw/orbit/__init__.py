"""Motion: of the craft between fixes, of satellites that nobody tracks."""
