// SPDX-License-Identifier: MIT
// Wide equations and tables.
"use strict";

// one that is wider than its box scrolls in it, by keys too
const widths = new ResizeObserver((boxes) => {
  for (const { target } of boxes) target.tabIndex = target.scrollWidth > target.clientWidth ? 0 : -1;
});
for (const box of all(".equation, .scrolling")) widths.observe(box);
