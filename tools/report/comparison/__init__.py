"""Two runs compared: `gnss-hil report RUN RUN2`."""
