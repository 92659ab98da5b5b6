"use strict";
// Draws the numbers that the page holds. A name from a deck or a recording is text everywhere:
// into the page it goes as textContent, into a drawing through said().

const said = (text) => String(text).replace(/[&<>]/g, (c) => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;" })[c]);
const wrapped = (text) => said(text).replace(/(.{60}\S*)\s/g, "$1<br>");
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
const hertz = (f) => (f == null ? "–" : f.toFixed(2) + " Hz");
const scaled = (values, step) => values.map((v) => (v == null ? null : v * step));

async function unpacked(script) {
  const bytes = Uint8Array.from(atob(script.textContent), (c) => c.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
}

// ---- controls

function control(box, label, element) {
  const around = document.createElement("label");
  around.append(label + " ", element);
  box.append(around);
  return element;
}

function choice(box, label, options, changed) {
  const list = document.createElement("select");
  for (const [value, text] of options) list.add(new Option(text, value));
  list.addEventListener("change", () => changed(list.value));
  return control(box, label, list);
}

function button(box, text, pressed) {
  const made = document.createElement("button");
  made.type = "button";
  made.textContent = text;
  made.addEventListener("click", () => pressed(made));
  box.append(made);
  return made;
}

// ---- what all drawings share

function layout(more) {
  const axis = { gridcolor: colour("line"), zerolinecolor: colour("line"), linecolor: colour("soft") };
  const made = {
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", margin: { l: 60, r: 15, t: 25, b: 45 },
    font: { color: colour("ink"), size: 12, family: "system-ui, DejaVu Sans, sans-serif" },
    hoverlabel: { align: "left", bgcolor: colour("sheet"), font: { color: colour("ink") } },
    modebar: { bgcolor: "rgba(0,0,0,0)", color: colour("soft"), activecolor: colour("ink") },
    legend: { orientation: "h", y: -0.12 }, ...more,
  };
  for (const key of Object.keys(made)) if (/^[xy]axis/.test(key)) made[key] = { ...axis, automargin: true, ...made[key] };
  return made;
}

const draw = (at, traces, more) =>
  Plotly.react(at, traces, layout(more), { responsive: true, displaylogo: false, displayModeBar: at.clientWidth > 600, showSendToCloud: false, modeBarButtonsToRemove: ["select2d", "lasso2d"] });

// ---- the mesh

function places(mesh, motion, by) {
  const moved = (axis, k) => mesh[axis].map((v, n) => v * mesh.step + (motion ? by * motion[k][n] : 0));
  return ["x", "y", "z"].map(moved);
}

function sheet(mesh, [x, y, z], more, kept) {
  const some = (side) => (kept ? mesh[side].filter((_, t) => kept(mesh.face[t], t)) : mesh[side]);
  return {
    type: "mesh3d", x, y, z, i: some("i"), j: some("j"), k: some("k"), color: colour("steel"), flatshading: true,
    hoverinfo: "text", hovertext: mesh.ids.map((id) => "grid " + id), showlegend: false,
    lighting: { ambient: more.intensity ? 1 : 0.85, diffuse: more.intensity ? 0 : 0.3, specular: 0.05, roughness: 0.9, facenormalsepsilon: 0 }, ...more,
  };
}

function ends(pairs, [x, y, z]) {
  const of = (axis) => pairs.flatMap(([a, b]) => [axis[a], axis[b], null]);
  return { x: of(x), y: of(y), z: of(z) };
}

const lines = (where, width, tint) => ({
  type: "scatter3d", mode: "lines", ...where, line: { width, color: colour(tint) }, hoverinfo: "skip", showlegend: false,
});

function triad(mesh, [x, y, z]) {
  const low = [x, y, z].map((axis) => axis.reduce((a, b) => Math.min(a, b), Infinity));
  const long = 0.1 * mesh.size, start = low.map((v) => v - 0.05 * mesh.size);
  return ["#d62728", "#2ca02c", "#1f77b4"].map((tint, k) => {
    const tip = start.map((v, n) => v + (n === k ? long : 0));
    const [a, b, c] = start.map((v, n) => [v, tip[n]]);
    return { type: "scatter3d", mode: "lines+text", x: a, y: b, z: c, text: ["", "XYZ"[k]], textfont: { color: tint },
      line: { width: 5, color: tint }, hoverinfo: "skip", showlegend: false };
  });
}

// A box that holds pins and triad, so large that the structure fills its share of the picture.
// A colour bar of ``bar`` pixels leaves the rest of the width to it.
function space(at, mesh, key = "scene", domain = {}, bar = 0) {
  const xyz = places(mesh), room = 0.12 * mesh.size, kept = at.layout?.[key];
  const least = (axis) => axis.reduce((a, b) => Math.min(a, b), Infinity), most = (axis) => axis.reduce((a, b) => Math.max(a, b), -Infinity);
  const range = xyz.map((axis) => [least(axis) - room, most(axis) + room]), long = range.map(([a, b]) => b - a), centre = range.map(([a, b]) => (a + b) / 2);
  const [e, u] = [mesh.eye, mesh.up], right = [u[1] * e[2] - u[2] * e[1], u[2] * e[0] - u[0] * e[2], u[0] * e[1] - u[1] * e[0]];
  const reach = (d) => most(xyz[0].map((_, n) => Math.abs(d.reduce((sum, v, k) => sum + v * (xyz[k][n] - centre[k]), 0)))) + room / 2;
  const share = ([a, b] = [0, 1]) => b - a, wide = ((at.clientWidth - bar) * share(domain.x)) / (at.clientHeight * share(domain.y));
  const size = 0.95 * Math.min(wide / reach(right), 1 / reach(u)), vector = ([x, y, z]) => ({ x, y, z });
  const far = 1.5 * Math.max(1, size * Math.max(...long)), axis = (k) => ({ visible: false, showspikes: false, range: range[k] });
  return { xaxis: axis(0), yaxis: axis(1), zaxis: axis(2), aspectmode: "manual", dragmode: "orbit", domain, aspectratio: kept?.aspectratio ?? vector(long.map((v) => size * v)),
    camera: kept?.camera ?? { eye: vector(e.map((v) => far * v)), up: vector(u), projection: { type: "orthographic" } } };
}

function ball([x, y, z], r, name) {
  const p = [[], [], []], rows = 9, round = 16, faces = [[], [], []];
  for (let a = 0; a <= rows; a++)
    for (let b = 0; b < round; b++) {
      const u = (Math.PI * a) / rows, v = (2 * Math.PI * b) / round;
      [x + r * Math.sin(u) * Math.cos(v), y + r * Math.sin(u) * Math.sin(v), z + r * Math.cos(u)].forEach((w, k) => p[k].push(w));
      const [here, next, down] = [a * round + b, a * round + ((b + 1) % round), (a + 1) * round];
      if (a < rows) [[here, next, down + b], [next, down + ((b + 1) % round), down + b]].forEach((t) => t.forEach((w, k) => faces[k].push(w)));
    }
  return { type: "mesh3d", x: p[0], y: p[1], z: p[2], i: faces[0], j: faces[1], k: faces[2], color: colour("found"), opacity: 0.25,
    hoverinfo: "text", hovertext: name, showlegend: false };
}

function markers(list, name, tint, symbol, long) {
  const tip = (k) => list.map((m) => m.at[k] + long * m.along[k]);
  const arrow = (k) => list.flatMap((m) => [m.at[k], m.at[k] + long * m.along[k], null]);
  return [
    { type: "scatter3d", mode: "markers", name, x: tip(0), y: tip(1), z: tip(2), hoverinfo: "text", legendgroup: name,
      hovertext: list.map((m) => `${name} ${said(m.label)}`), marker: { size: name === "drive point" ? 8 : 5, color: colour(tint), symbol } },
    { ...lines({ x: arrow(0), y: arrow(1), z: arrow(2) }, 4, tint), legendgroup: name },
  ];
}

const SYMBOLS = { sensors: ["neutral", "circle"], "held-out sensors": ["neutral", "circle-open"], "drive point": ["before", "diamond"], cords: ["calm", "square"] };

function structure(at, data, shared) {
  const mesh = shared.mesh, xyz = places(mesh), traces = [];
  const meant = new Set(data.spots.flatMap((s) => s.parts));
  if (mesh.i.length) {
    traces.push(sheet(mesh, xyz, {}, meant.size ? (f) => !meant.has(mesh.part[f]) : null));
    if (meant.size) traces.push(sheet(mesh, xyz, { color: colour("found"), hovertext: mesh.ids.map((id) => `grid ${id}, ${wrapped(data.spots[0].text)}`) }, (f) => meant.has(mesh.part[f])));
  }
  traces.push(lines(ends(mesh.fine, xyz), 1, "soft"), lines(ends(mesh.edges, xyz), 3, "ink"), ...triad(mesh, xyz));
  for (const [name, list] of Object.entries(data.setup)) traces.push(...markers(list, name, ...SYMBOLS[name], name === "cords" ? 0 : 0.06 * mesh.size));
  for (const spot of data.spots) {
    const name = wrapped(spot.text);
    if (spot.radius) for (const p of spot.at.slice(0, 3)) traces.push(ball(p, spot.radius, name));
    if (spot.at.length) traces.push({ type: "scatter3d", mode: "markers", name: "finding", x: spot.at.map((p) => p[0]), y: spot.at.map((p) => p[1]), z: spot.at.map((p) => p[2]),
      hoverinfo: "text", hovertext: name, marker: { size: 9, color: colour("found"), symbol: "cross" } });
  }
  return draw(at, traces, { scene: space(at, mesh), margin: { l: 0, r: 0, t: 0, b: 0 }, legend: { orientation: "h", y: 0 } });
}

function remainder(at, data, shared) {
  const mesh = shared.mesh, xyz = places(mesh), value = scaled(data.value, data.step), title = data.title;
  const seen = (f) => value[f] != null, shown = mesh.face.filter(seen).map((f) => value[f]);
  return draw(at, [
    sheet(mesh, xyz, {}, (f) => !seen(f)),
    sheet(mesh, xyz, { intensity: shown, intensitymode: "cell", cmin: data.low, cmax: data.top, colorscale: data.colours.replace("_r", ""), reversescale: !data.colours.endsWith("_r"), colorbar: { thickness: 12, len: 0.8, title: { text: said(title), side: "right" } },
      hovertemplate: `${said(title)} %{intensity:.4g}<extra></extra>` }, seen),
    lines(ends(mesh.edges, xyz), 3, "ink"), ...triad(mesh, xyz),
  ], { scene: space(at, mesh, "scene", {}, 100), margin: { l: 0, r: 0, t: 0, b: 0 } });
}

function shapes(at, data, shared, box) {
  const mesh = shared.mesh, decks = Object.keys(data.modes[0]).concat("before", "after").filter((name, k, all) => name !== "test" && all.indexOf(name) === k && data.modes.some((m) => m[name]));
  const sensed = data.modes.some((m) => m.test?.motion), own = (m) => m.test ?? m[decks[0]];
  const state = { mode: 0, left: sensed ? "test" : decks[0], right: decks[decks.length - 1], size: 0.08, run: !matchMedia("(prefers-reduced-motion: reduce)").matches };
  const title = (m, name) => {
    const one = m[name];
    if (!one) return `${name}: no partner`;
    return `${name} ${hertz(one.hz)}` + (one.damping != null ? `, damping ${(100 * one.damping).toFixed(2)} %` : "") + (one.mac != null ? `, MAC ${one.mac.toFixed(3)}` : "");
  };
  const names = (sensed ? ["test"] : []).concat(decks).map((n) => [n, ["test", "model"].includes(n) ? n : "deck " + n]), both = names.length > 1;
  const list = choice(box, "mode", data.modes.map((m, k) => [k, `${own(m).number ?? k + 1}: ${hertz(own(m).hz)}`]), (v) => show({ mode: Number(v) }));
  const step = (by) => show({ mode: (list.value = (state.mode + by + data.modes.length) % data.modes.length) });
  button(box, "previous", () => step(-1));
  button(box, "next", () => step(1));
  if (both) {
    choice(box, "left", names, (v) => show({ left: v })).value = state.left;
    choice(box, "right", names, (v) => show({ right: v })).value = state.right;
  }
  choice(box, "amplitude", [[0.03, "small"], [0.08, "medium"], [0.2, "large"]], (v) => show({ size: Number(v) })).value = state.size;
  const stop = button(box, "", () => { state.run = !state.run; label(); tick(); });
  const label = () => { stop.textContent = state.run ? "stop" : "play"; stop.setAttribute("aria-pressed", state.run); };

  const motion = (name) => data.modes[state.mode][name]?.motion;
  function side(name, phase) {  // coordinates of the traces of one side: sheet and edges, or sensors
    const far = state.size * mesh.size * phase, m = motion(name);
    if (name !== "test") {
      const xyz = places(mesh, m, far / 1000);
      return [{ x: xyz[0], y: xyz[1], z: xyz[2] }, ends(mesh.edges, xyz)];
    }
    const tip = (k) => data.sensors.map((s, n) => s.at[k] + ((m ? m[n] : 0) / 1000) * far * s.along[k]);
    const [x, y, z] = [tip(0), tip(1), tip(2)], stick = (axis, k) => data.sensors.flatMap((s, n) => [s.at[k], axis[n], null]);
    return [{ x, y, z }, { x: stick(x, 0), y: stick(y, 1), z: stick(z, 2) }];
  }
  function traces(name, scene) {
    const [first, second] = side(name, 1), m = motion(name);
    if (name === "test") {
      const rest = places(mesh);
      return [{ type: "scatter3d", mode: "markers", ...first, scene, showlegend: false, hoverinfo: "text",
        hovertext: data.sensors.map((s, n) => `${said(s.label)}: ${m ? (m[n] / 1000).toFixed(2) : "–"} of the largest`), marker: { size: 5, color: m ? m.map(Math.abs) : 0, cmin: 0, cmax: 1000, colorscale: "Viridis" } },
      { ...lines(second, 5, "before"), scene }, { ...sheet(mesh, rest, { opacity: 0.35 }), scene }, { ...lines(ends(mesh.edges, rest), 2, "soft"), scene }];
    }
    const size = m ? m[0].map((_, n) => Math.hypot(m[0][n], m[1][n], m[2][n])) : mesh.x.map(() => 0);
    const surface = mesh.i.length ? sheet(mesh, [first.x, first.y, first.z], { intensity: size, cmin: 0, cmax: 1000, colorscale: "Viridis", showscale: false,
      hovertext: mesh.ids.map((id, n) => `grid ${id}: ${(size[n] / 1000).toFixed(2)} of the largest`) }) : lines(first, 1, "line");
    return [{ ...surface, scene }, { ...lines(second, 3, "ink"), scene }];
  }
  const narrow = at.clientWidth < 600;
  if (!both) at.style.height = "26rem";
  async function show(change) {
    Object.assign(state, change);
    const m = data.modes[state.mode];
    const note = (text, x, y) => ({ text: said(text), x, y, xref: "paper", yref: "paper", showarrow: false, xanchor: "left", yanchor: "top" });
    const [one, two] = !both ? [{}] : narrow ? [{ x: [0, 1], y: [0.52, 1] }, { x: [0, 1], y: [0, 0.48] }] : [{ x: [0, 0.5], y: [0, 1] }, { x: [0.5, 1], y: [0, 1] }];
    await draw(at, [...traces(state.left, "scene"), ...(both ? traces(state.right, "scene2") : [])], {
      scene: space(at, mesh, "scene", one), ...(both && { scene2: space(at, mesh, "scene2", two) }), margin: { l: 0, r: 0, t: 0, b: 0 },
      annotations: [note(title(m, state.left), 0.01, 1), ...(both ? [note(title(m, state.right), narrow ? 0.01 : 0.51, narrow ? 0.48 : 1)] : [])],
    });
    label();
  }
  let busy = false, timer, inView = true;
  const start = performance.now();
  async function tick() {
    clearTimeout(timer);
    if (busy || !state.run || !inView || document.hidden) return;
    busy = true;
    const phase = Math.sin((performance.now() - start) / 250);
    const left = side(state.left, phase), right = side(state.right, phase), first = state.left === "test" ? 4 : 2;
    const moved = both ? [...left, ...right] : left, of = (axis) => moved.map((p) => p[axis]);
    await Plotly.restyle(at, { x: of("x"), y: of("y"), z: of("z") }, [0, 1, first, first + 1].slice(0, moved.length));
    at.dataset.frames = Number(at.dataset.frames || 0) + 1;
    busy = false;
    timer = setTimeout(tick, 30);
  }
  at.redraw = () => show({});
  document.addEventListener("visibilitychange", tick);
  new IntersectionObserver(([seen]) => { inView = seen.isIntersecting; tick(); }).observe(at);
  return show({}).then(() => { if (both) at.on("plotly_relayout", (to) => turned(at, to)); tick(); });
}

function turned(at, to) {  // both sides are seen from the same place
  const change = {};
  for (const [key, value] of Object.entries(to)) {
    const found = key.match(/^scene(2?)\.(camera|aspectratio)$/);
    if (found) change[`scene${found[1] ? "" : "2"}.${found[2]}`] = value;
  }
  if (at.following || !Object.keys(change).length) return;
  at.following = true;
  Plotly.relayout(at, change).then(() => { at.following = false; });
}

// ---- charts: data and layout come from Python; here are colours, choices and clicks

const narrow = (at) => at.clientWidth < 600;
const plain = (value) => value !== null && typeof value === "object" && !Array.isArray(value);
const merged = (a, b) => Object.entries(b ?? {}).reduce((all, [k, v]) => ({ ...all, [k]: plain(v) && plain(all[k]) ? merged(all[k], v) : v }), { ...a });

// Colours of the page for those that begin with @, numbers for thousandths of a decade.
function resolved(value, key = "") {
  if (typeof value === "string") return value.startsWith("@") && /color$/.test(key) ? colour(value.slice(1)) : value;
  if (Array.isArray(value)) return value.length && typeof value[0] === "object" ? value.map((v) => resolved(v, key)) : value;
  if (!plain(value)) return value;
  if (value.log) return value.log.map((v) => (v == null ? null : 10 ** (v * value.step)));
  return Object.fromEntries(Object.entries(value).map(([k, v]) => [k, resolved(v, k)]));
}

function chart(at, spec, shared, box) {
  const choices = spec.choices ?? [], picked = choices.map((c) => c.chosen ?? 0);
  function show() {
    const more = narrow(at) ? spec.narrow : {}, options = choices.map((c, k) => c.options[picked[k]]);
    const data = spec.data.map((trace, n) => options.reduce((t, o) => merged(t, o.data[n]), trace));
    const made = [more, ...options].reduce((all, o) => merged(all, o.layout), spec.layout);
    made.shapes = [...(made.shapes ?? []), ...options.flatMap((o) => o.shapes ?? []), ...(brush?.boxes() ?? [])];
    at.style.height = (more.height ?? spec.height) + "rem";
    return draw(at, resolved(spec.brush ? brush.painted(data) : data), resolved({ uirevision: "kept", ...made }));
  }
  choices.forEach((c, k) => {
    const to = (n) => { picked[k] = Number((list.value = (n + c.options.length) % c.options.length)); return show(); };
    const list = choice(box, c.label, c.options.map((o, n) => [n, o.text]), (n) => to(Number(n)));
    list.value = picked[k];
    if (!c.steps) return;
    button(box, "previous", () => to(picked[k] - 1));
    button(box, "next", () => to(picked[k] + 1));
    for (const [word, n] of Object.entries(c.marked)) button(box, word, () => to(n));
  });
  const brush = spec.brush && brushed(at, spec, box, show);
  at.redraw = show;
  return show().then(() => { if (spec.pick) picks(at, spec.pick, box); brush?.listen(); });
}

// A click on a point adds its x to a command.
function picks(at, command, box) {
  const picked = new Set(), list = document.createElement("code");
  const say = () => { list.textContent = picked.size ? command + [...picked].map((f) => ` --pick ${f}`).join("") : "click a pole to pick it"; };
  box.append(list);
  say();
  at.on("plotly_click", ({ points: [p] }) => {
    const f = String(p.x);
    if (!picked.delete(f)) picked.add(f);
    say();
  });
}

// Lines of samples over axes at 0, 1, 2 ...: a box over an axis keeps the samples within it. The first
// trace has those left out, the last but one the scale of colours, the last the sample under the pointer.
function brushed(at, spec, box, show) {
  const own = spec.data.slice(1, -2), points = new Map(), state = { by: 0, kept: {} };
  own.forEach((t) => t.customdata.forEach((n, k) => n == null || (points.get(n) ?? points.set(n, []).get(n)).push([t.x[k], t.y[k], t.text[k]])));
  const all = [...points.keys()].sort((p, q) => p - q), height = (n, k) => points.get(n)[k][1];
  const line = (some) => [0, 1, 2].map((c) => some.flatMap((n) => [...points.get(n).map((p) => p[c]), null]));
  const over = (t, some) => (([x, y, text]) => ({ ...t, x, y, text, customdata: some.flatMap((n) => [...points.get(n).map(() => n), null]) }))(line(some));
  choice(box, "colour", spec.brush.map((b, k) => [k, b.text]), (k) => { state.by = Number(k); show(); });
  const every = button(box, "show all", () => { state.kept = {}; show(); }), count = document.createElement("span");
  box.append(count);
  return {
    painted(data) {
      const { text, tints, ends } = spec.brush[state.by], limits = Object.entries(state.kept);
      const inside = all.filter((n) => limits.every(([k, [a, b]]) => a <= height(n, k) && height(n, k) <= b)), out = new Set(inside);
      count.textContent = `${inside.length} of ${all.length} samples`;
      every.disabled = !limits.length;
      const scale = merged(data[data.length - 2], { marker: { color: ends, showscale: !narrow(at), colorbar: { title: { text: said(text) } } } });
      return [over(data[0], all.filter((n) => !out.has(n))), ...own.map((t, k) => over(t, inside.filter((n) => tints[all.indexOf(n)] === k))), scale, data[data.length - 1]];
    },
    boxes: () => Object.entries(state.kept).map(([k, [a, b]]) => ({ type: "rect", x0: k - 0.06, x1: Number(k) + 0.06, y0: a, y1: b, line: { width: 1, color: "@found" }, fillcolor: "@found", opacity: 0.3 })),
    listen() {
      let marked = [];
      const drawn = () => Plotly.restyle(at, (([x, y]) => ({ x: [x], y: [y] }))(line(marked)), [at.data.length - 1]);
      const mark = (some) => { marked = some; requestAnimationFrame(drawn); };  // Plotly loses its points if it draws while it tells of them
      at.on("plotly_hover", ({ points: [p] }) => { if (p.customdata != null) mark([p.customdata]); });
      at.on("plotly_unhover", () => mark([]));
      at.on("plotly_selected", (found) => {
        if (!found?.range) return;
        const [[a, b], ends] = [found.range.x, found.range.y].map((r) => r.slice().sort((p, q) => p - q));
        points.get(all[0]).forEach((_, k) => { if (a <= k && k <= b) state.kept[k] = ends; });
        show();
      });
      at.on("plotly_deselect", () => { state.kept = {}; show(); });
    },
  };
}

// ---- tables that are sorted by a click on their heads

function sortable(table) {
  const body = table.tBodies[0], heads = [...table.tHead.rows[0].cells];
  if (body.rows.length < 3) return;
  const key = (row, k) => row.cells[k].textContent.trim();
  heads.forEach((head, k) => {
    const sort = () => {
      const up = head.getAttribute("aria-sort") !== "ascending";
      heads.forEach((h) => h.removeAttribute("aria-sort"));
      head.setAttribute("aria-sort", up ? "ascending" : "descending");
      const order = (a, b) => {
        const [x, y] = [key(a, k), key(b, k)], [p, q] = [parseFloat(x), parseFloat(y)];
        if (isNaN(p) !== isNaN(q)) return isNaN(p) ? 1 : -1;
        return (up ? 1 : -1) * (isNaN(p) ? x.localeCompare(y) : p - q);
      };
      body.append(...[...body.rows].sort(order));
    };
    head.tabIndex = 0;
    head.classList.add("sorts");
    head.addEventListener("click", sort);
    head.addEventListener("keydown", (e) => { if (e.key === "Enter") sort(); });
  });
}

// ---- all of it

const DRAWN = { structure, remainder, shapes, chart };
const SPATIAL = ["structure", "remainder", "shapes"];

async function begin() {
  document.querySelectorAll("table").forEach(sortable);
  const figures = [...document.querySelectorAll(".live[data-word]")];
  if (!figures.length || !window.DecompressionStream) return;
  const [common, ...words] = document.querySelectorAll(".numbers"), shared = JSON.parse(await unpacked(common));
  const script = document.createElement("script");
  script.textContent = await unpacked(document.getElementById("library"));
  document.head.append(script);
  const turns = !!document.createElement("canvas").getContext("webgl");
  async function start(figure) {
    const held = JSON.parse(await unpacked(words[figure.dataset.word])), name = held.draw, at = figure.querySelector(".plot");
    const data = held.data && name !== "chart" ? held.data : held;
    if (SPATIAL.includes(name) && !turns) return;
    figure.classList.add("drawn");
    try {
      at.redraw = () => DRAWN[name](at, data, shared, document.createElement("div"));
      await DRAWN[name](at, data, shared, figure.querySelector(".controls"));
      figure.dataset.ready = "yes";
    } catch (error) {
      figure.classList.remove("drawn");  // its pictures stand for it
      console.error(error);
    }
  }
  const begun = new Set();
  const once = (figure) => begun.has(figure) || (begun.add(figure), start(figure));
  const near = new IntersectionObserver((seen) => seen.filter((s) => s.isIntersecting).forEach((s) => once(s.target)), { rootMargin: "300px" });
  figures.forEach((figure) => near.observe(figure));
  const redraw = () => figures.filter((f) => f.dataset.ready).forEach((f) => f.querySelector(".plot").redraw());
  for (const media of ["(prefers-color-scheme: dark)", "print"]) matchMedia(media).addEventListener("change", redraw);
  for (const figure of figures) {  // all of it is there when it is printed
    await new Promise((next) => (window.requestIdleCallback ?? setTimeout)(next));
    await once(figure);
  }
}

begin();
