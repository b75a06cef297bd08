"""How equations become machine code in few seconds."""
