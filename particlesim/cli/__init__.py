"""The commands: their options, what they need to run, and how they speak. Nothing heavy is imported at the top."""
