"""Files that ship: scenarios, structures, antenna patterns, the gravity field."""
