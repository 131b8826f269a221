// A page names what it shows; when that changes, its parts are fetched again and renewed.
"use strict";

// Calls renew whenever an address answers otherwise than it did, at first than what is known. It
// asks again and again, since a connection that stays open would be one of the six that a browser
// has for all pages of a server. A page that nobody sees does not ask. Where no answer comes, a line
// of the page says so until one does.
const follow = (address, known, pause, renew) => {
  let asking = false, timer = 0;
  const away = document.getElementById("away");
  const look = async () => {
    clearTimeout(timer);
    if (document.hidden || asking) return;
    asking = true;
    try {
      const answer = await fetch(address, { signal: AbortSignal.timeout(20000) });
      const now = answer.ok ? await answer.text() : `${answer.status}`;
      away.hidden = true;
      if (now !== known) { await renew(now); known = now; }
    } catch (error) {
      away.hidden = false;  // it is asked until it is back
    } finally {
      asking = false;
      timer = setTimeout(look, pause);
    }
  };
  document.addEventListener("visibilitychange", look);
  look();
};

// What an element is known by among its siblings.
const nameOf = (node) =>
  node.nodeType !== Node.ELEMENT_NODE ? "" : node.id || node.dataset.row || (node.classList.contains("scroll") ? "scroll" : "");

// Makes a node like a fresh one, and leaves in place what is the same: it stays scrolled, opened and
// focused as the reader left it.
const turnInto = (old, fresh) => {
  if (old.nodeType !== Node.ELEMENT_NODE) {
    if (old.data !== fresh.data) old.data = fresh.data;
    return;
  }
  if (old.hasAttribute("data-own")) return;  // what it holds is a script's
  for (const { name } of [...old.attributes]) if (name !== "open" && !fresh.hasAttribute(name)) old.removeAttribute(name);
  for (const { name, value } of fresh.attributes) if (name !== "open" && old.getAttribute(name) !== value) old.setAttribute(name, value);
  const wanted = new Set([...fresh.childNodes].map(nameOf)), named = new Map();
  for (const child of old.childNodes) if (nameOf(child)) named.set(nameOf(child), child);
  let at = old.firstChild;
  const passOver = (node) => { at = node.nextSibling; node.remove(); };
  for (const child of fresh.childNodes) {
    const name = nameOf(child), same = name ? named.get(name) : null;
    while (at && nameOf(at) && !wanted.has(nameOf(at))) passOver(at);
    // What stands before it is removed, rather than it be moved: a node that moves loses all that.
    while (same && at && at !== same && !nameOf(at)) passOver(at);
    const kept = same || (at && !name && !nameOf(at) && at.nodeName === child.nodeName ? at : null);
    if (!kept) { old.insertBefore(document.importNode(child, true), at); continue; }
    named.delete(name);
    if (kept !== at) old.insertBefore(kept, at);
    turnInto(kept, child);
    at = kept.nextSibling;
  }
  while (at) passOver(at);
};

const live = document.body.dataset.live;
if (live) {
  let waits = false;
  // A part in which text is selected waits, so that it can be copied.
  const isSelected = (part) => {
    const selection = getSelection();
    return !selection.isCollapsed && selection.rangeCount > 0 && selection.getRangeAt(0).intersectsNode(part);
  };
  const renew = async () => {
    const answer = await fetch(location.href, { headers: { Accept: "text/html" } });
    if (answer.status >= 500) throw new Error(answer.statusText);
    const page = new DOMParser().parseFromString(await answer.text(), "text/html");
    waits = false;
    const parts = [...page.querySelectorAll("[data-part]")];
    // The directory is gone, or what was under way is over: this is another page now.
    if (!parts.some((fresh) => document.getElementById(fresh.id))) { location.reload(); return; }
    for (const fresh of parts) {
      const old = document.getElementById(fresh.id);
      if (!old || old.isEqualNode(fresh)) continue;
      if (isSelected(old)) waits = true; else turnInto(old, fresh);
    }
    document.dispatchEvent(new Event("renewed"));
  };
  document.addEventListener("selectionchange", () => {
    if (waits && getSelection().isCollapsed) { waits = false; renew().catch(() => { waits = true; }); }
  });
  follow("/live?of=" + encodeURIComponent(live), document.body.dataset.state, 700, renew);
}
