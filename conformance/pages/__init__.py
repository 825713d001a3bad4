# SPDX-License-Identifier: MIT
"""What people read: the page, the exercises, the tolerances, the README's table."""
