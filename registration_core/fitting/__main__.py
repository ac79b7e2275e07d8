"""`python -m registration_core.fitting`: make all fitted numbers from nothing; with --check, only see whether
the committed ones are what the committed feature table gives.
"""

import argparse
import json
import sys
import time
from dataclasses import replace
from typing import Any

import numpy as np

from registration_core.config import SnapConfig
from registration_core.fitted import PATH
from registration_core.fitting import calibration, numbers
from registration_core.fitting.replay import decisions
from registration_core.fitting.table import FeatureTable, read_table, table_of, with_decisions
from registration_core.fitting.trials import all_trials

SEED, SCENES = 0, 800


def main() -> int:
    """Returns 1 where the committed numbers are not what the committed table gives."""
    parser = argparse.ArgumentParser(prog="fit", description="Make the fitted numbers of a snap.")
    parser.add_argument("--check", action="store_true", help="only compare with the committed feature table")
    parser.add_argument("--scenes", type=int, default=SCENES, help=f"to make (default {SCENES})")
    parser.add_argument("--seed", type=int, default=SEED, help=f"of everything (default {SEED})")
    arguments = parser.parse_args()
    if arguments.check:
        return check()
    make(arguments.seed, arguments.scenes)
    return 0


def make(seed: int, scenes: int) -> None:
    """Scenes, candidates, features, weights, calibration; then the table and the numbers are written."""
    began = time.perf_counter()

    def say(what: str) -> None:
        print(f"{time.perf_counter() - began:6.0f} s  {what}", flush=True)

    trials = all_trials(seed, scenes)
    say(f"{len(trials)} searches in {scenes} scenes")
    table = table_of(trials)
    chosen = numbers.judge_choices(table)
    say(f"the judge's penalty is {chosen['ridge']}; {len(chosen['removed'])} classes do not help")
    judge = numbers.judge_numbers(table, **chosen)
    config = SnapConfig()
    fitted = replace(
        config.selection,
        classes=tuple(judge["classes"].values()),
        match_share=judge["match_share"],
        prior=judge["prior"],
    )
    table = with_decisions(table, decisions(trials, fitted, config.confidence))
    say("what it makes of all searches is known")
    table.write()
    made = {"seed": seed, "scenes": scenes, "judge": chosen}
    PATH.write_text(written(fitted_numbers(table, made)), encoding="utf-8")
    say(f"written to {PATH.name} and table.npz")
    print(json.dumps(json.loads(PATH.read_text(encoding="utf-8"))["made"], indent=2))


def fitted_numbers(table: FeatureTable, made: dict[str, Any]) -> dict[str, Any]:
    """All that `fitted.json` holds, made with a seed, a number of scenes and a penalty, and without some of
    the judge's classes.
    """
    judge, confidence = numbers.judge_numbers(table, **made["judge"]), numbers.confidence_numbers(table)
    doubts = numbers.doubt_numbers(table, confidence)
    return {
        "made": {
            "seed": made["seed"],
            "scenes": made["scenes"],
            "trials": len(table.lengths),
            "table_sha256": table.hash(),
            "families": sorted(set(table.families.tolist())),
            "kinds": sorted(set(table.kinds.tolist())),
            "judge": made["judge"],
            "confidence": {"ridge": calibration.RIDGE},
            "scores": numbers.scores(table, **made["judge"], confidence=confidence, doubts=doubts),
        },
        "judge": judge,
        "confidence": confidence,
        "doubts": doubts,
        "calibration": numbers.calibration_numbers(table, confidence, doubts),
    }


def check() -> int:
    """Whether the committed numbers follow from the committed table, with the penalty and the classes that
    were chosen by it; what does not is named.
    """
    committed = json.loads(PATH.read_text(encoding="utf-8"))
    again = fitted_numbers(read_table(), committed["made"])
    wrong = differences(committed, again)
    for name in wrong:
        print(f"{name} is not what the feature table gives; run ./scripts/fit", file=sys.stderr)
    if not wrong:
        print("The fitted numbers are what the feature table gives.")
    return 1 if wrong else 0


def differences(committed: Any, again: Any, name: str = "fitted.json") -> list[str]:
    """The names of entries that differ by more than the rounding of another machine's arithmetic."""
    if isinstance(committed, dict) and isinstance(again, dict) and committed.keys() == again.keys():
        return [
            wrong for key in committed for wrong in differences(committed[key], again[key], f"{name}: {key}")
        ]
    if isinstance(committed, list) and isinstance(again, list) and len(committed) == len(again):
        if all(isinstance(value, int | float) for value in (*committed, *again)):
            return [] if np.allclose(committed, again, rtol=0.02, atol=0.01) else [name]
        return [] if committed == again else [name]
    if isinstance(committed, float) and isinstance(again, int | float):
        return [] if np.isclose(committed, again, rtol=0.02, atol=0.01) else [name]
    return [] if committed == again else [name]


def written(values: dict[str, Any]) -> str:
    """As JSON, a line for each number but in long lists."""
    text = json.dumps(values, indent=1)
    lists = values["calibration"]
    for key in ("confidence", "right"):
        text = text.replace(json.dumps(lists[key], indent=1).replace("\n", "\n  "), json.dumps(lists[key]))
    return text + "\n"


if __name__ == "__main__":
    sys.exit(main())
