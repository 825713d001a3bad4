// SPDX-License-Identifier: MIT
// The programs side by side: which are shown, and what two of them share.
"use strict";

const codeButtons = all("[data-code]");
const codeSection = document.getElementById("code");

const everyProgram = codeButtons.map((button) => button.dataset.code);
const narrow = matchMedia("screen and (width <= 800px)");
let chosenCode = []; // by the reader

// until he chooses every program is shown, on a narrow screen that of the derivation's language alone
function shownCode() {
  if (chosenCode.length > 0) return chosenCode;
  return everyProgram.filter((name) => !narrow.matches || name === document.documentElement.dataset.lead);
}

function showCode() {
  const names = shownCode();
  for (const button of codeButtons) press(button, names.includes(button.dataset.code));
  for (const place of all("[data-port]:not(button)", codeSection)) place.hidden = !names.includes(place.dataset.port);
  codeSection.dataset.shown = names.length;
  markDifferences(names);
}

// the names and signs of a piece of code, each with where it stands, and its symbol where it is one
function tokens(code) {
  const found = [];
  const walker = document.createTreeWalker(code, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const node = walker.currentNode;
    const place = node.parentElement.closest(SYMBOLS);
    const symbol = place ? symbolOf(place) : undefined;
    for (const { 0: text, index } of node.data.matchAll(/[A-Za-z_]\w*|[\d.]+|[^\s\w]+/g)) {
      found.push({ text, node, index, symbol });
    }
  }
  return found;
}

// which tokens of two lists are common to both, in order: a longest common subsequence
function common(a, b) {
  const length = Array.from({ length: a.length + 1 }, () => new Array(b.length + 1).fill(0));
  for (let i = a.length - 1; i >= 0; i--) {
    for (let j = b.length - 1; j >= 0; j--) {
      length[i][j] = a[i].text === b[j].text ? length[i + 1][j + 1] + 1 : Math.max(length[i + 1][j], length[i][j + 1]);
    }
  }
  const kept = new Set();
  for (let i = 0, j = 0; i < a.length && j < b.length;) {
    if (a[i].text === b[j].text) {
      kept.add(a[i++]).add(b[j++]);
    } else if (length[i + 1][j] >= length[i][j + 1]) i++;
    else j++;
  }
  return kept;
}

// pieces of code in words: "`a`, `b` and `c`", each once
function codesListed(pieces) {
  const codes = [...new Set(pieces)].map((text) => Object.assign(document.createElement("code"), { textContent: text }));
  return codes.flatMap((code, i) => (i === 0 ? [code] : [i === codes.length - 1 ? " and " : ", ", code]));
}

// what a program alone has in a statement: neighbours together, without the symbols that both name
function alone(found, kept, both) {
  const pieces = [];
  let before = null;
  for (const token of found) {
    const own = !kept.has(token) && !both.has(token.symbol);
    if (own && before !== null) pieces.push(`${pieces.pop()} ${token.text}`);
    else if (own) pieces.push(token.text);
    before = own ? token : null;
  }
  return pieces;
}

// the difference of two statements as a sentence
function inWords([a, b], kept, [one, other]) {
  const spelled = (found) => new Map(found.filter((token) => token.symbol && !kept.has(token)).map(({ symbol, text }) => [symbol, text]));
  const [mine, theirs] = [spelled(a), spelled(b)];
  const both = new Set([...mine.keys()].filter((symbol) => theirs.has(symbol)));
  const parts = [[one, alone(a, kept, both)], [other, alone(b, kept, both)]].filter(([, pieces]) => pieces.length > 0)
    .map(([name, pieces]) => [`${name} alone has `, ...codesListed(pieces)]);
  if (both.size > 0) {
    const names = (found) => codesListed([...both].map((symbol) => found.get(symbol)));
    parts.push([`${one} writes `, ...names(mine), ` where ${other} writes `, ...names(theirs)]);
  }
  if (parts.length === 0) return [`${one} and ${other} write the same.`];
  return [...parts.flatMap((part) => [...part, "; "]), "the rest is the same, in the same order."];
}

// of two programs, what their statements share is dimmed, what differs is marked, and said
function markDifferences(names) {
  const [same, differs] = CSS.highlights ? [new Highlight(), new Highlight()] : [new Set(), new Set()];
  const languages = names.map((name) => codeButtons.find((button) => button.dataset.code === name).textContent.trim());
  for (const said of all(".difference", codeSection)) said.remove();
  for (const row of names.length === 2 ? all(".row", codeSection) : []) {
    const codes = names.map((name) => row.querySelector(`[data-port="${name}"] code`)).filter(Boolean);
    const [a, b] = [...codes.map(tokens), [], []];
    const kept = common(a, b);
    if (codes.length === 2) {
      const said = Object.assign(document.createElement("p"), { className: "difference" });
      said.append(...inWords([a, b], kept, languages));
      row.querySelector(".beside").append(said);
    }
    for (const token of [...a, ...b]) {
      const range = new Range();
      range.setStart(token.node, token.index);
      range.setEnd(token.node, token.index + token.text.length);
      (kept.has(token) ? same : differs).add(range);
    }
  }
  CSS.highlights?.set("same", same);
  CSS.highlights?.set("differs", differs);
}

function choose(names) {
  keepingPlace(() => {
    chosenCode = names;
    showCode();
  });
  address.set({ compare: names.join(",") || null });
}

for (const button of codeButtons) {
  button.addEventListener("click", () => {
    const name = button.dataset.code;
    if (chosenCode.length === everyProgram.length) choose([name]); // of all, the first choice
    else choose(everyProgram.filter((other) => chosenCode.includes(other) !== (other === name)));
  });
}
document.getElementById("all-languages")?.addEventListener("click", () => choose(narrow.matches ? everyProgram : []));
address.obey("compare", (asked) => {
  const names = everyProgram.filter((name) => asked.split(",").includes(name));
  if (names.length > 0) choose(names);
});
narrow.addEventListener("change", showCode);
if (narrow.matches) showCode();

for (const button of all(".copy")) {
  button.addEventListener("click", async () => {
    const { href } = button.parentElement.querySelector("a");
    const data = href.slice(href.indexOf(",") + 1);
    await navigator.clipboard.writeText(decodeURIComponent(data));
    button.textContent = "Copied";
    setTimeout(() => { button.textContent = "Copy"; }, 1500);
  });
}
