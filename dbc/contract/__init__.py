"""The bus contract: messages, the DBC made from them, codec, frames and their protection."""
