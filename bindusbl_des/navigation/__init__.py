"""What an AUV believes of its position: dead reckoning, and navigators that weigh fixes."""
