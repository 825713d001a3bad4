// SPDX-License-Identifier: MIT
// The playground: the closed loop under the sliders' parameters, integrated and drawn as they move.
"use strict";

const EVERY = 10; // rows of the trajectory per point drawn

const form = document.querySelector("#playground form");
const sliders = all("input[type=range]", form);
const outcome = document.querySelector("#playground .outcome");
const panels = new Map(); // figure: chart
const camel = (name) => name.replace(/_(.)/g, (_, letter) => letter.toUpperCase());

function parameters() {
  const values = sliders.map(({ name, value }) => [camel(name), Number(value)]);
  return { ...Object.fromEntries(values), finalTime: data.horizon };
}

function chosenProgram() {
  return programs[new FormData(form).get("program")](parameters());
}

function playgroundCsv() {
  const { simulate, toCsv } = chosenProgram();
  return toCsv(simulate());
}

// the columns drawn, by signal; a failed run ends early
function playgroundCurves() {
  const { theta } = parameters();
  const { simulate, signals } = chosenProgram();
  const trajectory = simulate();
  const points = trajectory.filter((_, i) => i % EVERY === 0);
  const at = points.map(signals);
  const column = (name) => at.map((signal) => (Number.isFinite(signal[name]) ? signal[name] : null));
  return { theta, end: trajectory.at(-1).t, t: points.map(({ t }) => t), x1: column("x1"), reference: column("r"),
           z1: column("z1"), theta_hat: column("thetaHat"), V: column("V").map((V) => (V > 0 ? V : null)) };
}

function tell({ theta, end, z1, theta_hat: estimate }) {
  return end < data.horizon - 1e-9
    ? `The integration fails after ${end.toFixed(2)} s: the state is no longer finite.`
    : `At ${end.toFixed(0)} s: z₁ = ${short(z1.at(-1))}, θ̂ = ${short(estimate.at(-1))}, θ = ${short(theta)}.`;
}

function update() {
  const curves = playgroundCurves();
  outcome.textContent = tell(curves);
  for (const { name, value, parentElement } of sliders) {
    parentElement.querySelector("output").textContent = Number(value).toFixed(2);
  }
  for (const [figure, chart] of panels) chart.setData(columnsOf(figure.dataset, curves));
}

function columnsOf({ signal, beside }, curves) {
  const besides = { "": [], reference: [curves.reference], theta: [curves.t.map(() => curves.theta)] };
  return [curves.t, ...besides[beside], curves[signal]];
}

function drawPanel(figure) {
  const [t, ...columns] = columnsOf(figure.dataset, playgroundCurves());
  const styles = [{ label: figure.dataset.signal, colour: css("--accent") }];
  if (figure.dataset.beside) styles.unshift({ label: figure.dataset.beside, colour: css("--quiet"), dash: [4, 4], quiet: true });
  const lines = styles.map((style, i) => ({ ...style, values: columns[i] }));
  const zoomed = (from, to) => panels.forEach((chart) => chart.setScale("x", { min: from, max: to }));
  panels.set(figure, makeChart(figure, t, lines, "playground", zoomed));
}

let waiting = false;
function soon() {
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(() => {
    waiting = false;
    update();
  });
}

form.addEventListener("input", soon);
form.addEventListener("submit", (event) => event.preventDefault());
for (const button of all("[data-preset]", form)) {
  button.addEventListener("click", () => {
    const values = JSON.parse(button.dataset.preset);
    for (const slider of sliders) slider.value = values[slider.name];
    update();
  });
}

function drawPlayground() {
  for (const [figure, chart] of panels) {
    chart.destroy();
    panels.delete(figure);
  }
  all("#playground .chart").forEach(drawPanel);
  update();
}

new IntersectionObserver((entries, observer) => {
  if (entries.some(({ isIntersecting }) => isIntersecting)) {
    observer.disconnect();
    drawPlayground();
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", drawPlayground);
  }
}, { rootMargin: "300px" }).observe(document.getElementById("playground"));

new ResizeObserver(() => {
  for (const [figure, chart] of panels) {
    chart.setSize({ width: figure.querySelector(".plot").clientWidth, height: HEIGHT });
  }
}).observe(document.getElementById("playground"));
