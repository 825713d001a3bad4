// SPDX-License-Identifier: MIT
// Reads [[LaTeX, "block" or "inline"], ..] as JSON and writes the HTML of each, with MathML for readers, as JSON.
"use strict";

const { createRequire } = require("node:module");
const { readFileSync } = require("node:fs");

const katex = createRequire(`${process.cwd()}/`)("katex");

function trusted({ command }) {
  if (command === "\\htmlData") return true; // the names of symbols
  throw new Error(`${command} is not for this page`);
}

const options = {
  output: "htmlAndMathml",
  throwOnError: true,
  trust: trusted,
  strict: (kind) => (kind === "htmlExtension" ? "ignore" : "error"),
};

function typeset([latex, display]) {
  try {
    const html = katex.renderToString(latex, { ...options, displayMode: display === "block" });
    return html.replace(/<semantics>(.*?)<annotation.*?<\/annotation><\/semantics>/s, "$1"); // the source in LaTeX
  } catch (error) {
    process.stderr.write(`${latex}: ${error.message}\n`);
    process.exit(1);
  }
}

process.stdout.write(JSON.stringify(JSON.parse(readFileSync(0, "utf8")).map(typeset)));
