// Notes and tags are saved without leaving the page, which keeps its step and its scrolling.
"use strict";

for (const form of document.querySelectorAll("form[data-notes]")) {
  const said = form.querySelector("output");
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    said.textContent = "…";
    try {
      const answer = await fetch(form.getAttribute("action"), { method: "POST", body: new URLSearchParams(new FormData(form)) });
      said.textContent = answer.ok ? said.dataset.said : await answer.text();
    } catch (error) {
      said.textContent = String(error);
    }
  });
  form.addEventListener("input", () => { said.textContent = ""; });
}
