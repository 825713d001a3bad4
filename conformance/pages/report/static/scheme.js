// SPDX-License-Identifier: MIT
// Light or dark: as the system has it until the reader turns it over, and so again at his next visit where the browser
// keeps anything. What he has chosen is there before the page is drawn; what draws by script hears of each change.
"use strict";

{
  const system = matchMedia("(prefers-color-scheme: dark)");
  const { dataset } = document.documentElement;
  const kept = (use) => {
    try {
      return use(localStorage);
    } catch { // where it keeps nothing
      return null;
    }
  };
  const systems = () => (system.matches ? "dark" : "light");
  const seen = () => dataset.scheme ?? systems();
  const showSwitch = () => document.getElementById("scheme")?.setAttribute("aria-pressed", seen() === "dark");
  const changed = () => {
    showSwitch();
    dispatchEvent(new Event("scheme"));
  };
  const turnOver = () => {
    const other = seen() === "dark" ? "light" : "dark";
    if (other === systems()) {
      delete dataset.scheme;
      kept((storage) => storage.removeItem("scheme"));
    } else {
      dataset.scheme = other;
      kept((storage) => storage.setItem("scheme", other));
    }
    changed();
  };

  const chosen = kept((storage) => storage.getItem("scheme"));
  if (["light", "dark"].includes(chosen)) dataset.scheme = chosen;
  addEventListener("DOMContentLoaded", showSwitch);
  system.addEventListener("change", changed);
  document.addEventListener("click", ({ target }) => {
    if (target.closest("#scheme")) turnOver();
  });
}
