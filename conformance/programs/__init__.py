# SPDX-License-Identifier: MIT
"""Which ports there are, and how each is spelled, written and run."""
