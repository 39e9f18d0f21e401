"""One scene on several processes: who started them, and what they say to each other."""
