"""`python -m framerunner`."""

from framerunner.cli import main

if __name__ == "__main__":
    main()
