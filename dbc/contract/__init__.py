"""What is said on the bus: messages, the DBC made from them, codec, frames and their protection."""
