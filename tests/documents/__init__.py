"""The documents that are generated from code and tests."""
