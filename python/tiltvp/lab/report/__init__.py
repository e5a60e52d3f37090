"""The report of an evaluation run: which images serve as examples, what is on the page, and the files of it."""
