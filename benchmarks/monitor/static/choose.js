// What to play: the types and the tasks that can be chosen are those of the suite and the type that are chosen.
"use strict";

const form = document.getElementById("choose");
if (form) {
  const { suite, type, task } = form.elements;
  let asked = 0;
  const choose = async (changed) => {
    if (changed !== suite && changed !== type) return;
    const number = ++asked;
    task.replaceChildren(task.options[0]);  // what is chosen now holds at once
    task.value = "";
    if (changed === suite) type.value = "";
    try {
      const answer = await fetch("/play?" + new URLSearchParams({ suite: suite.value, type: type.value }));
      const page = new DOMParser().parseFromString(await answer.text(), "text/html");
      const fresh = page.getElementById("choose");
      if (number !== asked || !fresh) return;
      // Each option that leaves its own list has been chosen there in its turn, so all of them are here.
      task.replaceChildren(...fresh.elements.task.children);
      task.value = "";
      if (changed === suite) {
        type.replaceChildren(...fresh.elements.type.children);
        type.value = "";
      }
      document.getElementById("about").textContent = page.getElementById("about").textContent;
    } catch (error) {
      // The server is away: the next task of the choice can still be begun once it is back.
    }
  };
  form.addEventListener("change", (event) => choose(event.target));
  // What was chosen before this script had arrived, or was restored by the browser, changes nothing more.
  const asServed = ({ options }) => [...options].find((option) => option.defaultSelected) ?? options[0];
  choose([suite, type].find((select) => select.selectedOptions[0] !== asServed(select)));
}
