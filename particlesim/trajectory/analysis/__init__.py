"""What the frames of a run amount to: observables, tables and figures of them."""
