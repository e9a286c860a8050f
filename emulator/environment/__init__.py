"""What no command changes: geometry, link, visibility and signals of a craft, in blocks of epochs."""
