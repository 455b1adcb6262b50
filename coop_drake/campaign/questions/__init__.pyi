from .answering import answer, ask, begun_question
from .peers import Searched, search_by_peers
from .question import Question, random_question
from .settings import QuestionSettings

__all__ = [
    "Question",
    "QuestionSettings",
    "Searched",
    "answer",
    "ask",
    "begun_question",
    "random_question",
    "search_by_peers",
]
