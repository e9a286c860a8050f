"""What a run will be: scenario, command line and files made into one plan."""
