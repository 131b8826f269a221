// Curves of several training runs over one another: smoothed, on logarithmic axes, zoomed by dragging.
// uPlot draws them; what it draws comes from the server as points.
"use strict";

const board = document.getElementById("curves");
if (board) {
  const controls = document.getElementById("curve-controls").elements;
  const DASHES = [[], [7, 3], [2, 3], [9, 3, 2, 3], [4, 2], [12, 4], [1, 2], [6, 2, 1, 2]];
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  let runs = [], charts = [];

  // An exponential mean that is not drawn to its beginning, as TensorBoard's.
  const smoothed = (ys, weight) => {
    let sum = 0, norm = 0;
    return ys.map((y) => {
      if (y == null || !weight) return y;
      sum = sum * weight + y * (1 - weight);
      norm = norm * weight + (1 - weight);
      return sum / norm;
    });
  };
  const compact = new Intl.NumberFormat("en", { notation: "compact", maximumFractionDigits: 3 });
  const written = (ticks) => {
    const large = Math.max(...ticks.map((tick) => Math.abs(tick ?? 0))) >= 1e4;
    return ticks.map((tick) => (tick == null ? "" : large ? compact.format(tick) : String(Number(tick.toPrecision(6)))));
  };
  const at = (xs, ys, x) => {
    if (x < xs[0] || x > xs[xs.length - 1]) return null;
    let high = xs.findIndex((each) => each >= x);
    if (high <= 0) return ys[0];
    const share = (x - xs[high - 1]) / (xs[high] - xs[high - 1] || 1);
    return ys[high - 1] + share * (ys[high] - ys[high - 1]);
  };
  // Runs that differ in their seed alone become their mean, with the range of all of them.
  const pooled = (lines) => {
    const groups = new Map();
    for (const line of lines) groups.set(line.group, [...(groups.get(line.group) || []), line]);
    return [...groups.values()].map((some) => {
      if (some.length === 1) return some[0];
      const xs = [...new Set(some.flatMap((line) => line.xs))].sort((a, b) => a - b);
      const all = xs.map((x) => some.map((line) => at(line.xs, line.ys, x)).filter((y) => y != null));
      const mean = all.map((ys) => ys.reduce((a, b) => a + b, 0) / ys.length);
      return { ...some[0], name: `${some[0].name} … × ${some.length}`, xs, ys: mean,
               low: all.map((ys) => Math.min(...ys)), high: all.map((ys) => Math.max(...ys)) };
    });
  };
  const linesOf = (name) => {
    let lines = runs.filter((run) => run.series[name]).map((run) => {
      const [xs, ys] = run.series[name];
      return { name: run.name, group: run.group, style: run.style, xs, ys: smoothed(ys, Number(controls.smooth.value)) };
    });
    if (controls.pool.checked) lines = pooled(lines);
    const logX = controls.logx.checked, logY = controls.logy.checked;
    const positive = (ys) => ys.map((y) => (logY && !(y > 0) ? null : y));
    return lines.map((line) => {
      const kept = line.xs.map((x, place) => place).filter((place) => !logX || line.xs[place] > 0);
      const pick = (values) => values && positive(kept.map((place) => values[place]));
      return { ...line, xs: kept.map((place) => line.xs[place]), ys: pick(line.ys), low: pick(line.low), high: pick(line.high) };
    }).filter((line) => line.ys.some((y) => y != null));
  };
  const draw = () => {
    for (const chart of charts) chart.destroy();
    charts = [];
    // What tells most comes first, and what most runs have.
    const rank = (name) => [/success/, /rew|return/, /loss/, /^(?!.*(seconds|fps|epoch|memory))/].findIndex((kind) => kind.test(name)) >>> 0;
    const count = new Map();
    for (const run of runs) for (const name of Object.keys(run.series)) count.set(name, (count.get(name) || 0) + 1);
    const names = [...count.keys()].sort((a, b) => rank(a) - rank(b) || count.get(b) - count.get(a));
    const wanted = controls.only.value.toLowerCase();
    const shown = names.filter((name) => name.toLowerCase().includes(wanted));
    board.replaceChildren();
    document.getElementById("no-curves").hidden = shown.length > 0;
    for (const name of shown) {
      const lines = linesOf(name);
      if (!lines.length) continue;
      const figure = document.createElement("figure"), caption = document.createElement("figcaption"), place = document.createElement("div");
      caption.textContent = name;
      figure.append(caption, place);
      board.append(figure);
      const tables = [], series = [{ label: lines[0].over || controls.over.value }], bands = [];
      for (const line of lines) {
        const stroke = colour(`--s${line.style % 8}`);
        const base = { label: line.name, stroke, width: 1.6, dash: DASHES[line.style % 8], spanGaps: true, points: { show: line.xs.length < 30, size: 5 } };
        tables.push([line.xs, line.ys]);
        series.push(base);
        if (line.low) {
          tables.push([line.xs, line.high], [line.xs, line.low]);
          series.push({ ...base, label: `${line.name}: ${controls.pool.dataset.most}`, width: .5, points: { show: false } }, { ...base, label: `${line.name}: ${controls.pool.dataset.least}`, width: .5, points: { show: false } });
          bands.push({ series: [series.length - 2, series.length - 1], fill: stroke + "2a" });
        }
      }
      const axis = { stroke: colour("--muted"), grid: { stroke: colour("--line"), width: 1 }, ticks: { stroke: colour("--line") } };
      const size = () => ({ width: Math.max(240, place.clientWidth), height: 260 });
      const chart = new uPlot({
        ...size(), series, bands,
        // All charts show the same place, but each is zoomed by itself.
        cursor: { sync: { key: "curves", filters: { pub: (kind) => /^mouse(move|leave)$/.test(kind) } }, drag: { x: true, y: true, uni: 30 } },
        scales: { x: { time: false, distr: controls.logx.checked ? 3 : 1 }, y: { distr: controls.logy.checked ? 3 : 1 } },
        axes: [{ ...axis, values: (self, ticks) => written(ticks) }, { ...axis, size: 64, values: (self, ticks) => written(ticks) }],
      }, uPlot.join(tables), place);
      // The ends of a range need no place in the legend.
      for (const band of bands) for (const number of band.series) chart.root.querySelectorAll(".u-series")[number].hidden = true;
      place.setAttribute("role", "img");
      place.setAttribute("aria-label", name);
      new ResizeObserver(() => { if (chart.width !== size().width) chart.setSize(size()); }).observe(place);
      charts.push(chart);
    }
  };
  const load = async () => {
    const answer = await fetch(board.dataset.points);
    if (!answer.ok) return;
    const told = (await answer.json()).runs, paths = told.map((run) => run.name.split("/"));
    let common = 0;  // folders that all are in need not be said
    while (told.length > 1 && paths.every((path) => path.length > common + 1 && path[common] === paths[0][common])) common++;
    runs = told.map((run, style) => ({ ...run, style, name: paths[style].slice(common).join("/") }));
    draw();
  };
  for (const control of controls) control.addEventListener("input", draw);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  document.addEventListener("renewed", load);
  load();
}
