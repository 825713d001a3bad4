// SPDX-License-Identifier: MIT
// The programs side by side.
"use strict";

const codeButtons = all("[data-code]");

function showCode() {
  const shown = codeButtons.filter(pressed).map((button) => button.dataset.code);
  document.getElementById("code").style.setProperty("--columns", Math.max(1, shown.length));
  for (const column of all("#code .column")) column.hidden = !shown.includes(column.dataset.port);
}

const fitting = innerWidth < 1100 ? 2 : innerWidth < 1700 ? 3 : codeButtons.length;
codeButtons.forEach((button, i) => {
  press(button, i < fitting);
  button.addEventListener("click", () => {
    press(button, !pressed(button));
    showCode();
  });
});
showCode();

for (const button of all(".copy")) {
  button.addEventListener("click", async () => {
    await navigator.clipboard.writeText(button.closest(".column").querySelector("pre").textContent);
    button.textContent = "Copied";
    setTimeout(() => { button.textContent = "Copy"; }, 1500);
  });
}
