"""What a run left behind, made into tables, figures and verdicts."""
