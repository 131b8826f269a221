// A person plays: forms are sent without leaving the page, news are shown, and keys choose actions.
"use strict";

const board = () => document.getElementById("play");
if (board()) {
  const address = "/play/" + board().dataset.session;
  let sending = false, again = false;
  const typed = [];  // keys that were pressed while an action was on its way: they are for what comes of it

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
    const was = document.activeElement, group = was && was.closest("fieldset[data-verb]");
    const name = (attribute, value) => `[${attribute}="${CSS.escape(value || "")}"]`;
    const inside = board().contains(was);
    board().replaceWith(fresh);
    document.title = page.title;
    for (const details of fresh.querySelectorAll(".played-steps details")) details.open = open.has(details.closest("li").value);
    if (!inside) return;
    const same = was.id ? fresh.querySelector("#" + CSS.escape(was.id)) : was.dataset.press ? fresh.querySelector(name("data-press", was.dataset.press))
      : fresh.querySelector("button" + name("name", "action") + name("value", was.value))
        || (group && fresh.querySelector("fieldset" + name("data-verb", group.dataset.verb) + " button"));
    (same || fresh).focus({ preventScroll: true });
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
      if (board().querySelector(".news .problem, .result")) typed.length = 0;
      while (typed.length && !sending) {
        const key = typed.shift();
        if (!act(key, document.activeElement) && key === "enter" && board().contains(document.activeElement)) document.activeElement.click();
      }
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
  // Does what a key asks for while an element has the focus; false if it asks for nothing here.
  const act = (key, target) => {
    const inside = target.closest && target.closest("fieldset");
    if (key === "escape") { target.blur(); return true; }
    if (inside) {
      const by = { arrowright: 1, arrowdown: 1, arrowleft: -1, arrowup: -1 }[key];
      if (by) { move(target, by); return true; }
      if (/^[a-z]$/.test(key)) {
        const named = [...inside.querySelectorAll("button")].filter((one) => one.textContent.trim().toLowerCase().startsWith(key));
        if (named.length) {
          named[(named.indexOf(target) + 1) % named.length].focus();
          return true;
        }
      }
    }
    if (key === " " && target.tagName === "BUTTON" && !target.dataset.press) return false;
    const pressed = board().querySelector(`[data-press="${CSS.escape(key)}"]`) || (key === " " && board().querySelector('[data-press=" "]'));
    if (pressed) { pressed.click(); return true; }
    const group = /^[a-z]$/.test(key) && board().querySelector(`fieldset[data-verb="${key}"] button, button[data-verb="${key}"]`);
    if (group) group.focus();
    return Boolean(group);
  };
  document.addEventListener("keydown", (event) => {
    if (event.target.id === "typed" && event.key === "Escape") event.target.blur();
    if (event.altKey || event.ctrlKey || event.metaKey || /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName)) return;
    if (document.querySelector("dialog[open]")) return;
    const key = event.key.toLowerCase(), field = document.getElementById("typed");
    if (key === "/" && field && !sending) { event.preventDefault(); field.focus(); return; }
    if (sending && /^([a-z ]|enter|escape|arrow\w+)$/.test(key)) {
      event.preventDefault();
      if (!event.repeat) typed.push(key);
    } else if (act(key, event.target)) event.preventDefault();
  });

  follow(address + "/version", board().dataset.version, 250, renew);  // of monitor.js
}
