// SPDX-License-Identifier: MIT
// The figures of the checks, cell by cell.
"use strict";

// one cell of a table is in the order of tabs; the arrow keys move within
for (const part of all(".inspected")) {
  const inspector = part.querySelector(".inspector");
  const rows = all("tbody tr", part).map((row) => all(".cell", row));
  const stops = (cell) => cell !== undefined && !cell.classList.contains("self");
  const move = (i, j, by) => {
    const to = rows[i]?.[j];
    if (to === undefined) return;
    if (!stops(to)) {
      move(i + by[0], j + by[1], by);
      return;
    }
    all(".cell[tabindex='0']", part).forEach((cell) => { cell.tabIndex = -1; });
    to.tabIndex = 0;
    to.focus();
  };
  const first = rows.flat().find(stops);
  if (first !== undefined) first.tabIndex = 0;
  rows.forEach((row, i) => row.forEach((cell, j) => {
    for (const event of ["pointerenter", "focus", "click"]) {
      cell.addEventListener(event, () => { inspector.textContent = cell.dataset.words; });
    }
    cell.addEventListener("keydown", (event) => {
      const steps = { ArrowUp: [-1, 0], ArrowDown: [1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1] };
      if (!(event.key in steps)) return;
      event.preventDefault();
      const by = steps[event.key];
      move(i + by[0], j + by[1], by);
    });
  }));
}
