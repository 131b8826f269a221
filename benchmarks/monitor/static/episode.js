// An episode: slider, buttons and keys choose a step, or it plays by itself; pictures are loaded when
// they are shown. Two episodes beside each other move together; one that is under way grows.
"use strict";

const numbers = (text) => (text ? text.split(",").map(Number) : []);

const setUp = (player, moved) => {
  const all = (name) => [...player.querySelectorAll(`[data-${name}]`)], one = (name) => all(name)[0];
  const slider = one("slider"), map = one("map"), frame = one("frame"), view = one("view");
  const list = player.querySelector(".steps");
  const last = () => Number(player.dataset.last);
  const show = (number, scroll) => {
    const output = one("number"), steps = all("step");
    const now = Math.max(0, Math.min(last(), number));
    slider.value = now;
    output.textContent = output.dataset.words.replace("#", now);
    const done = new Set(), here = steps[now];
    // The picture and the place at which the step was decided stand beside its thoughts.
    const seen = numbers(here && here.dataset.pictures), stood = here ? Number(here.dataset.stand) : 0;
    steps.forEach((step, place) => {
      step.classList.toggle("now", place === now);
      if (place <= now) numbers(step.dataset.done).forEach((each) => done.add(each));
    });
    const drawn = view ? view.value : "";
    for (const picture of all("picture")) {
      const shown = !drawn && seen.includes(Number(picture.dataset.picture));
      if (shown && !picture.src) picture.src = picture.dataset.src;
      picture.hidden = !shown;
    }
    if (frame) {
      const address = frame.dataset.frame + `&n=${stood}&what=${drawn}`;
      if (drawn && frame.getAttribute("src") !== address) frame.src = address;
      frame.hidden = !drawn;
      for (const words of all("draw")) {  // nothing was shown, so there is a choice once something is drawn
        words.parentElement.hidden = Boolean(drawn);
        view.parentElement.hidden = !drawn;
      }
    }
    all("key-action").forEach((each, place) => each.classList.toggle("done", done.has(place)));
    for (const stand of map.querySelectorAll("[data-map-step]"))
      stand.classList.toggle("now", Number(stand.dataset.mapStep) === stood);
    const way = map.querySelector(".to-come");
    if (way) map.querySelector(".past").setAttribute("points", way.getAttribute("points").split(" ").slice(0, stood + 1).join(" "));
    if (scroll && here && list.scrollHeight > list.clientHeight)  // the list alone scrolls, not the page
      list.scrollTop = here.offsetTop - list.offsetTop - list.clientHeight / 3;
  };
  const drawMap = () => map.dataset.map && fetch(map.dataset.map).then((answer) => (answer.ok ? answer.text() : "")).then((text) => {
    map.innerHTML = text;
    map.removeAttribute("data-wait");
    show(Number(slider.value), false);
  }).catch(() => map.removeAttribute("data-wait"));
  slider.addEventListener("input", () => moved(Number(slider.value), true));
  for (const button of all("move"))
    button.addEventListener("click", () => moved(Number(slider.value) + Number(button.dataset.move), true));
  list.addEventListener("click", (event) => {
    const step = event.target.closest("[data-step]");
    if (step) moved(Number(step.dataset.step), false);
  });
  one("hidden").addEventListener("change", (event) => map.classList.toggle("with-hidden", event.target.checked));
  if (view) view.addEventListener("change", () => show(Number(slider.value), false));
  for (const button of all("draw")) button.addEventListener("click", () => { view.value = "rgb"; show(Number(slider.value), false); });
  drawMap();
  return { slider, show, drawMap, get last() { return last(); } };
};

const players = [];
const longest = () => Math.max(...players.map((each) => each.last));
let now = 0;
const moveTo = (number, scroll) => {
  now = Math.max(0, Math.min(longest(), number));
  for (const each of players) each.show(now, scroll);
  history.replaceState(null, "", "#step-" + now);
};
for (const player of document.querySelectorAll("[data-player]")) players.push(setUp(player, moveTo));
if (players.length) {
  // All play buttons are one: both episodes of a comparison move together.
  const buttons = [...document.querySelectorAll("[data-play]")], speeds = [...document.querySelectorAll("[data-speed]")];
  let timer = 0;
  const play = (on) => {
    clearTimeout(timer);
    timer = 0;
    for (const button of buttons) { button.textContent = on ? "❚❚" : "▷"; button.setAttribute("aria-pressed", on); }
    if (!on) return;
    if (now >= longest()) moveTo(0, true);
    const next = () => {
      moveTo(now + 1, true);
      if (now >= longest()) play(false); else timer = setTimeout(next, 1000 / Number(speeds[0].value));
    };
    timer = setTimeout(next, 1000 / Number(speeds[0].value));
  };
  for (const button of buttons) button.addEventListener("click", () => play(!timer));
  for (const speed of speeds) speed.addEventListener("change", () => { for (const each of speeds) each.value = speed.value; });
  document.addEventListener("keydown", (event) => {
    const onSlider = players.some((each) => each.slider === event.target);
    if (event.altKey || event.ctrlKey || event.metaKey || /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName) && !onSlider) return;
    const to = { ArrowLeft: now - 1, ArrowRight: now + 1, Home: 0, End: longest() }[event.key];
    if (to !== undefined) { event.preventDefault(); play(false); moveTo(to, true); }
    if (event.key === "p") play(!timer);
    const link = document.querySelector(`a[data-key="${event.key === "j" || event.key === "k" ? event.key : "-"}"]`);
    if (link) location.href = link.href;
  });
  for (const link of document.querySelectorAll("[data-go]"))
    link.addEventListener("click", (event) => { event.preventDefault(); moveTo(Number(link.dataset.go), true); });
  // News of an episode that is under way: whoever looks at its last step goes on with it.
  let before = longest();
  document.addEventListener("renewed", () => {
    const grown = longest() !== before;
    moveTo(now === before ? longest() : now, grown && now === before);
    if (grown) for (const each of players) each.drawMap();
    before = longest();
  });
  const asked = /^#(?:[a-z]+-)?step-(\d+)$/.exec(location.hash);
  if (asked) {
    moveTo(Number(asked[1]), true);
    // The browser goes to the step alone; its picture is to be seen with it.
    addEventListener("load", () => document.querySelector("[data-player]").scrollIntoView());
  } else if (document.querySelector("[data-under-way]")) moveTo(longest(), true);
  else players.forEach((each) => each.show(0, false));
}
