"""`wsph validate`: run the published cases and compare them with their oracles."""

# pyright: strict

import argparse
import json

from wsph.cli.command import Command


def _declare(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("cases", nargs="*", metavar="CASE", help="names of cases (default: all)")
    parser.add_argument("--full", action="store_true", help="all published sizes, not only the short ones")
    parser.add_argument("--json", action="store_true", help="print JSON")


def _act(options: argparse.Namespace) -> int:
    from wsph.validation.validate import as_data, validate

    found: list[dict[str, object]] = []
    met = True
    for outcome in validate(options.cases, options.full):
        met = met and outcome.meets
        found.append(as_data(outcome))
        if options.json:
            continue
        case = outcome.case
        print(f"{case.name}: {case.source}; oracle: {case.oracle}; {outcome.seconds:.1f} s")
        for row in outcome.rows:
            verdict = "reported" if row.asked == "reported" else "meets" if row.meets else "MISSES"
            asked = "" if row.asked == "reported" else f", asked {row.asked}"
            print(f"  {verdict:<8} {row.figure}: {row.reached:.3g} {row.unit}{asked}; published: {row.published}")
    if options.json:
        print(json.dumps(found, indent=2))
    return 0 if met else 1


VALIDATE = Command("validate", "run the published cases and compare them with their oracles", _declare, _act)
