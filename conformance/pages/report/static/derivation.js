// SPDX-License-Identifier: MIT
// The language of the statements beside the derivation; what a term of V' points at.
"use strict";

const leadButtons = all("[data-choose-lead]");

function chooseLead(name) {
  if (!leadButtons.some((button) => button.dataset.chooseLead === name)) return;
  keepingPlace(() => { document.documentElement.dataset.lead = name; });
  for (const button of leadButtons) press(button, button.dataset.chooseLead === name);
}

for (const button of leadButtons) {
  button.addEventListener("click", () => {
    chooseLead(button.dataset.chooseLead);
    address.set({ in: button.dataset.chooseLead });
  });
}
chooseLead(address.get("in"));

// a term shows the statement that holds what is against it
for (const term of all("[data-by]")) {
  const statement = term.closest(".derivation-step").querySelector(`.statement[data-row="${term.dataset.by}"]`);
  for (const [event, on] of [["pointerenter", true], ["pointerleave", false]]) {
    term.addEventListener(event, () => statement?.classList.toggle("lit", on));
  }
}
