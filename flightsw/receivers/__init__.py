"""The receivers' channels as the flight software commands them."""
