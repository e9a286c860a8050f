"""The person at the bench: commands, runs, recordings, reports, studies, exports."""
