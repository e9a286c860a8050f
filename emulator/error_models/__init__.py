"""Everything that is not ideal, by name: one registry."""
