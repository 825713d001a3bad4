// SPDX-License-Identifier: MIT
// The curves of the programs, and their errors.
"use strict";

const times = unpack(data.grid);
const portButtons = all("[data-port].choice");
const drawn = new Map(); // figure: {chart, lines}
let period = [0, data.horizon];

// the curves of a figure, in drawing order: what stands beside, the exact solution, the programs
function linesOf({ signal, beside }) {
  const ports = portButtons.filter((button) => button.dataset.port in data.ports).map((button) => ({
    port: button.dataset.port,
    colour: getComputedStyle(button).getPropertyValue("--colour"),
  }));
  const quiet = { colour: css("--quiet"), dash: [4, 4], width: 1.25, quiet: true };
  const constant = (value) => times.map(() => value);
  const lines = [];
  if (beside === "reference") lines.push({ label: "r", values: unpack(data.exact.reference), ...quiet });
  if (beside === "theta") lines.push({ label: "θ", values: constant(data.theta), ...quiet });
  if (beside === "tolerance") {
    const state = signal.replace("error_", "");
    lines.push(...ports.map(({ port, colour }) => ({ ...quiet, label: "tolerance", port, colour,
      values: constant(data.tolerance[port][state] ?? null) })));
  }
  lines.push(...group(ports.map(({ port, colour }) => ({ label: port, port, colour,
    values: positive(unpack(data.ports[port][signal]), signal) }))));
  if (signal in data.exact) {
    lines.push({ label: "exact", values: positive(unpack(data.exact[signal]), signal), colour: css("--text"), width: 0.75 });
  }
  return lines;
}

// what a logarithmic axis can show
function positive(values, signal) {
  return /^error_|^V$/.test(signal) ? values.map((value) => (value > 0 ? value : null)) : values;
}

function draw(figure) {
  const lines = linesOf(figure.dataset);
  const chart = makeChart(figure, times, lines, "trajectories", setPeriod);
  drawn.set(figure, { chart, lines });
  showPorts(chart, lines);
  chart.setScale("x", { min: period[0], max: period[1] });
}

function showPorts(chart, lines) {
  const shown = portButtons.filter(pressed).map((button) => button.dataset.port);
  chart.batch(() => lines.forEach((line, i) => {
    if (line.port === undefined) return;
    if (line.group !== undefined) {
      const together = lines.filter(({ group, port }) => group === line.group && shown.includes(port));
      chart.series[i + 1].dash = interlaced(together.indexOf(line), together.length);
    }
    chart.setSeries(i + 1, { show: shown.includes(line.port) });
  }));
}

// marks the curves of programs that lie on one another
function group(lines) {
  const leaders = [];
  for (const line of lines) {
    const leader = leaders.find(({ values }) => coincide(values, line.values)) ?? line;
    if (leader === line) leaders.push(line);
    line.group = leaders.indexOf(leader);
  }
  return lines;
}

function coincide(a, b) {
  const size = a.reduce((largest, value) => Math.max(largest, Math.abs(value)), 0);
  return a.every((value, i) => Math.abs(value - b[i]) <= 0.01 * size);
}

function setPeriod(from, to) {
  if (!(from >= 0 && to <= data.horizon && from < to)) return;
  period = [from, to];
  document.getElementById("from").value = Number(from.toPrecision(4));
  document.getElementById("to").value = Number(to.toPrecision(4));
  for (const { chart } of drawn.values()) chart.setScale("x", { min: from, max: to });
}

const charts = all("#trajectories .chart");
const whenSeen = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) {
    if (isIntersecting) {
      whenSeen.unobserve(target);
      draw(target);
    }
  }
}, { rootMargin: "300px" });
charts.forEach((figure) => whenSeen.observe(figure));

new ResizeObserver(() => {
  for (const [figure, { chart }] of drawn) {
    chart.setSize({ width: figure.querySelector(".plot").clientWidth, height: HEIGHT });
  }
}).observe(document.getElementById("trajectories"));

matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  for (const [figure, { chart }] of drawn) {
    chart.destroy();
    draw(figure);
  }
});

for (const button of portButtons) {
  button.addEventListener("click", () => {
    press(button, !pressed(button));
    for (const { chart, lines } of drawn.values()) showPorts(chart, lines);
  });
}
for (const id of ["from", "to"]) {
  document.getElementById(id).addEventListener("change", () =>
    setPeriod(document.getElementById("from").valueAsNumber, document.getElementById("to").valueAsNumber));
}
document.getElementById("whole").addEventListener("click", () => setPeriod(0, data.horizon));
