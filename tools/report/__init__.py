"""report.html: what a run showed, drawn; one file that needs nothing else."""
