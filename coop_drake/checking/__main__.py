"""``python -m coop_drake.checking QUESTION ANSWER``: 0 if the answer holds, 1 if refused, 2 if unreadable."""

import json
import sys
from pathlib import Path

from coop_drake.checking import RefusedError, check


def main(arguments: list[str]) -> int:
    """Check two files, or one file with both; returns the exit code."""
    try:
        documents = [json.loads(Path(name).read_text(encoding="utf-8")) for name in arguments]
        both = documents if len(documents) == 2 else [documents[0][key] for key in ("question", "answer")]
        for statement, count in check(*both):
            print(f"{count:8} {statement}")
    except (OSError, ValueError, LookupError, TypeError, RecursionError, MemoryError) as error:
        print(f"expected a question and an answer, two JSON files or one with both: {error}", file=sys.stderr)
        return 2
    except RefusedError as refusal:
        print(f"refused: {refusal}")
        return 1
    print("the answer holds")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
