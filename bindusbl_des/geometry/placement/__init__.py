"""Where few vessels serve many places best: covering them, and seeing them from good angles."""
