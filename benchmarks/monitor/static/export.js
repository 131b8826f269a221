// An exported run: shows the episode that the address asks for; filters and sorts the rows.
"use strict";

{
  const query = new URLSearchParams(location.search);
  const wanted = query.get("episode");
  for (const one of document.querySelectorAll("template[data-episode]")) {
    if (one.dataset.episode === wanted) {
      document.getElementById("page").replaceChildren(one.content.cloneNode(true));
      document.title = one.dataset.title;
    }
  }
  const form = document.querySelector("form.filter");
  if (form) {
    const body = document.querySelector("#rows tbody");
    const rows = [...body.rows].map((row) => ({ row, told: JSON.parse(row.dataset.values) }));
    const total = document.querySelector("[data-total]");
    const usual = "-ended";
    // The list opens with those that were chosen for replays.
    if (!location.search) for (const [name, value] of new URLSearchParams(total.dataset.first)) query.set(name, value);
    const within = (number, bounds) => {
      const found = /^(\d*)(-?)(\d*)$/.exec(bounds);
      if (!found || bounds === "-") return true;
      const [, low, dash, high] = found;
      if (!dash) return !low || number === Number(low);
      return (!low || number >= Number(low)) && (!high || number <= Number(high));
    };
    const takes = (told) =>
      ["type", "scene", "outcome", "failure", "reason"].every((name) => !query.get(name) || query.get(name) === told[name]) &&
      (!query.get("note") || told.note === query.get("note") || (query.get("note") === "note" && told.note)) &&
      within(told.steps, query.get("steps") || "") &&
      (!query.get("text") || told.text.includes(query.get("text").toLowerCase()));
    const show = () => {
      const sort = query.get("sort") || usual, name = sort.replace(/^-/, ""), turn = sort.startsWith("-") ? -1 : 1;
      const taken = rows.filter(({ told }) => takes(told));
      taken.sort(({ told: { [name]: a } }, { told: { [name]: b } }) => (a < b ? -turn : a > b ? turn : 0));
      body.replaceChildren(...taken.map(({ row }) => row));
      total.textContent = total.dataset.total.replace("#", taken.length);
      for (const field of form.elements) if (field.name) field.value = query.get(field.name) || "";
      for (const head of document.querySelectorAll("#rows th")) {
        const link = head.querySelector("a"), own = new URLSearchParams(link.search).get("sort") || usual;
        const column = own.replace(/^-/, ""), now = column === name;
        const next = new URLSearchParams(query);
        next.set("sort", now && turn > 0 ? "-" + column : column);
        link.href = "?" + next;
        link.textContent = link.textContent.replace(/ [▾▴]$/, "") + (now ? (turn < 0 ? " ▾" : " ▴") : "");
        if (now) head.setAttribute("aria-sort", turn < 0 ? "descending" : "ascending");
        else head.removeAttribute("aria-sort");
      }
    };
    const go = (search) => {
      for (const name of [...query.keys()]) query.delete(name);
      for (const [name, value] of new URLSearchParams(search)) if (value && name !== "episode") query.set(name, value);
      show();
    };
    const went = (search) => { history.pushState(null, "", search || "?"); go(search); };
    form.addEventListener("submit", (event) => { event.preventDefault(); went("?" + new URLSearchParams([...new FormData(form)].filter(([, value]) => value))); });
    document.addEventListener("click", (event) => {
      const link = event.target.closest("a[href^='?']");
      if (!link || event.ctrlKey || event.metaKey || event.shiftKey || new URLSearchParams(link.search).has("episode")) return;
      event.preventDefault();
      went(link.getAttribute("href"));
    });
    addEventListener("popstate", () => go(location.search));
    show();
  }
}
