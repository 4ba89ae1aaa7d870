"""Runs as pages that show them: played, turned and asked for numbers in a browser."""
