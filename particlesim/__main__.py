"""``python -m particlesim``."""

from particlesim.cli.main import main

if __name__ == "__main__":
    main()
