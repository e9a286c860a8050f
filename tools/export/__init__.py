"""What a run measured, in files that other software reads."""
