"use strict";
// The page's behaviour: the table of all trials, and the time histories of the kept ones.
(async function () {
  const byId = (id) => document.getElementById(id);
  const data = JSON.parse(byId("data").textContent);
  const stored = JSON.parse(byId("stored").textContent);
  const element = (tag, text) => {
    const e = document.createElement(tag);
    if (text !== undefined) e.textContent = text;
    return e;
  };

  // ---- all trials ---------------------------------------------------------------------------
  const ROWS = 50; // a page
  const columns = [
    { name: "controller", get: (r) => r.cell.controller, text: true },
    { name: "motion", get: (r) => r.cell.motion, text: true },
    { name: "trial", get: (r) => r.trial },
    { name: "status", get: (r) => data.status[r.cell.status[r.place]], text: true },
    ...data.indices.map((index, i) => ({
      name: index.name, unit: index.unit, get: (r) => r.cell.values[i][r.place],
    })),
  ];
  const rows = data.cells.flatMap((cell) =>
    data.trials.map((trial, place) => ({ cell, trial, place })));
  const filters = columns.map(() => "");
  const state = { sort: null, down: false, page: 0, found: rows };

  const NUMBER = "[-+]?(?:\\d+\\.?\\d*|\\.\\d+)(?:[eE][-+]?\\d+)?";
  const COMPARE = new RegExp(`^(<=|>=|<|>|=)?\\s*(${NUMBER})$`);
  const BETWEEN = new RegExp(`^(${NUMBER})\\s*\\.\\.\\s*(${NUMBER})$`);

  // The test a filter's text stands for; null if it cannot be read.
  function test(column, text) {
    const words = text.trim().toLowerCase();
    if (!words) return () => true;
    if (column.text) return (v) => v.toLowerCase().includes(words);
    const between = words.match(BETWEEN);
    if (between) return (v) => v !== null && v >= +between[1] && v <= +between[2];
    const compare = words.match(COMPARE);
    if (!compare) return null;
    const bound = +compare[2];
    const is = {
      "<": (v) => v < bound, "<=": (v) => v <= bound, ">": (v) => v > bound,
      ">=": (v) => v >= bound, "=": (v) => v === bound,
    }[compare[1] || "="];
    return (v) => v !== null && is(v);
  }

  function update() {
    const tests = columns.map((c, i) => test(c, filters[i]));
    byId("all").querySelectorAll("input").forEach((input, i) =>
      input.setAttribute("aria-invalid", String(tests[i] === null)));
    const used = columns.map((c, i) => [c, tests[i]]).filter(([, t], i) => t && filters[i].trim());
    state.found = rows.filter((r) => used.every(([c, t]) => t(c.get(r))));
    if (state.sort !== null) {
      const { get, text } = columns[state.sort];
      const sign = state.down ? -1 : 1;
      // Diverged trials have no number: last, whichever way the column is sorted.
      state.found.sort((a, b) => {
        const x = get(a), y = get(b);
        if (x === null || y === null) return (x === null) - (y === null);
        return sign * (text ? x.localeCompare(y) : x - y);
      });
    }
    const pages = Math.max(1, Math.ceil(state.found.length / ROWS));
    state.page = Math.min(state.page, pages - 1);
    byId("count").textContent = `${state.found.length} of ${rows.length} runs`;
    byId("page").textContent = `page ${state.page + 1} of ${pages}`;
    byId("previous").disabled = state.page === 0;
    byId("next").disabled = state.page === pages - 1;
    byId("all").querySelectorAll("thead tr:first-child th").forEach((th, i) => {
      const direction = i === state.sort ? (state.down ? "descending" : "ascending") : "none";
      th.setAttribute("aria-sort", direction);
      th.querySelector("span").textContent = { ascending: " ▲", descending: " ▼", none: "" }[direction];
    });
    fill();
  }

  const shown = (v) => (v === null ? "–" : typeof v === "number" ? String(+v.toPrecision(4)) : v);

  function fill() {
    const first = state.page * ROWS;
    byId("all").querySelector("tbody").replaceChildren(
      ...state.found.slice(first, first + ROWS).map((row) => {
        const tr = element("tr");
        columns.forEach((c) => tr.append(element("td", shown(c.get(row)))));
        tr.classList.toggle("kept", find(row.cell.controller, row.cell.motion, row.trial) !== undefined);
        tr.classList.toggle("shown", current !== undefined && row.trial === current.trial &&
          row.cell.controller === current.controller && row.cell.motion === current.motion);
        tr.addEventListener("click", () => pickRow(row));
        return tr;
      }));
  }

  function buildTable() {
    const heads = element("tr"), inputs = element("tr");
    columns.forEach((c, i) => {
      const th = element("th"), button = element("button", c.unit ? `${c.name} [${c.unit}]` : c.name);
      button.type = "button";
      button.append(element("span"));
      button.addEventListener("click", () => {
        state.down = state.sort === i && !state.down;
        state.sort = i;
        update();
      });
      th.append(button);
      heads.append(th);
      const cell = element("th"), input = element("input");
      input.setAttribute("aria-label", `filter ${c.name}`);
      input.placeholder = c.text ? "text" : "<  >  a..b";
      input.addEventListener("input", () => { filters[i] = input.value; state.page = 0; update(); });
      cell.append(input);
      inputs.append(cell);
    });
    byId("all").querySelector("thead").append(heads, inputs);
    byId("previous").addEventListener("click", () => { state.page -= 1; update(); });
    byId("next").addEventListener("click", () => { state.page += 1; update(); });
    byId("clear").addEventListener("click", () => {
      filters.fill("");
      byId("all").querySelectorAll("input").forEach((input) => { input.value = ""; });
      update();
    });
  }

  // ---- time histories -----------------------------------------------------------------------
  const POINTS = 1500; // pairs of points drawn a line, at most
  const COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#000000", "#56B4E9", "#E69F00", "#7F7F7F"];
  const plot = byId("plot");
  let current, lines = [];

  const find = (controller, motion, trial) => stored.find((h) =>
    h.controller === controller && h.motion === motion && h.trial === trial);

  function decode(signal, dt) {
    const bytes = Uint8Array.from(atob(signal.data), (c) => c.charCodeAt(0));
    const view = new DataView(bytes.buffer);
    const values = new Float64Array(bytes.length / 2);
    for (let i = 0; i < values.length; i++) {
      const step = view.getInt16(2 * i, true);
      values[i] = step === -32768 ? NaN : signal.middle + signal.scale * step;
    }
    return { name: signal.name, panel: signal.panel, dt: dt * signal.stride, values };
  }

  // All lines of a run; the measured strokes are target plus error.
  function linesOf(run) {
    const own = run.signals.map((s) => decode(s, run.dt));
    const sums = own.filter((l) => l.panel === "stroke [mm]").map((target) => {
      const actuator = target.name.slice("target ".length);
      const error = own.find((l) => l.name === `error ${actuator}`);
      return { ...target, name: `measured ${actuator}`, values: target.values.map((v, k) => v + error.values[k]) };
    });
    const first = ["stroke [mm]", "error [mm]", "coefficient [–]"];
    const panels = [...first, ...own.map((l) => l.panel)];
    return [...new Set(panels)].flatMap((p) => [...own, ...sums].filter((l) => l.panel === p));
  }

  // Points of a line inside [from, to]: all, or the lowest and the highest of equal stretches.
  function visible(line, from, to) {
    const n = line.values.length;
    const first = Math.max(0, Math.floor(from / line.dt) - 1);
    const last = Math.min(n - 1, Math.ceil(to / line.dt) + 1);
    const x = [], y = [];
    const put = (k) => { x.push(k * line.dt); y.push(line.values[k]); };
    const width = Math.ceil((last - first + 1) / POINTS);
    for (let k = first; k <= last; k += width) {
      let low = k, high = k;
      for (let j = k; j < Math.min(k + width, last + 1); j++) {
        if (line.values[j] < line.values[low]) low = j;
        if (line.values[j] > line.values[high]) high = j;
      }
      put(Math.min(low, high));
      if (low !== high) put(Math.max(low, high));
    }
    return { x, y };
  }

  function draw() {
    const panels = [...new Set(lines.map((l) => l.panel))];
    const end = (current.samples - 1) * current.dt;
    const gap = 0.025, height = (1 - gap * (panels.length - 1)) / panels.length;
    const layout = {
      margin: { l: 62, r: 12, t: 34, b: 42 }, hovermode: "x", dragmode: "zoom",
      legend: window.innerWidth > 900 ? { font: { size: 10 }, tracegroupgap: 10 }
        : { font: { size: 10 }, orientation: "h", y: -0.09, yanchor: "top" },
      xaxis: { title: { text: "time [s]" }, range: [0, end], anchor: `y${panels.length}` },
    };
    panels.forEach((panel, i) => {
      const top = 1 - i * (height + gap);
      layout[i ? `yaxis${i + 1}` : "yaxis"] = {
        title: { text: panel, font: { size: 11 } }, domain: [Math.max(0, top - height), top],
        fixedrange: true, zeroline: true,
      };
    });
    const traces = lines.map((line) => {
      const panel = panels.indexOf(line.panel);
      const place = lines.filter((l) => l.panel === line.panel).indexOf(line);
      return {
        ...visible(line, 0, end), name: line.name, type: "scatter", mode: "lines", xaxis: "x",
        yaxis: panel ? `y${panel + 1}` : "y", legendgroup: line.panel,
        legendgrouptitle: { text: line.panel },
        line: { width: 1.1, color: COLOURS[place % COLOURS.length], dash: place < 8 ? "solid" : "dot" },
      };
    });
    Plotly.react(plot, traces, layout, {
      responsive: true, displaylogo: false, doubleClick: false,
      // Only what stays on this machine: Plotly's own set offers to upload the chart.
      modeBarButtons: [["toImage"], ["zoom2d", "pan2d"], ["zoomIn2d", "zoomOut2d", "resetScale2d"]],
    });
    byId("plot-note").textContent =
      `${current.controller} on ${current.motion}, trial ${current.trial} (${current.role}). ` +
      "Drag to zoom all panels, double-click for the whole record. Strokes, errors and forces: " +
      `${part(current.signals[0].stride)} in this file.`;
  }

  const part = (stride) => (stride === 1 ? "every sample is" : `one sample in ${stride} is`);

  // New detail for the window in view.
  function refine() {
    const [from, to] = plot.layout.xaxis.range.map(Number);
    const points = lines.map((l) => visible(l, from, to));
    Plotly.restyle(plot, { x: points.map((p) => p.x), y: points.map((p) => p.y) });
  }

  const zoomOut = () => Plotly.relayout(plot, { "xaxis.range": [0, (current.samples - 1) * current.dt] });

  function show(run) {
    if (plot.hidden) return;
    current = run;
    lines = linesOf(run);
    draw();
    choices();
    fill();
  }

  function options(select, values, chosen) {
    select.replaceChildren(...values.map(([value, text]) => {
      const option = element("option", text);
      option.value = value;
      return option;
    }));
    select.value = chosen;
  }

  function choices() {
    const unique = (key, runs) => [...new Set(runs.map((h) => h[key]))].map((v) => [v, v]);
    options(byId("pick-motion"), unique("motion", stored), current.motion);
    const same = stored.filter((h) => h.motion === current.motion);
    options(byId("pick-controller"), unique("controller", same), current.controller);
    options(byId("pick-trial"),
      same.filter((h) => h.controller === current.controller)
        .map((h) => [String(h.trial), `${h.trial} (${h.role})`]), String(current.trial));
  }

  function picked() {
    const motion = byId("pick-motion").value, controller = byId("pick-controller").value;
    const trial = +byId("pick-trial").value;
    show(find(controller, motion, trial) ||
      stored.find((h) => h.motion === motion && h.controller === controller) ||
      stored.find((h) => h.motion === motion));
  }

  function pickRow(row) {
    const run = find(row.cell.controller, row.cell.motion, row.trial);
    if (run) {
      show(run);
      byId("histories").scrollIntoView();
    } else {
      byId("plot-note").textContent = `The history of trial ${row.trial} is not kept; ` +
        `martths replay ${data.folder} --trial ${row.trial} adds it.`;
      byId("count").textContent = byId("plot-note").textContent;
    }
  }

  // Plotly stands in the page compressed, at two fifths of its size.
  async function unpack(id) {
    const bytes = Uint8Array.from(atob(byId(id).textContent), (c) => c.charCodeAt(0));
    const text = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    const script = element("script", await new Response(text).text());
    document.head.append(script);
  }

  async function drawHistories() {
    try {
      await unpack("plotly");
    } catch (error) {
      byId("plot").hidden = true;
      byId("plot-note").textContent = `This browser cannot draw histories (${error.message}); ` +
        "one of 2023 or later can.";
      return;
    }
    show(stored[0]);
    plot.on("plotly_relayout", (change) => {
      if (Object.keys(change).some((k) => k.startsWith("xaxis.range"))) refine();
    });
    plot.on("plotly_doubleclick", zoomOut);
    byId("zoom-out").addEventListener("click", zoomOut);
    ["pick-motion", "pick-controller", "pick-trial"].forEach((id) =>
      byId(id).addEventListener("change", picked));
  }

  buildTable();
  update();
  if (stored.length) await drawHistories();
  else byId("histories").hidden = true;
  document.documentElement.dataset.ready = "yes";
})();
