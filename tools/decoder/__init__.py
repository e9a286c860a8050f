"""What frames say: the one place where the tools read a bus or a recording."""
