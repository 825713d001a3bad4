# SPDX-License-Identifier: MIT
"""The lesson's experiment, (10), as its file has it."""

from conformance.places import LESSON as FILE
from conformance.theory.experiment_file import as_written

LESSON = as_written(FILE)
