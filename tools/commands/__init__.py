"""The commands of `gnss-hil`, a module each: `add_arguments(parser)`, `run(arguments) -> exit status`."""
