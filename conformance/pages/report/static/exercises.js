// SPDX-License-Identifier: MIT
// The curves of the exercises.
"use strict";

const exercises = JSON.parse(document.getElementById("exercise-data").textContent);

function drawExercise(details) {
  const curves = exercises[details.dataset.exercise];
  const t = unpack(curves.t);
  for (const figure of all(".chart", details)) {
    const { signal, beside } = figure.dataset;
    const besides = { reference: () => unpack(curves.reference), theta: () => t.map(() => curves.theta) };
    makeChart(figure, t, [
      { label: beside, values: besides[beside](), colour: css("--quiet"), dash: [4, 4], quiet: true },
      { label: signal, values: unpack(curves[signal]), colour: css("--accent") },
    ], details.id, () => {});
  }
}

for (const details of all(".exercise")) {
  details.addEventListener("toggle", () => {
    if (details.open && all("canvas", details).length === 0) drawExercise(details);
  });
}
