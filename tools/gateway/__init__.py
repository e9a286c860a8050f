"""Between two buses: faults on what passes from the emulator to the flight software and back."""
