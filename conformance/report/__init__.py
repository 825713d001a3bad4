# SPDX-License-Identifier: MIT
"""The page: verdict, trajectories, code side by side, mistakes and a playground, in one file that needs no network."""
