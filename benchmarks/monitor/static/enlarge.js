// A picture that is clicked is shown as large as the window; a click, Enter or Esc closes it.
"use strict";

document.addEventListener("click", (event) => {
  if (event.ctrlKey || event.metaKey || event.shiftKey) return;
  const picture = event.target.closest("dialog.large") ? null : event.target.closest(".pictures img") ||
    (event.target.closest("a.enlarge") || document.createElement("a")).querySelector("img");
  if (!picture) return;
  event.preventDefault();
  const large = document.createElement("dialog"), image = document.createElement("img");
  large.className = "large";
  image.src = picture.src;
  image.alt = picture.alt;
  large.append(image);
  large.tabIndex = 0;
  const before = document.activeElement;
  large.addEventListener("click", () => large.close());
  large.addEventListener("keydown", (key) => { if (key.key === "Enter") { key.preventDefault(); large.close(); } });
  large.addEventListener("close", () => { large.remove(); if (before && before.isConnected) before.focus({ preventScroll: true }); });
  document.body.append(large);
  large.showModal();
});
