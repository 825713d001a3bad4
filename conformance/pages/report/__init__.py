# SPDX-License-Identifier: MIT
"""The page: verdict, trajectories, code side by side, mistakes and a playground, in one file that needs no network."""

import shutil

BROWSERS = ("chromium", "chromium-browser", "google-chrome")


def chromium() -> str | None:
    """The path of the browser in which the page is tried; None where there is none."""
    return next(filter(None, map(shutil.which, BROWSERS)), None)
