"""The bench as a Python program has it: `gnss_hil.run`, `gnss_hil.Run`, and the pytest fixture `bench`."""
