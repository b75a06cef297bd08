"""What every room uses: compiled equations, clocks, random streams, durable files, words."""
