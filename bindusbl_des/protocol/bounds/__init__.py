"""What no protocol can do better: limits of the medium and of the conflict graph, as equations."""
