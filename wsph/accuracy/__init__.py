"""How accurate an answer is, and how to have one that is accurate enough: rows of a ladder of spacings, and their envelope.

`measures` says what two records differ by, `envelope` what a row's own error is by the rows beside it: numpy alone, for
searches and studies. `ladder`, `cost` and `formal` are what is known of a scene before it runs: its lattices, the work of
each, and the order that it can have. `search` goes up the ladder to a tolerance, `budget` to what a budget pays for.
"""
