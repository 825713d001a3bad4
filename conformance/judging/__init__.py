# SPDX-License-Identifier: MIT
"""A CSV as a trajectory, its figures, the checks, the verdicts, and what changed."""
