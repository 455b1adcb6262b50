"""The proof half: relaxations and the whole question, explored in turns until one of them answers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import combinations

from coop_drake.answers.mixed_cell import MixedCell
from coop_drake.answers.problem import PlanningProblem
from coop_drake.answers.proof import InfeasibilityProof
from coop_drake.geometry.body_pairs import BodyPairs
from coop_drake.geometry.swept_tree import Intervals, SweptTree
from coop_drake.planning.cells.cells import Region
from coop_drake.planning.cells.events import Watch
from coop_drake.planning.cells.exploration import Exploration, Outcome, Verdict
from coop_drake.planning.cells.split_rules import SplitRule
from coop_drake.planning.proofs.inscribed_disc import disc_refuted
from coop_drake.planning.proofs.proof_making import slices_proof
from coop_drake.planning.proofs.relaxation_test import Doubts
from coop_drake.planning.questions.margins import shrunk
from coop_drake.planning.questions.relaxation import relaxed

_WHOLE_SHARE = 2
_MOST_ROBOTS = 2


@dataclass(frozen=True)
class Refutation:
    """A proof that no plan exists.

    Attributes:
        reason: Why, in a sentence.
        robots: Robots that the proof is about, with the object.
        proof: The proof in a form that can be checked again.
    """

    reason: str
    robots: tuple[int, ...]
    proof: InfeasibilityProof


class Proofs:
    """Explorations of one question at margin zero; the same work gives the same answer.

    The free-flyer goes first. Then relaxations to two robots at most for which sampling finds no path, and
    the whole with half the slices of each, are explored in turns: whichever is refuted refutes the question.

    Args:
        problem: The question.
        watch: Called with the events of every exploration.

    Attributes:
        refutation: The proof, once there is one.
    """

    def __init__(self, problem: PlanningProblem, watch: Watch | None = None) -> None:
        self._problem, self._watch = problem, watch
        self._all = tuple(sorted({joint.robot for joint in problem.tree.joints}))
        self._doubts = Doubts(problem)
        self._explorations: dict[tuple[int, ...], Exploration] = {}
        self._outcomes: dict[tuple[int, ...], Outcome] = {}
        self._flown = False
        self.refutation: Refutation | None = None

    @property
    def slices(self) -> int:
        """Compound slices made so far."""
        return sum(outcome.slices for outcome in self._outcomes.values())

    def run(
        self,
        share: int,
        robots: int | None = None,
        progress: Callable[[int], None] | None = None,
        *,
        doubted: bool = True,
    ) -> Verdict:
        """Explore on until every exploration has an answer or has made its share of slices.

        Args:
            share: Slices of each exploration, those of earlier calls included.
            robots: How many robots a question keeps at most; None for the whole question and every
                relaxation that is in doubt.
            progress: Called with the number of slices that an exploration has.
            doubted: Whether the caller doubts the relaxations to so many robots already.

        Returns:
            INFEASIBLE with ``refutation``; FOUND if the whole question has a free channel; RESOLUTION if it
            will not get any further; BUDGET if a larger share may help.
        """
        if not self._flown:
            self._flown = True
            disc = disc_refuted(self._problem)
            if disc is not None:
                reason = "a disc inside the team cannot get from start to goal"
                self.refutation = Refutation(reason, (), disc)
        for chosen in self._questions(robots):
            if self.refutation is None and self._goes_on(chosen, asked=robots is not None and doubted):
                outcome = self._exploration(chosen).run(self._most(chosen, share), progress)
                if outcome.verdict is Verdict.INFEASIBLE and not self._refute(chosen):
                    outcome = replace(outcome, verdict=Verdict.RESOLUTION)
                self._outcomes[chosen] = outcome
        if self.refutation is not None:
            return Verdict.INFEASIBLE
        latest = self._outcomes.get(self._all)
        return Verdict.BUDGET if latest is None else latest.verdict

    def boxes(self) -> list[tuple[Intervals, Region]]:
        """Expanded intervals and regions of the whole question's free channel."""
        return self._exploration(self._all).boxes(self._outcomes[self._all].path)

    def undecided(self) -> tuple[MixedCell, ...]:
        """What the whole question's last channel left undecided, the widest first; nothing before a run."""
        latest = self._outcomes.get(self._all)
        return () if latest is None else self._exploration(self._all).undecided(latest.path)

    def counts(self) -> tuple[int, int]:
        """Numbers of FREE and of MIXED cells of the whole question; none before a run."""
        return self._exploration(self._all).counts() if self._all in self._explorations else (0, 0)

    def _questions(self, most: int | None) -> list[tuple[int, ...]]:
        """Robots of the explorations, fewest first, the whole last."""
        kept = _MOST_ROBOTS if most is None else most
        counts = range(min(1 + kept, len(self._all)))
        parts = [chosen for count in counts for chosen in combinations(self._all, count)]
        return [*parts, self._all] if most is None else parts

    def _most(self, chosen: tuple[int, ...], share: int) -> int:
        """Slices for one exploration: the whole has half of the share while parts of it go on, too."""
        waits = any(
            outcome.verdict is Verdict.BUDGET for part, outcome in self._outcomes.items() if part != chosen
        )
        return share // _WHOLE_SHARE if chosen == self._all and waits else share

    def _goes_on(self, chosen: tuple[int, ...], *, asked: bool) -> bool:
        """Whether to explore a question now: the whole always, a part if it is in doubt and no less is."""
        outcome = self._outcomes.get(chosen)
        if outcome is not None:
            return outcome.verdict is Verdict.BUDGET
        if asked or chosen == self._all:
            return True
        less = (part for part in self._outcomes if len(part) < len(chosen) and set(part) < set(chosen))
        if any(self._outcomes[part].verdict is not Verdict.FOUND for part in less):
            return False
        return self._doubts.about(chosen)

    def _exploration(self, chosen: tuple[int, ...]) -> Exploration:
        if chosen not in self._explorations:
            question, _ = relaxed(self._problem, chosen)
            self._explorations[chosen] = explorer(question, self._watch, what=self._words(chosen))
        return self._explorations[chosen]

    def _words(self, chosen: tuple[int, ...]) -> str:
        if chosen == self._all:
            return "the whole team"
        return "the object alone" if not chosen else f"the object with robots {list(chosen)} alone"

    def _refute(self, chosen: tuple[int, ...]) -> bool:
        """State the proof; one that cannot be stated is none: cells all but touch, or geometry fails."""
        question, _ = relaxed(self._problem, chosen)
        exploration = self._exploration(chosen)
        proof = slices_proof(question, chosen, exploration.slices, exploration.over_leaves())
        if proof is None:
            return False
        reason = f"the over-approximations of {self._words(chosen)} separate start from goal"
        self.refutation = Refutation(reason, chosen, proof)
        return True


def explorer(
    problem: PlanningProblem,
    watch: Watch | None = None,
    *,
    what: str = "the whole team",
    split: SplitRule = "strong",
) -> Exploration:
    """An exploration by cells at margin zero: complete, and the only source of proofs.

    Args:
        problem: The question.
        watch: Called with every event.
        what: The question in words.
        split: Which axis of a slice is halved.
    """
    swept = SweptTree(problem.tree)
    space = shrunk(problem.workspace, 0.0)
    return Exploration(problem, space, swept, BodyPairs(swept), watch, what, split)
