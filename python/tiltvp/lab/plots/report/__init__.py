"""The figures and tables of an evaluation run, after those of Fleer 2017: table in, Figure out."""
