"""Virtual CAN: on a kernel that has it, or inside a Linux kernel that runs as an ordinary program."""
