"""What is simulated: bodies, the domain they move in, and how they move when nothing touches them."""
