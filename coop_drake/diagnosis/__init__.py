"""Why there is no plan: what blocks, where, which bodies collide, how much is missing, what would help."""

from coop_drake.diagnosis.diagnosing import BlockedPose, Diagnosis, PassageFindings, diagnose
from coop_drake.diagnosis.report import diagnosis_figure, facts_of, rows_of, sentences_of
from coop_drake.diagnosis.variants import Answer

__all__ = [
    "Answer",
    "BlockedPose",
    "Diagnosis",
    "PassageFindings",
    "diagnose",
    "diagnosis_figure",
    "facts_of",
    "rows_of",
    "sentences_of",
]
