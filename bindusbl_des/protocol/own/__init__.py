"""Parts of the protocol that somebody else has written, gone through step by step and checked."""
