// A person plays: forms are sent without leaving the page, news are shown, and keys choose actions.
"use strict";

const board = () => document.getElementById("play");
if (board()) {
  const address = "/play/" + board().dataset.session;
  let sending = false, again = false;

  // What the page asked for by itself (news) must be newer: else the focus is lost between two keys.
  const take = async (text, news) => {
    const page = new DOMParser().parseFromString(text, "text/html");
    if (!page.getElementById("play")) { location.reload(); return; }
    const fresh = document.importNode(page.getElementById("play"), true);
    const stale = () => Number(fresh.dataset.version) - Number(board().dataset.version) < (news ? 1 : 0);
    if (stale()) return;
    // The old pictures stay until the new ones are there.
    const pictures = [...fresh.querySelectorAll("img")].map((one) => one.decode());
    await Promise.race([Promise.allSettled(pictures), new Promise((done) => setTimeout(done, 2000))]);
    if (stale()) return;
    // What was opened, and the focus, stay where they are.
    const open = new Set([...board().querySelectorAll(".played-steps details[open]")].map((one) => one.closest("li").value));
    const pressed = document.activeElement && document.activeElement.dataset.press;
    board().replaceWith(fresh);
    document.title = page.title;
    for (const details of fresh.querySelectorAll(".played-steps details")) details.open = open.has(details.closest("li").value);
    if (pressed) { const button = fresh.querySelector(`[data-press="${pressed}"]`); if (button) button.focus({ preventScroll: true }); }
  };
  const renew = async (version) => {
    if (version === board().dataset.version) return;
    if (sending) { again = true; return; }
    const answer = await fetch(address, { headers: { Accept: "text/html" } });
    const text = await answer.text();
    if (sending) again = true; else await take(text, true);
  };
  const send = async (form, submitter) => {
    if (sending) return;
    sending = true;
    board().dataset.busy = "";
    const fields = new URLSearchParams(new FormData(form));
    if (submitter && submitter.name) fields.set(submitter.name, submitter.value);
    try {
      const answer = await fetch(form.getAttribute("action"), { method: "POST", body: fields });
      const text = await answer.text();
      if ((answer.headers.get("content-type") || "").startsWith("text/html")) await take(text, false); else location.reload();
    } catch (error) {
      delete board().dataset.busy;
    } finally {
      sending = false;
      if (again) { again = false; renew("").catch(() => {}); }
    }
  };
  document.addEventListener("submit", (event) => {
    if (!board().contains(event.target)) return;
    event.preventDefault();
    send(event.target, event.submitter);
  });

  const move = (button, by) => {
    const all = [...board().querySelectorAll("fieldset button")];
    const next = all[(all.indexOf(button) + by + all.length) % all.length];
    if (next) next.focus();
  };
  document.addEventListener("keydown", (event) => {
    if (event.altKey || event.ctrlKey || event.metaKey || /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName)) return;
    const key = event.key.toLowerCase();
    const inside = event.target.closest && event.target.closest("fieldset");
    if (key === "escape") { if (document.activeElement) document.activeElement.blur(); return; }
    if (inside) {
      const by = { arrowright: 1, arrowdown: 1, arrowleft: -1, arrowup: -1 }[key];
      if (by) { event.preventDefault(); move(event.target, by); return; }
      if (/^[a-z]$/.test(key)) {
        const named = [...inside.querySelectorAll("button")].filter((one) => one.textContent.trim().toLowerCase().startsWith(key));
        if (named.length) {
          event.preventDefault();
          named[(named.indexOf(event.target) + 1) % named.length].focus();
          return;
        }
      }
    }
    if (key === " " && event.target.tagName === "BUTTON" && !event.target.dataset.press) return;
    const pressed = board().querySelector(`[data-press="${CSS.escape(key)}"]`) || (key === " " && board().querySelector('[data-press=" "]'));
    if (pressed) { event.preventDefault(); pressed.click(); return; }
    const group = /^[a-z]$/.test(key) && board().querySelector(`fieldset[data-verb="${key}"] button, button[data-verb="${key}"]`);
    if (group) { event.preventDefault(); group.focus(); }
  });

  follow(address + "/version", board().dataset.version, 250, renew);  // of monitor.js
}
