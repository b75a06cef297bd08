"""What the keys of the protocol must agree on."""
