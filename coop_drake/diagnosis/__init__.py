"""Why there is no plan: which passage blocks, which bodies are at fault, how much is missing, what helps."""

from coop_drake.diagnosis.diagnosis import BlockedPose, Diagnosis, PassageFindings
from coop_drake.diagnosis.picture import diagnosis_figure
from coop_drake.diagnosis.report import facts_of, rows_of, sentences_of
from coop_drake.diagnosis.trials import Answer
from coop_drake.diagnosis.why_not import diagnose

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
