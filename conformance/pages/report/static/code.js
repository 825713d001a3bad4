// SPDX-License-Identifier: MIT
// The programs side by side: which are shown, and what two of them share.
"use strict";

const codeButtons = all("[data-code]");
const codeSection = document.getElementById("code");

function shownCode() {
  return codeButtons.filter(pressed).map((button) => button.dataset.code);
}

function showCode(names) {
  keepingPlace(() => {
    for (const button of codeButtons) press(button, names.includes(button.dataset.code));
    for (const place of all("[data-port]:not(button)", codeSection)) place.hidden = !names.includes(place.dataset.port);
    codeSection.classList.toggle("two", names.length === 2);
  });
  markDifferences(names);
}

// the names and signs of a piece of code, each with where it stands
function tokens(code) {
  const found = [];
  const walker = document.createTreeWalker(code, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    for (const { 0: text, index } of walker.currentNode.data.matchAll(/[A-Za-z_]\w*|[\d.]+|[^\s\w]+/g)) {
      found.push({ text, node: walker.currentNode, index });
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

// of two programs, what their statements share is dimmed and what differs is marked
function markDifferences(names) {
  if (CSS.highlights === undefined) return;
  const [same, differs] = [new Highlight(), new Highlight()];
  for (const row of names.length === 2 ? all(".row", codeSection) : []) {
    const [a, b] = names.map((name) => row.querySelector(`[data-port="${name}"] code`)).map((code) => (code ? tokens(code) : []));
    const kept = common(a, b);
    for (const token of [...a, ...b]) {
      const range = new Range();
      range.setStart(token.node, token.index);
      range.setEnd(token.node, token.index + token.text.length);
      (kept.has(token) ? same : differs).add(range);
    }
  }
  CSS.highlights.set("same", same);
  CSS.highlights.set("differs", differs);
}

function choose(names) {
  showCode(names);
  address.set({ compare: names.length === codeButtons.length ? null : names.join(",") });
}

const everyProgram = codeButtons.map((button) => button.dataset.code);
for (const button of codeButtons) {
  button.addEventListener("click", () => {
    const name = button.dataset.code;
    const names = shownCode();
    if (names.length === everyProgram.length) choose([name]); // of all, the first choice
    else if (names.includes(name)) choose(names.length > 1 ? names.filter((other) => other !== name) : everyProgram);
    else choose(everyProgram.filter((other) => other === name || names.includes(other)));
  });
}
document.getElementById("all-languages")?.addEventListener("click", () => choose(everyProgram));
const asked = address.get("compare")?.split(",") ?? [];
const comparable = everyProgram.filter((name) => asked.includes(name));
if (comparable.length > 0) showCode(comparable);

for (const button of all(".copy")) {
  button.addEventListener("click", async () => {
    const [, data] = button.parentElement.querySelector("a").href.split(",");
    const bytes = Uint8Array.from(atob(data), (c) => c.charCodeAt(0));
    await navigator.clipboard.writeText(new TextDecoder().decode(bytes));
    button.textContent = "Copied";
    setTimeout(() => { button.textContent = "Copy"; }, 1500);
  });
}
