"""How a craft is turned: by rule, or from a table."""
