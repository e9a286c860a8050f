"""The interface control document: the contract of a bus as one page that explains and draws itself."""
