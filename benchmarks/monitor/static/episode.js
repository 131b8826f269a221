// An episode: slider, buttons and keys choose a step; pictures are loaded when they are shown.
// Two episodes beside each other move together.
"use strict";

const numbers = (text) => (text ? text.split(",").map(Number) : []);

const setUp = (player, moved) => {
  const last = Number(player.dataset.last);
  const slider = player.querySelector("[data-slider]");
  const output = player.querySelector("[data-number]");
  const steps = [...player.querySelectorAll("[data-step]")];
  const pictures = [...player.querySelectorAll("[data-picture]")];
  const keyActions = [...player.querySelectorAll("[data-key-action]")];
  const map = player.querySelector("[data-map]");
  const frame = player.querySelector("[data-frame]");
  let drawn = false;
  const show = (number, scroll) => {
    const now = Math.max(0, Math.min(last, number));
    slider.value = now;
    output.textContent = output.dataset.words.replace("#", now);
    const done = new Set(), here = steps[now];
    // The picture and the place at which the step was decided stand beside its thoughts.
    const seen = numbers(here && here.dataset.pictures), stood = here ? Number(here.dataset.stand) : 0;
    steps.forEach((step, place) => {
      step.classList.toggle("now", place === now);
      if (place <= now) numbers(step.dataset.done).forEach((one) => done.add(one));
    });
    for (const picture of pictures) {
      const shown = seen.includes(Number(picture.dataset.picture));
      if (shown && !picture.src) picture.src = picture.dataset.src;
      picture.hidden = !shown;
    }
    keyActions.forEach((one, place) => one.classList.toggle("done", done.has(place)));
    for (const stand of map.querySelectorAll("[data-map-step]"))
      stand.classList.toggle("now", Number(stand.dataset.mapStep) === stood);
    const way = map.querySelector(".to-come");
    if (way) map.querySelector(".past").setAttribute("points", way.getAttribute("points").split(" ").slice(0, stood + 1).join(" "));
    if (frame && drawn) { frame.src = frame.dataset.frame + "&n=" + stood; frame.hidden = false; }
    if (scroll && steps[now]) {  // the list alone scrolls, not the page
      const list = steps[now].parentElement;
      if (list.scrollHeight > list.clientHeight)
        list.scrollTop = steps[now].offsetTop - list.offsetTop - list.clientHeight / 3;
    }
  };
  slider.addEventListener("input", () => moved(Number(slider.value), true));
  for (const button of player.querySelectorAll("[data-move]"))
    button.addEventListener("click", () => moved(Number(slider.value) + Number(button.dataset.move), true));
  for (const step of steps) step.addEventListener("click", () => moved(Number(step.dataset.step), false));
  if (map.dataset.map) fetch(map.dataset.map).then((answer) => (answer.ok ? answer.text() : "")).then((text) => {
    map.innerHTML = text;
    map.removeAttribute("data-wait");
    show(Number(slider.value), false);
  }).catch(() => map.removeAttribute("data-wait"));
  player.querySelector("[data-hidden]").addEventListener("change", (event) => map.classList.toggle("with-hidden", event.target.checked));
  const draw = player.querySelector("[data-draw]");
  if (draw) draw.addEventListener("click", () => { drawn = true; draw.parentElement.hidden = true; show(Number(slider.value), false); });
  return { slider, last, show };
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
  document.addEventListener("keydown", (event) => {
    const onSlider = players.some((each) => each.slider === event.target);
    if (event.altKey || event.ctrlKey || event.metaKey || /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName) && !onSlider) return;
    const to = { ArrowLeft: now - 1, ArrowRight: now + 1, Home: 0, End: longest() }[event.key];
    if (to !== undefined) { event.preventDefault(); moveTo(to, true); }
    const link = document.querySelector(`a[data-key="${event.key === "j" || event.key === "k" ? event.key : "-"}"]`);
    if (link) location.href = link.href;
  });
  for (const link of document.querySelectorAll("[data-go]"))
    link.addEventListener("click", (event) => { event.preventDefault(); moveTo(Number(link.dataset.go), true); });
  const asked = /^#(?:[a-z]+-)?step-(\d+)$/.exec(location.hash);
  if (asked) moveTo(Number(asked[1]), true);
  else players.forEach((each) => each.show(0, false));
}
