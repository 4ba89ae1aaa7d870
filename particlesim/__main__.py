"""The program: ``particlesim``, or ``python -m particlesim``."""

import sys
from contextlib import suppress

from particlesim.core.interrupts import end_by_signals, ended_by, interruption, raise_signals


def main() -> None:
    """Run the command line.

    Exit code 2 for wrong input, 1 for what this machine cannot do, 3 for a drift of energy that was not allowed,
    130 for Ctrl-C, 143 and 129 for SIGTERM and SIGHUP; that of the system if it is killed or crashes.
    """
    raise_signals()
    try:
        from particlesim.cli.main import main as run_command  # noqa: PLC0415  (a signal may come meanwhile)

        run_command()
    except SystemExit:
        raise
    except BaseException as error:
        if (stopped := interruption(error)) is None:
            raise
        line, code = ended_by(stopped)  # before a command has begun, which would have said so
        with suppress(OSError):
            print(line, file=sys.stderr)
        sys.exit(code)
    finally:
        end_by_signals()


if __name__ == "__main__":
    main()
