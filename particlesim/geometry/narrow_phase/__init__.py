"""The exact tests of two shapes, a pair of kinds a file."""
