"use strict";
// Draws the numbers that the page holds. A name from a deck or a recording is text everywhere:
// into the page it goes as textContent, into a drawing through said().

const said = (text) => String(text).replace(/[&<>]/g, (c) => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;" })[c]);
const wrapped = (text) => said(text).replace(/(.{60}\S*)\s/g, "$1<br>");
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
const hertz = (f) => (f == null ? "–" : f.toFixed(2) + " Hz");
const scaled = (values, step) => values.map((v) => (v == null ? null : v * step));
const CURVE = { test: "ink", before: "before", after: "after", model: "after", identified: "after", recorded: "ink", ideal: "after" };
const TINTS = ["neutral", "before", "calm", "#cc79a7", "#e69f00", "#56b4e9", "soft", "ink"];
const VIRIDIS = ["#440154", "#482878", "#3e4989", "#31688e", "#26828e", "#1f9e89", "#35b779", "#6ece58", "#b5de2b", "#fde725"];
const tinted = (name) => (name.startsWith("#") ? name : colour(name));
const extent = (values) => values.reduce(([a, b], v) => (v == null ? [a, b] : [Math.min(a, v), Math.max(b, v)]), [Infinity, -Infinity]);
const short = (v) => (v == null ? "–" : v && (Math.abs(v) >= 1e6 || Math.abs(v) < 1e-3) ? String(Number(v.toPrecision(4)).toExponential()).replace("e+", "e") : String(Number(v.toPrecision(5))));

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
  const mesh = shared.mesh, xyz = places(mesh), value = scaled(data.value, data.step), title = data.title || "gain";
  const seen = (f) => value[f] != null, shown = mesh.face.filter(seen).map((f) => value[f]);
  return draw(at, [
    sheet(mesh, xyz, {}, (f) => !seen(f)),
    sheet(mesh, xyz, { intensity: shown, intensitymode: "cell", cmin: data.low || 0, cmax: data.top, colorscale: title === "gain" ? "YlOrRd" : "YlGnBu", reversescale: true, colorbar: { thickness: 12, len: 0.8, title: { text: said(title), side: "right" } },
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

// ---- curves, matrices, bars

function responses(at, data, shared, box) {
  const names = Object.keys(data.channels[0].curves);
  const text = (c) => c.name + (c.held ? " (held out)" : "") + Object.entries(c.off).map(([n, q]) => `, Q ${n} ${short(q)}`).join("");
  const list = choice(box, "channel", data.channels.map((c, k) => [k, text(c)]), (k) => show(Number(k)));
  const step = (by) => show((list.value = (Number(list.value) + by + data.channels.length) % data.channels.length));
  button(box, "previous", () => step(-1));
  button(box, "next", () => step(1));
  const last = names[names.length - 1];
  if (names.length > 1) button(box, "worst", () => show((list.value = data.channels.reduce((w, c, k, all) => (c.off[last] > all[w].off[last] ? k : w), 0))));
  const [low, high] = [data.frequency[0], data.frequency[data.frequency.length - 1]];
  const inside = ([a, b]) => [Math.max(a, low), Math.min(b, high)];
  function grey() {
    let free = data.fitted.length ? [] : [[low, high]], from = low;
    for (const [a, b] of data.fitted.map(inside)) { if (a > from) free.push([from, a]); from = b; }
    free = data.fitted.length ? free.concat(from < high ? [[from, high]] : []) : [];
    return free.concat(data.excluded.map(inside)).map(([a, b]) => ({ type: "rect", xref: "x", yref: "paper", x0: a, x1: b, y0: 0, y1: 1, line: { width: 0 }, fillcolor: colour("soft"), opacity: 0.12, layer: "below" }));
  }
  function show(k) {
    const c = data.channels[k], traces = [];
    for (const name of names) {
      const [level, phase] = c.curves[name], line = { color: colour(CURVE[name]), width: name === "test" ? 1.8 : 1.4 };
      const cut = phase.map((p, n) => (n && Math.abs(p - phase[n - 1]) > 180 ? null : p));
      traces.push({ type: "scatter", mode: "lines", name, legendgroup: name, x: data.frequency, y: level.map((v) => (v == null ? null : 10 ** (v / 1000))), line, hovertemplate: `${name} %{y:.3g}<extra></extra>` });
      traces.push({ type: "scatter", mode: "lines", name, legendgroup: name, showlegend: false, x: data.frequency, y: cut, yaxis: "y2", line, hovertemplate: `${name} %{y}°<extra></extra>` });
    }
    const low = c.coherence ? 0.24 : 0;
    if (low) traces.push({ type: "scatter", mode: "lines", name: "coherence", showlegend: false, x: data.frequency, y: scaled(c.coherence, 0.001), yaxis: "y3", line: { color: colour("neutral"), width: 1.2 }, hovertemplate: "coherence %{y:.3f}<extra></extra>" });
    return draw(at, traces, { title: { text: said(text(c)), font: { size: at.clientWidth > 600 ? 13 : 10 } }, margin: { l: 60, r: 15, t: 40, b: 45 }, hovermode: "x unified", hoversubplots: "axis", shapes: grey(), uirevision: "kept",
      xaxis: { title: { text: "frequency [Hz]" }, anchor: low ? "y3" : "y2", hoverformat: ".2f" }, yaxis: { type: "log", domain: [low ? 0.49 : 0.33, 1], exponentformat: "power", title: { text: said(`${data.quantity} [${data.unit}]`) } },
      yaxis2: { domain: [low, low ? 0.44 : 0.27], range: [-190, 190], tickvals: [-180, -90, 0, 90, 180], title: { text: "phase [°]" } }, ...(low && { yaxis3: { domain: [0, 0.19], range: [0, 1.05], title: { text: "coherence" } } }), legend: at.clientWidth > 600 ? { orientation: "h", y: 1, yanchor: "bottom", x: 1, xanchor: "right" } : { orientation: "h", y: -0.15 } });
  }
  at.redraw = () => show(Number(list.value));
  return show(0);
}

function assurance(at, data) {
  const maps = Object.entries(data.maps), narrow = at.clientWidth < 700, traces = [], more = { shapes: [], annotations: [] };
  maps.forEach(([name, map], k) => {
    const n = k ? String(k + 1) : "", share = [k / maps.length + (k ? 0.06 : 0), (k + 1) / maps.length - (k < maps.length - 1 ? 0.04 : 0)];
    const down = [1 - share[1], 1 - share[0]], value = map.mac.map((row) => scaled(row, 0.001));
    const tip = value.map((row, i) => row.map((v, j) => `test ${hertz(data.test[i])}<br>${name} ${hertz(map.model[j])}<br>MAC ${v.toFixed(3)}`));
    const ticks = (f) => ({ tickvals: f.map((_, i) => i), ticktext: f.map((v) => v.toFixed(1)), tickfont: { size: 10 }, showgrid: false, zeroline: false });
    traces.push({ type: "heatmap", z: value, zmin: 0, zmax: 1, colorscale: "Viridis", showscale: k === 0, colorbar: { thickness: 10 }, text: tip, hoverinfo: "text", xaxis: "x" + n, yaxis: "y" + n });
    more["xaxis" + n] = { ...ticks(map.model), domain: narrow ? [0, 1] : share, anchor: "y" + n, tickangle: -60, title: { text: ["test", "model"].includes(name) ? `${name} [Hz]` : `deck ${name} [Hz]` } };
    more["yaxis" + n] = { ...ticks(data.test), domain: narrow ? down : [0, 1], anchor: "x" + n, autorange: "reversed", title: { text: "test [Hz]" } };
    for (const [i, j] of map.pairs) more.shapes.push({ type: "rect", xref: "x" + n, yref: "y" + n, x0: j - 0.5, x1: j + 0.5, y0: i - 0.5, y1: i + 0.5, line: { color: "#ff5a36", width: 2 } });
  });
  return draw(at, traces, more);
}

function poles(at, data, shared, box) {
  const TINTS = { o: "line", f: "soft", d: "soft", v: "neutral", s: "calm" }, picked = new Set();
  const list = document.createElement("code");
  const say = () => { list.textContent = picked.size ? "chladni identify ... " + [...picked].map((f) => `--pick ${f}`).join(" ") : "click a pole to pick it"; };
  const show = () => {
    const traces = Object.entries(data.kinds).map(([kind, name]) => {
      const of = data.kind.flatMap((k, n) => (k === kind ? [n] : [])), some = (values) => of.map((n) => values[n]);
      return { type: "scatter", mode: "markers", name, x: some(data.frequency), y: some(data.states), marker: { color: colour(TINTS[kind]), size: kind === "s" ? 7 : 5 },
        text: of.map((n) => `${hertz(data.frequency[n])}, damping ${data.damping[n]} %<br>${data.states[n]} states, ${name}`), hoverinfo: "text" };
    });
    traces.push({ type: "scatter", mode: "lines", name: "rms of |H|", x: data.curve[0], y: data.curve[1], yaxis: "y2", line: { color: colour("steel"), width: 1 }, hoverinfo: "skip" });
    const line = (dash) => (f) => ({ type: "line", x0: f, x1: f, yref: "paper", y0: 0, y1: 1, line: { color: colour("before"), width: 1, dash } });
    return draw(at, traces, { shapes: [...data.kept.map(line("solid")), ...data.struck.map(line("dot"))], xaxis: { title: { text: "frequency [Hz]" } },
      yaxis: { title: { text: "states" } }, yaxis2: { type: "log", overlaying: "y", side: "right", showgrid: false, showticklabels: false } });
  };
  box.append(list);
  say();
  at.redraw = show;
  return show().then(() => at.on("plotly_click", ({ points: [p] }) => {
    const f = String(p.x);
    if (!picked.delete(f)) picked.add(f);
    say();
  }));
}

function steps(at, data) {
  const tints = ["neutral", "before"], traces = Object.entries(data.sides).map(([name, q], k) => ({ type: "bar", name, x: Object.keys(q), y: Object.values(q), marker: { color: colour(tints[k]) }, hovertemplate: `${name}, %{x}: Q %{y:.4g}<extra></extra>` }));
  Object.entries(data.floors).forEach(([name, v], k) => traces.push({ type: "scatter", mode: "lines", name: `noise, ${name}`, x: Object.keys(Object.values(data.sides)[0]), y: Object.values(Object.values(data.sides)[0]).map(() => v), line: { dash: "dash", color: colour(tints[k]) }, hovertemplate: `noise, ${name}: ${v.toPrecision(3)}<extra></extra>` }));
  return draw(at, traces, { barmode: "group", yaxis: { title: { text: "Q" }, rangemode: "tozero" } });
}

function odds(at, data) {
  const bars = data.bars.slice().reverse(), marks = [0, 2, 10, 30, 100, 300, 1000, 3000, 10000];
  at.style.height = 90 + 26 * bars.length + "px";
  return draw(at, [{ type: "bar", orientation: "h", y: bars.map((_, k) => k), x: bars.map((b) => b.against + 1), base: 0, marker: { color: bars.map((b) => colour(b.why === "named" ? "found" : "steel")) },
    text: bars.map((b) => b.against.toFixed(b.against < 10 ? 1 : 0)), textposition: "outside", cliponaxis: false, hoverinfo: "text",
    hovertext: bars.map((b) => `<b>${said(b.name)}</b>, 2 ln B ${b.against.toFixed(1)}<br>${wrapped(b.why || "")}`) }], {
    xaxis: { type: "log", range: [0, Math.log10(Math.max(...bars.map((b) => b.against)) + 1) * 1.08 + 0.05], tickvals: marks.map((v) => v + 1), ticktext: marks.map(String), title: { text: "2 ln Bayes factor" } },
    yaxis: { tickvals: bars.map((_, k) => k), ticktext: bars.map((b) => said(b.name)), showgrid: false } });
}

function ladder(at, data) {
  const bar = (name) => ({ type: "bar", name, x: data.test.map((_, k) => k), y: data[name], marker: { color: colour(name) }, hovertext: data.test.map((f, k) => `test ${hertz(f)}<br>${name} ${data[name][k] == null ? "no partner" : (data[name][k] > 0 ? "+" : "") + data[name][k] + " %"}`), hoverinfo: "text" });
  return draw(at, ["before", "after"].map(bar), { barmode: "group", xaxis: { tickvals: data.test.map((_, k) => k), ticktext: data.test.map((f) => f.toFixed(1)), title: { text: "frequency of the test [Hz]" } }, yaxis: { title: { text: "off [%]" } } });
}

// A logarithmic axis: a number at each decade, at 1, 2 and 5, or at every digit, as there are few.
const decades = (values) => (([low, high]) => ({ type: "log", dtick: high > 30 * low ? 1 : high > 10 * low ? "D2" : "D1", exponentformat: "power" }))(extent(values));

// Curves one below the other over one axis: of frequency, time or amplitude.
function panels(at, data) {
  const many = data.panels.length, named = [], traces = [], more = {}, wide = at.clientWidth > 600;
  const marks = data.panels.some((p) => p.curves.some((c) => c.marks));
  data.panels.forEach((panel, k) => {
    const n = k ? String(k + 1) : "";
    more["yaxis" + n] = { ...(panel.log ? decades(panel.curves.flatMap((c) => c.y)) : { exponentformat: "power" }), domain: [1 - (k + 1) / many + (k < many - 1 ? 0.04 : 0), 1 - k / many],
      title: { text: said(panel.title), font: { size: 11 } }, ...(panel.range ? { range: panel.range } : { rangemode: panel.zero ? "tozero" : "normal" }) };
    for (const c of panel.curves) {
      const first = !named.includes(c.name);
      if (first) named.push(c.name);
      const look = tinted(c.tint || TINTS[named.indexOf(c.name) % TINTS.length]);
      traces.push({ type: "scatter", mode: c.marks || "lines", name: said(c.name), legendgroup: said(c.name), showlegend: first, x: c.x, y: c.y, yaxis: "y" + n, connectgaps: false,
        ...(c.sd && { error_y: { type: "data", array: c.sd.map((v) => 2 * v), color: look, thickness: 1 } }), line: { color: look, width: 1.3, dash: c.dash || ["solid", "dash", "dot"][Math.floor(named.indexOf(c.name) / TINTS.length) % 3] }, marker: { color: look, size: 6, symbol: c.symbol || "circle" },
        hovertemplate: marks ? `${said(c.name)}<br>%{x:.4g}: %{y:.5g}<extra></extra>` : `${said(c.name)} %{y:.4g}<extra></extra>` });
    }
  });
  at.style.height = 7 + 12 * many + (wide ? 0 : 0.8 * named.length) + "rem";
  return draw(at, traces, { ...more, margin: { l: 60, r: 15, t: 10, b: 45 }, showlegend: data.panels.some((p) => p.curves.length > 1), hovermode: marks ? "closest" : "x unified", hoversubplots: "axis",
    xaxis: { ...(data.x.log ? decades(data.panels.flatMap((p) => p.curves.flatMap((c) => c.x))) : { hoverformat: ".5g" }), title: { text: said(data.x.title) }, anchor: "y" + (many > 1 ? many : "") }, legend: { orientation: "h", y: 1.02, yanchor: "bottom", x: 0 } });
}

// ---- samples of a study

const about = (samples, n) => `sample ${samples.number[n]}<br>` + samples.columns.map((c) => `${said(c.name)}: ${short(c.values[n])}`).join("<br>");

// Every sample as a line across the axes. A box drawn over an axis keeps the samples within it.
function parallel(at, data, shared, box) {
  const samples = shared.samples, axes = data.axes.map((k) => samples.columns[k]), state = { by: data.axes.indexOf(data.by), kept: {} }, wide = at.clientWidth > 600;
  const place = axes.map((a) => {
    const run = a.values.map((v) => (v == null ? null : a.log ? Math.log(v) : v)), [low, high] = extent(run);
    return run.map((v) => (v == null ? null : high > low ? (v - low) / (high - low) : 0.5));
  });
  const whole = samples.number.map((_, n) => n).filter((n) => place.every((p) => p[n] != null)), told = whole.map((n) => about(samples, n));
  choice(box, "colour", axes.map((a, k) => [k, a.name]), (k) => { state.by = Number(k); show(); }).value = state.by;
  const every = button(box, "show all", () => { state.kept = {}; show(); }), count = document.createElement("span");
  box.append(count);
  const line = (list) => ({ x: list.flatMap(() => [...axes.keys(), null]), y: list.flatMap((m) => [...place.map((p) => p[whole[m]]), null]), text: list.flatMap((m) => [...axes.map(() => told[m]), null]), customdata: list.flatMap((m) => [...axes.map(() => m), null]) });
  function show() {
    const inside = whole.map((n) => Object.entries(state.kept).every(([k, [a, b]]) => a <= place[k][n] && place[k][n] <= b)), kept = [...whole.keys()].filter((m) => inside[m]);
    const most = VIRIDIS.length - 1, bin = (m) => Math.round(most * place[state.by][whole[m]]), [low, high] = extent(axes[state.by].values), look = { type: "scatter", mode: "lines+markers", hoverinfo: "text", showlegend: false };
    const opacity = Math.min(0.9, Math.max(0.15, 40 / Math.max(kept.length, 1)));
    const traces = [{ ...look, ...line([...whole.keys()].filter((m) => !inside[m])), mode: "lines", hoverinfo: "skip", line: { color: colour("line"), width: 0.7 } }];
    VIRIDIS.forEach((tint, k) => traces.push({ ...look, ...line(kept.filter((m) => bin(m) === k)), opacity, line: { color: tint, width: 1.2 }, marker: { color: tint, size: 4 } }));
    traces.push({ ...look, x: [null], y: [null], hoverinfo: "skip", mode: "markers", marker: { color: [low], cmin: low, cmax: high, colorscale: "Viridis", showscale: wide, colorbar: { thickness: 10, title: { text: said(axes[state.by].name), side: "right", font: { size: 11 } } } } });
    traces.push({ ...look, x: [], y: [], hoverinfo: "skip", line: { color: colour("found"), width: 3 }, marker: { color: colour("found"), size: 6 } });
    const top = wide ? 1.06 : 1.1, note = (text, k, y) => ({ text, x: k, y, showarrow: false, textangle: wide ? 0 : -50, font: { size: 10, color: colour("soft") } });
    const ends = axes.flatMap((a, k) => extent(a.values).map((v, end) => note(short(v), k, end ? top : 1 - top)));
    const upright = axes.map((_, k) => ({ type: "line", x0: k, x1: k, y0: 0, y1: 1, line: { color: colour("soft"), width: 1 } }));
    const chosen = Object.entries(state.kept).map(([k, [a, b]]) => ({ type: "rect", x0: k - 0.06, x1: Number(k) + 0.06, y0: a, y1: b, line: { width: 1, color: colour("found") }, fillcolor: colour("found"), opacity: 0.3 }));
    count.textContent = `${kept.length} of ${whole.length} samples`;
    every.disabled = !chosen.length;
    return draw(at, traces, { shapes: [...upright, ...chosen], annotations: ends, selections: [], dragmode: "select", hovermode: "closest", margin: { l: wide ? 20 : 45, r: 15, t: 10, b: 45 },
      xaxis: { tickvals: [...axes.keys()], ticktext: axes.map((a) => said(a.name)), tickangle: wide ? -25 : -60, range: [-0.4, axes.length - 0.6], showgrid: false, zeroline: false, fixedrange: true }, yaxis: { visible: false, range: [0.95 - top, top + 0.05], fixedrange: true } });
  }
  at.redraw = show;
  return show().then(() => {
    const mark = (list) => Plotly.restyle(at, (({ x, y }) => ({ x: [x], y: [y] }))(line(list)), [at.data.length - 1]);
    at.on("plotly_hover", ({ points: [p] }) => { if (p.customdata != null) mark([p.customdata]); });
    at.on("plotly_unhover", () => mark([]));
    at.on("plotly_selected", (found) => {
      if (!found?.range) return;
      const [[a, b], [c, d]] = [found.range.x, found.range.y].map((r) => r.slice().sort((p, q) => p - q));
      axes.forEach((_, k) => { if (a <= k && k <= b) state.kept[k] = [c, d]; });
      show();
    });
    at.on("plotly_deselect", () => { state.kept = {}; show(); });
  });
}

function cloud(at, data, shared, box) {
  const samples = shared.samples, columns = samples.columns, state = { x: data.x, y: data.y, tint: -1 }, names = columns.map((c, k) => [k, c.name]);
  for (const [label, key, first] of [["over", "x", []], ["result", "y", []], ["colour", "tint", [[-1, "none"]]]]) choice(box, label, [...first, ...names], (k) => { state[key] = Number(k); show(); }).value = state[key];
  const told = samples.number.map((_, n) => about(samples, n));
  function show() {
    const [x, y, c] = [columns[state.x], columns[state.y], columns[state.tint]], line = (own, along) => ({ type: "line", [own + "0"]: (own === "x" ? x : y).nominal, [own + "1"]: (own === "x" ? x : y).nominal, [along + "0"]: 0, [along + "1"]: 1, [along + "ref"]: "paper", line: { color: colour("before"), width: 1, dash: "dash" } });
    const marker = c ? { color: c.values, colorscale: "Viridis", showscale: true, colorbar: { thickness: 10, title: { text: said(c.name), side: "right" } } } : { color: colour("neutral") };
    const axis = (one) => ({ title: { text: said(one.name) }, type: one.log ? "log" : "linear", exponentformat: "power" });
    return draw(at, [{ type: "scatter", mode: "markers", x: x.values, y: y.values, text: told, hoverinfo: "text", marker: { size: 6, opacity: 0.75, ...marker } }], {
      hovermode: "closest", xaxis: axis(x), yaxis: axis(y), shapes: [...(x.nominal == null ? [] : [line("x", "y")]), ...(y.nominal == null ? [] : [line("y", "x")])] });
  }
  at.redraw = show;
  return show();
}

function influences(at, data) {
  const most = Math.max(...data.values.flat().map((v) => Math.abs(v ?? 0))) || 1, tip = data.values.map((row, i) => row.map((v, j) => `${said(data.rows[i])} over ${said(data.columns[j])}: ${short(v)}`));
  at.style.height = 9 + 1.5 * data.rows.length + "rem";
  return draw(at, [{ type: "heatmap", z: data.values, zmin: -most, zmax: most, colorscale: "RdBu", reversescale: true, text: tip, hoverinfo: "text", texttemplate: "%{z:.2f}", colorbar: { thickness: 10 } }], {
    xaxis: { tickvals: [...data.columns.keys()], ticktext: data.columns.map(said), tickangle: -25, showgrid: false }, yaxis: { tickvals: [...data.rows.keys()], ticktext: data.rows.map(said), autorange: "reversed", showgrid: false } });
}

function indices(at, data, shared, box) {
  const list = choice(box, "result", data.results.map((r, k) => [k, r.name]), () => show());
  function show() {
    const { series } = data.results[Number(list.value)];
    at.style.height = 8 + 1.6 * data.parameters.length * series.length + "rem";
    return draw(at, series.map((s, k) => ({ type: "bar", orientation: "h", name: s.name, y: [...s.values.keys()], x: s.values, marker: { color: colour(["neutral", "before"][k % 2]) },
      ...(s.half && { error_x: { type: "data", array: s.half, color: colour("soft") } }), hovertext: s.values.map((v, n) => `${said(data.parameters[n])}<br>${s.name} ${short(v)}` + (s.half ? ` ± ${short(s.half[n])}` : "")), hoverinfo: "text" })), {
      barmode: "group", showlegend: series.length > 1, legend: { orientation: "h", y: 1.02, yanchor: "bottom", x: 0 }, yaxis: { tickvals: [...data.parameters.keys()], ticktext: data.parameters.map(said), autorange: "reversed", showgrid: false }, xaxis: { title: { text: data.axis } } });
  }
  at.redraw = show;
  return show();
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

const DRAWN = { structure, remainder, shapes, responses, assurance, poles, steps, odds, ladder, panels, parallel, cloud, influences, indices };
const SPATIAL = ["structure", "remainder", "shapes"];

async function begin() {
  document.querySelectorAll("table").forEach(sortable);
  const figures = [...document.querySelectorAll(".live")];
  if (!figures.length || !window.DecompressionStream) return;
  const [common, ...words] = document.querySelectorAll(".numbers"), shared = JSON.parse(await unpacked(common));
  const script = document.createElement("script");
  script.textContent = await unpacked(document.getElementById("library"));
  document.head.append(script);
  const turns = !!document.createElement("canvas").getContext("webgl");
  async function start(figure) {
    const { draw: name, data } = JSON.parse(await unpacked(words[figure.dataset.word])), at = figure.querySelector(".plot");
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
  const near = new IntersectionObserver((seen) => seen.filter((s) => s.isIntersecting).forEach((s) => { near.unobserve(s.target); start(s.target); }), { rootMargin: "300px" });
  figures.forEach((figure) => near.observe(figure));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => figures.filter((f) => f.dataset.ready).forEach((f) => f.querySelector(".plot").redraw()));
}

begin();
