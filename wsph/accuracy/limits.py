"""What a search may cost: seconds of wall time, or pair visits."""

# pyright: strict

from dataclasses import dataclass

from wsph.accuracy.planning.cost import Plan
from wsph.accuracy.planning.watch import Due
from wsph.accuracy.row import in_seconds
from wsph.accuracy.rows import Rows
from wsph.quantities import Table
from wsph.units import quantity

DEFAULT_SECONDS = 3600.0
"""What a search may take where nothing is said."""

SHARE = 0.9
"""The part of a budget that is planned with where what a run takes is a prediction."""

END, SLACK = 0.99, 0.03
"""The part of seconds at which a run has to end as it begins, for what it has found is still to be looked at; and what is
given to one that is nearly done, which would be lost otherwise."""


@dataclass(frozen=True)
class Limit:
    """At most so many `seconds` or so much `work`: one of them."""

    seconds: float | None = DEFAULT_SECONDS
    work: float | None = None

    @classmethod
    def read(cls, text: str) -> "Limit":
        """From what is written: "30 s", or a number of pair visits. Raises ValueError."""
        try:
            number = float(text)
        except ValueError:
            number = 0.0
            seconds = quantity(text, "s")
            if not seconds > 0.0:
                raise ValueError(f"{text!r} is not above zero") from None
            return cls(seconds)
        if not 0.0 < number < float("inf"):
            raise ValueError(f"{text!r} is no number of pair visits above zero; for a time write it with its unit")
        return cls(None, number)

    def __str__(self) -> str:
        return in_seconds(self.seconds) if self.seconds is not None else f"{self.work:.3g} pair visits"

    @property
    def due(self) -> Due:
        """When runs have to end."""
        if self.seconds is None:
            return Due()
        return Due(END * self.seconds, SLACK * self.seconds, SHARE * self.seconds)

    def left(self, rows: Rows, share: float = 1.0) -> float:
        """Of a part of it, what is left to the rows to come [s, or pair visits]."""
        if self.seconds is not None:
            return share * self.seconds - rows.seconds
        return share * (self.work or 0.0) - rows.spent

    def cost(self, rows: Rows, plan: Plan, *, composed: bool = False) -> float:
        """A run in the limit's own measure, from where it is `composed` on or with that; zero where it is not known yet."""
        if self.seconds is None:
            return plan.work * rows.rate.more
        seconds = rows.rate.seconds(plan, composed=composed)
        return seconds if seconds == seconds else 0.0

    def data(self) -> Table:
        """As accuracy.json has it."""
        return {"seconds": self.seconds} if self.seconds is not None else {"work": self.work}
