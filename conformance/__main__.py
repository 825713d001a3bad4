# SPDX-License-Identifier: MIT
"""The command line: python -m conformance --help."""

import argparse
import sys


def main() -> int:
    """Run one command; returns the exit status."""
    parser = argparse.ArgumentParser(prog="conformance", description="Judge the six programs of Chapter 17, Lesson 1.")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    commands.add_parser("table", help="what ran, on which engine, and what came out (the ports of PORTS, or all)")
    parser.parse_args()

    from conformance.ports import selected_ports
    from conformance.table import table

    try:
        ports = selected_ports()
    except ValueError as error:
        parser.error(str(error))
    print(table(ports.values()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
