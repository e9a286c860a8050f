"""The command line: one table of commands, and the arguments they share."""
