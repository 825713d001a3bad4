# SPDX-License-Identifier: MIT
"""Strict-feedback plants, their classification, the recursion, and straight-line programs with derivatives."""
