"""The navigation satellites: where they are, what they report, who transmits how."""
