"""The figures and tables of an evaluation run, after those of paper 000: table in, Figure out."""
