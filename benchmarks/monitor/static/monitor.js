// News: a page names what it shows; when that changes, its parts are fetched again and replaced.
"use strict";

// Calls renew for each change that an address tells of, and when the server is back; with atOnce,
// also when it is reached first.
const listen = (address, renew, atOnce) => {
  let lost = atOnce;
  const open = () => {
    const source = new EventSource(address);
    source.addEventListener("change", renew);
    source.onopen = () => { if (lost) { lost = false; renew(null); } };
    source.onerror = () => {
      lost = true;
      if (source.readyState === EventSource.CLOSED) { source.close(); setTimeout(open, 1000); }
    };
  };
  open();
};

const live = document.body.dataset.live;
if (live) {
  let busy = false, again = false;
  const renew = async () => {
    if (busy) { again = true; return; }
    busy = true;
    try {
      const answer = await fetch(location.href, { headers: { Accept: "text/html" } });
      if (answer.ok) {
        const page = new DOMParser().parseFromString(await answer.text(), "text/html");
        for (const fresh of page.querySelectorAll("[data-part]")) {
          const old = document.getElementById(fresh.id);
          if (old && old.innerHTML !== fresh.innerHTML) {
            const focused = old.contains(document.activeElement) ? document.activeElement : null;
            const address = focused && focused.getAttribute("href");
            old.innerHTML = fresh.innerHTML;
            if (address) {
              for (const link of old.querySelectorAll("a"))
                if (link.getAttribute("href") === address) { link.focus({ preventScroll: true }); break; }
            }
          }
        }
      }
    } catch (error) {
      // The server is away; the stream below says when it is back.
    } finally {
      busy = false;
      if (again) { again = false; setTimeout(renew, 300); }
    }
  };
  listen("/live?of=" + encodeURIComponent(live), renew, false);
}
