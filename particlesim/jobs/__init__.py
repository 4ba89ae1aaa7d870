"""What a command does: frames from a scene or a file, and the movie made of them."""
