"""What a run took, beside what was planned for it."""

# pyright: strict

from dataclasses import dataclass

from wsph.accuracy.planning.cost import Plan


@dataclass(frozen=True)
class Took:
    """What a run took beside its `plan`: `work`, and seconds `inside` of its steps, `composing` for its plan, and `around`
    both: captures, checks and its result. One that was ended before its time has had a `part` of its steps."""

    plan: Plan
    work: float
    inside: float
    composing: float
    around: float
    part: float = 1.0

    @property
    def steps(self) -> float:
        """Those that it had, as its work is of visits."""
        return self.plan.steps * self.work / self.plan.work

    @property
    def more(self) -> float:
        """Its work as a multiple of what was planned."""
        return self.work / (self.part * self.plan.work)
