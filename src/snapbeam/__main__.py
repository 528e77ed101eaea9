"""``python -m snapbeam``: the program."""

from snapbeam.cli import main

if __name__ == "__main__":
    main()
