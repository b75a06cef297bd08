"""How fast missions run on this machine, where their time goes, and what commands take."""
