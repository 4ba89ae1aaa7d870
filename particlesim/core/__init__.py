"""What every floor stands on: vectors, the compiler's one decorator, threads, files that appear whole."""
