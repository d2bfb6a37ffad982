"""`./steadyhand study`, also `python -m steadyhand.study`."""

from __future__ import annotations

import argparse
import contextlib
import sys
from pathlib import Path

from .._command_line import Shown, lacks, printable

BAD_INPUT = 2

EXAMPLES = """examples:
  ./steadyhand study examples/studies/profiles.yaml                    guides experimenter and participants
  ./steadyhand study examples/studies/profiles.yaml --simulated 24     simulated operators instead, in virtual time
  ./steadyhand study examples/studies/profiles.yaml --check            checks the study and prints its schedule
  ./steadyhand study analyse studies/profiles                          report.html, summary.csv, contrasts.csv
  ./steadyhand study delete studies/profiles P03                       deletes the data of a participant
Exit codes: 0 done; 1 an error during the study; 2 bad input, with the reason on stderr."""


def _parser(command: str) -> argparse.ArgumentParser:
    return argparse.ArgumentParser(prog=f"steadyhand study{command}", formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False)


def _positive(text: str) -> int:
    if not text.isdigit() or not 0 < int(text) <= 1_000_000:
        raise argparse.ArgumentTypeError(f"{text!r} must be a whole number above 0")
    return int(text)


def _run(arguments: list[str]) -> int:
    parser = _parser("")
    parser.description = "Runs a user study that compares conditions, with participants or simulated operators (docs/how-to/user-study.md)."
    parser.epilog = EXAMPLES
    parser.add_argument("study", metavar="STUDY.yaml", help="study file; or analyse, delete (see below)")
    parser.add_argument("--simulated", type=_positive, metavar="N", help="number of simulated operators, in virtual time")
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="folder of the results (studies/NAME)")
    parser.add_argument("--jobs", type=_positive, default=1, metavar="N", help="number of processes that simulate")
    parser.add_argument("--check", action="store_true", help="print the schedule only")
    parser.add_argument("--port", type=int, default=8642, choices=range(65536), metavar="N", help="port of the operator's page; 0: any free one")
    given = parser.parse_args(arguments)
    from .analysis import analyse, write_tables
    from .report import write_report
    from .run import schedule_of, simulate
    from .study_file import load_study

    study = load_study(given.study, given.simulated)
    out = given.out or Path("studies") / study.name.replace(" ", "-")
    if given.check:
        schedule = schedule_of(study)
        print(f"{study.title}: {study.participants} participants, {sum(map(len, schedule))} trials")
        for trials in schedule:
            print(trials[0].participant, " | ".join(dict.fromkeys(each.condition for each in trials)))
        return 0
    if given.simulated is None:
        from .live import lead

        return lead(study, out, given.port)
    simulate(study, out, given.jobs)
    results = analyse(out)
    write_tables(results, out)
    print(f"report: {write_report(results, out)}")
    return 0


def _analyse(arguments: list[str]) -> int:
    parser = _parser(" analyse")
    parser.add_argument("folder", type=Path)
    given = parser.parse_args(arguments)
    from .analysis import analyse, write_tables
    from .report import write_report

    results = analyse(given.folder)
    write_tables(results, given.folder)
    print(f"report: {write_report(results, given.folder)}")
    if results.missing > 0:
        print(f"{results.missing} trials of the schedule are not done yet")
    return 0


def _delete(arguments: list[str]) -> int:
    parser = _parser(" delete")
    parser.add_argument("folder", type=Path)
    parser.add_argument("participant")
    given = parser.parse_args(arguments)
    from .analysis import open_study
    from .record import Folder

    open_study(given.folder)
    folder = Folder(given.folder)
    folder.hold()
    folder.delete(given.participant)
    print(f"{given.participant}: everything is deleted; run `study analyse` again for a report without them")
    return 0


COMMANDS = {"analyse": _analyse, "delete": _delete}


def main(arguments: list[str] | None = None) -> int:
    arguments = sys.argv[1:] if arguments is None else arguments
    try:
        command = COMMANDS.get(arguments[0]) if arguments else None
        with contextlib.redirect_stdout(Shown(sys.stdout)):
            return command(arguments[1:]) if command else _run(arguments)
    except ValueError as error:  # StudyError, and what the library refuses
        if type(error).__name__ not in ("StudyError", "SteadyhandError"):
            raise
        sys.stderr.write(f"steadyhand: {printable(str(error))}\n")
        return BAD_INPUT
    except ModuleNotFoundError as error:
        sys.stderr.write(f"steadyhand: study: {lacks(error, 'study')}\n")
        return BAD_INPUT
    except OSError as error:
        sys.stderr.write(f"steadyhand: {printable(str(error.filename or 'a file'))}: {error.strerror}. Finished trials are kept: run the same command again to go on\n")
        return 1
    except KeyboardInterrupt:
        sys.stderr.write("steadyhand: interrupted. Finished trials are kept: run the same command again to go on\n")
        return 130


if __name__ == "__main__":
    sys.exit(main())
