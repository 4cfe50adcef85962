"""`python -m ltlplan`: the command line, where its script is not on the path."""

from ltlplan.start import main

if __name__ == "__main__":
    main()
