# SPDX-License-Identifier: MIT
"""Programs under other experiments: edits, variants, mutants, campaigns."""
