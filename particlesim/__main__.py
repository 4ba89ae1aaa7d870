"""``python -m particlesim``."""

from particlesim.cli import main

if __name__ == "__main__":
    main()
