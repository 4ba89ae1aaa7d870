"""What lies over the picture: readout and legends."""
