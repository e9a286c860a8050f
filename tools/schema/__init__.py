"""The files a user writes, described for editors (JSON Schema) and for people (docs/scenario.md)."""
