"""The paper's experiments: which missions they are, and what is measured of them."""
