// SPDX-License-Identifier: MIT
// The exercises: the curves of one that is open, and the one that the address names.
"use strict";

const exercises = JSON.parse(document.getElementById("exercise-data").textContent);

function drawExercise(details) {
  const curves = exercises[details.dataset.exercise];
  const t = grid.filter((_, i) => i % 2 === 0).map((time) => time / data.horizon * curves.seconds); // every other of the curves above
  const charts = new Map(); // figure: chart
  const zoomed = (from, to) => charts.forEach((chart) => chart.setScale("x", { min: from, max: to }));
  const draw = (figure) => {
    const { signal, beside, axis: name } = figure.dataset;
    const besides = { reference: () => unpack(curves.reference), theta: () => t.map(() => curves.theta) };
    charts.set(figure, makeChart(figure, t, [
      { label: beside, values: besides[beside](), colour: css("--quiet"), dash: [4, 4], quiet: true },
      { label: signal, values: unpack(curves[signal]), colour: css("--accent") },
    ], { group: details.id, zoomed, name }));
  };
  whenSeen(details, all(".chart", details), draw, charts);
}

for (const details of all(".exercise")) {
  details.addEventListener("toggle", () => drawExercise(details), { once: true });
}

for (const button of all("[data-play]")) {
  button.addEventListener("click", () => {
    playground.set(JSON.parse(button.dataset.play));
    document.getElementById("playground").scrollIntoView();
  });
}

// the edits are shown in one language, or in all
const allEdits = document.getElementById("all-edits");

function showAllEdits(on) {
  keepingPlace(() => document.documentElement.toggleAttribute("data-edits", on));
  press(allEdits, on);
}
allEdits?.addEventListener("click", () => showAllEdits(!pressed(allEdits)));
for (const button of all("#exercises [data-choose-lead]")) button.addEventListener("click", () => showAllEdits(false));

// a link to something that is folded away opens what it is in
function unfold() {
  const target = location.hash && document.getElementById(decodeURIComponent(location.hash.slice(1)));
  if (!target) return;
  for (let part = target; part; part = part.parentElement) if (part.tagName === "DETAILS") part.open = true;
  target.scrollIntoView();
}
addEventListener("hashchange", unfold);
unfold();
