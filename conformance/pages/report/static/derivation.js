// SPDX-License-Identifier: MIT
// The language of the statements beside the derivation; what a term of V' points at.
"use strict";

const leadButtons = all("[data-choose-lead]");

function chooseLead(name) {
  if (!leadButtons.some((button) => button.dataset.chooseLead === name)) return;
  keepingPlace(() => {
    document.documentElement.dataset.lead = name;
    if (narrow.matches) showCode(); // as the statements beside the derivation
  });
  address.set({ in: name });
  for (const button of leadButtons) press(button, button.dataset.chooseLead === name);
}

for (const button of leadButtons) {
  button.addEventListener("click", () => chooseLead(button.dataset.chooseLead));
}
address.obey("in", chooseLead);

// a term shows the statement that holds what is against it, at the pointer and where the address leads to it
function showAnswer(term, on) {
  const { by } = term.dataset;
  term.closest(".derivation-step").querySelector(`.statement[data-row="${by}"]`)?.classList.toggle("lit", on);
}

const answered = all("[data-by]");
for (const term of answered) {
  for (const [event, on] of [["pointerenter", true], ["pointerleave", false]]) {
    term.addEventListener(event, () => showAnswer(term, on));
  }
}

function showTarget() {
  const target = answered.find((term) => term.matches(":target"));
  for (const statement of all(".statement.lit")) statement.classList.remove("lit");
  if (target !== undefined) showAnswer(target, true);
}
addEventListener("hashchange", showTarget);
showTarget();
