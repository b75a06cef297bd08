"""Random access: AUVs ping when they like, and find out whether anybody heard them."""
