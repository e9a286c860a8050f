"""What the process shells share: arguments, faults as lines, a polite end."""
