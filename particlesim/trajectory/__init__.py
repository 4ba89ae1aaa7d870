"""What was simulated, frame by frame, and the file it is kept in."""
