# SPDX-License-Identifier: MIT
"""The proven enclosure of the exact solution, its doubles, and its certificate."""
