"""What a run leaves behind: the recorder, the run folder, file formats."""
