"""The navigation satellites: where they are, what they report, how they transmit."""
