# SPDX-License-Identifier: MIT
"""The harness that judges the six programs of Chapter 17, Lesson 1."""
