"""The published cases: run them, compare them with their oracles, tell the verdict.

from wsph.validation import validate

for outcome in validate(["shock-bar"]):
    print(outcome.case.name, outcome.seconds, [row.meets for row in outcome.rows])
"""

# pyright: strict

from wsph.validation.case import Case, Row
from wsph.validation.validate import CASES, Outcome, as_data, validate

__all__ = ["CASES", "Case", "Outcome", "Row", "as_data", "validate"]
