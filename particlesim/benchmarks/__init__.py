"""How fast it is here: time steps, pictures, broad phases side by side, and others beside them."""
