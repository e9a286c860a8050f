"""Ways onto a bus: inside one process, our embedded hub, SocketCAN, and whatever python-can knows."""
