"""How accurate an answer is, and how to have one that is accurate enough: rows of a ladder of spacings, and their envelope.

`measures` says what two records differ by, `envelope` what a row's own error is by the rows beside it: numpy alone, for
searches and studies. `planning` is what is known of a scene before it runs, `rows` are its runs, `running` is where they
run. `search` goes up the ladder to a tolerance, `budget` to what a budget pays for; `accurate` is the whole, and `schemes`
which scheme to do it with.
"""
