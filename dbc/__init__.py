"""The bus contract and the ways onto a bus: all that truth and flight share."""
