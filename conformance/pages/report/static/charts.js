// SPDX-License-Identifier: MIT
// Charts: uPlot with the page's colours, one axis of time for all charts of a group, and a readout under the pointer.
"use strict";

const HEIGHT = 230; // px, of a plot with its axes
const DASH = 8; // px, of each of several curves that lie on one another

const data = JSON.parse(document.getElementById("data").textContent);

function css(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

// base64 of single-precision numbers; NaN becomes a gap
function unpack(text) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  return Array.from(new Float32Array(bytes.buffer), (value) => (Number.isNaN(value) ? null : value));
}

// the i-th of n curves draws every n-th dash, so that all are seen where they lie on one another
function interlaced(i, n) {
  return n < 2 ? [] : [0, i * DASH, DASH, (n - 1 - i) * DASH];
}

function short(value) {
  const size = Math.abs(value);
  return size !== 0 && (size < 1e-3 || size >= 1e5) ? value.toExponential(2) : value.toPrecision(4);
}

function superscript(exponent) {
  return String(exponent).replace("-", "⁻").replace(/\d/g, (digit) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[digit]);
}

// powers of ten between two values, not too many
function decades(u, axis, low, high) {
  const [first, last] = [Math.ceil(Math.log10(low)), Math.floor(Math.log10(high))];
  const every = Math.ceil((last - first + 1) / 6);
  const exponents = Array.from({ length: last - first + 1 }, (_, i) => first + i);
  return exponents.filter((exponent) => exponent % every === 0).map((exponent) => 10 ** exponent);
}

function powers(u, splits) {
  return splits.map((value) => `10${superscript(Math.round(Math.log10(value)))}`);
}

function axis(label, size, space) {
  const font = `12px ${css("--sans")}`;
  const line = { stroke: css("--rule"), width: 1 };
  return { label, size, space, font, labelFont: font, labelSize: 18, labelGap: 0, stroke: css("--quiet"),
           grid: line, ticks: { ...line, size: 4 } };
}

// lines: [{label, values, colour, width, dash, quiet}]; a quiet line is not read out
// zoomed(from, to): the reader has changed the time drawn; group: charts that share a pointer
function makeChart(figure, times, lines, group, zoomed) {
  const { axis: name, logarithmic } = figure.dataset;
  const host = figure.querySelector(".plot");
  const readout = figure.querySelector(".readout");
  const chart = new uPlot({
    width: host.clientWidth,
    height: HEIGHT,
    legend: { show: false },
    cursor: { sync: { key: group }, y: false, points: { size: 5 }, drag: { x: true, y: false, uni: 10 } },
    scales: {
      x: { time: false, range: (u, from, to) => [from, to] },
      y: logarithmic === undefined ? {} : { distr: 3, range: (u, low, high) => logarithmicRange(low, high) },
    },
    axes: [axis("t (s)", 26, 60),
           { ...axis(name, 46, 34), ...(logarithmic === undefined ? {} : { splits: decades, values: powers, filter: (u, splits) => splits }) }],
    series: [{}, ...lines.map(({ label, colour, width = 1.75, dash = [] }) =>
      ({ label, stroke: colour, width, dash, points: { show: false }, spanGaps: true }))],
    hooks: {
      setCursor: [(u) => { readout.textContent = readoutText(u, lines); }],
      setSelect: [(u) => {
        if (u.select.width > 0) zoomed(u.posToVal(u.select.left, "x"), u.posToVal(u.select.left + u.select.width, "x"));
      }],
    },
  }, [times, ...lines.map(({ values }) => values)], host);
  chart.over.addEventListener("dblclick", () => zoomed(times[0], times.at(-1)));
  return chart;
}

function logarithmicRange(low, high) {
  return low > 0 ? [10 ** Math.floor(Math.log10(low)), 10 ** Math.ceil(Math.log10(high))] : [1e-12, 1];
}

// the time and the values there; one value where all curves agree
function readoutText(u, lines) {
  const { idx } = u.cursor;
  if (idx === null || idx === undefined) return "";
  const shown = lines.map((line, i) => ({ ...line, value: u.data[i + 1][idx], on: u.series[i + 1].show }))
    .filter(({ on, quiet, value }) => on && !quiet && value !== null && value !== undefined);
  const texts = shown.map(({ value }) => short(value));
  const values = new Set(texts).size === 1 ? texts[0] : shown.map(({ label }, i) => `${label} ${texts[i]}`).join(", ");
  return `t = ${u.data[0][idx].toFixed(2)} s: ${values}`;
}
