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
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", margin: { l: 60, r: more.showlegend ? 42 : 15, t: 25, b: 45 },
    font: { color: colour("ink"), size: 12, family: "system-ui, DejaVu Sans, sans-serif" },
    hoverlabel: { align: "left", bgcolor: colour("sheet"), font: { color: colour("ink") } },
    modebar: { bgcolor: "rgba(0,0,0,0)", color: colour("soft"), activecolor: colour("ink"), orientation: more.showlegend ? "v" : "h" },
    legend: { orientation: "h", y: -0.12 }, ...more,
  };
  for (const key of Object.keys(made)) if (/^[xy]axis/.test(key)) made[key] = { ...axis, automargin: true, ...made[key] };
  return made;
}

const draw = (at, traces, more) =>
  Plotly.react(at, traces, layout(more), { responsive: true, displaylogo: false, displayModeBar: at.clientWidth > 600, showSendToCloud: false, modeBarButtonsToRemove: ["select2d", "lasso2d", "zoom3d", "pan3d", "orbitRotation", "tableRotation", "resetCameraDefault3d", "resetCameraLastSave3d"] });

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

// ---- scenes: seen from one place, as large as they fit, with the axes in a corner

const dot = (a, b) => a.reduce((sum, v, k) => sum + v * b[k], 0);
const cross = (a, b) => [0, 1, 2].map((k) => a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3]);
const unit = (a) => { const long = Math.hypot(...a) || 1; return a.map((v) => v / long); };
const vector = ([x, y, z]) => ({ x, y, z });
const AXES = [["X", "#d62728"], ["Y", "#2ca02c"], ["Z", "#1f77b4"]];
const VIEWS = { X: [[1, 0, 0], [0, 0, 1]], Y: [[0, -1, 0], [0, 0, 1]], Z: [[0, 0, 1], [0, 1, 0]] };

const FOOT = 66, FLAT = { l: 0, r: 0, t: 0, b: FOOT };  // [px] for the axes, a legend, a colour bar

// ``bar`` pixels of the width are left to a colour bar.
function stage(at, mesh, box, from, bar = 0, balls = []) {
  const xyz = places(mesh), room = Math.max(0.22 * mesh.size, ...balls.map((b) => b.radius));  // of pins, and of shapes that move
  const least = (axis) => axis.reduce((a, b) => Math.min(a, b), Infinity), most = (axis) => axis.reduce((a, b) => Math.max(a, b), -Infinity);
  const range = xyz.map((axis) => [least(axis) - room, most(axis) + room]), long = range.map(([a, b]) => b - a), centre = range.map(([a, b]) => (a + b) / 2);
  const first = !at.view, view = (at.view ??= { eye: mesh.eye, up: mesh.up, ...from, zoom: 1 });
  const share = ([a, b] = [0, 1]) => b - a, [u, v, w] = xyz.map((axis, k) => axis.map((value) => value - centre[k]));
  const far = (d, b) => Math.abs(dot(d, b.at) - dot(d, centre)) + b.radius;
  const reach = (d) => Math.max(most(u.map((_, n) => Math.abs(d[0] * u[n] + d[1] * v[n] + d[2] * w[n]))) + 0.06 * mesh.size, ...balls.map((b) => far(d, b)));
  const frame = () => { const toward = unit(view.eye), right = unit(cross(view.up, toward)); return [right, cross(toward, right), toward]; };
  function fitted(domain) {  // a structure that turns stays within its picture
    const [right, above, toward] = frame(), high = (at.clientHeight - FOOT) * share(domain.y), wide = ((at.clientWidth - bar) * share(domain.x)) / high;
    const size = 0.95 * view.zoom * Math.min(wide / reach(right), 1 / reach(above)), far = 1.5 * Math.max(1, size * Math.max(...long));
    return { aspectratio: vector(long.map((v) => size * v)), camera: { center: vector([0, 0, 0]), eye: vector(toward.map((v) => far * v)), up: vector(above), projection: { type: "orthographic" } } };
  }
  const keys = () => Object.keys(at._fullLayout).filter((key) => /^scene\d?$/.test(key));
  function apply(turned) {  // the scene that is being turned has its camera already
    for (const key of keys()) {
      const seen = fitted(at._fullLayout[key].domain), { _scene } = at._fullLayout[key];
      for (const held of [at.layout[key], at._fullLayout[key]]) Object.assign(held, seen);
      if (key === turned) _scene.glplot.setAspectratio(seen.aspectratio);
      else _scene.setViewport(seen);
    }
    axes();
  }
  function axes() {
    const [right, above] = frame();
    if (!at.querySelector(".triad")) at.insertAdjacentHTML("beforeend", '<svg class="triad" viewBox="-32 -32 64 64"></svg>');
    at.querySelector(".triad").innerHTML = AXES.map(([name, tint], k) => {
      const [x, y] = [22 * right[k], -22 * above[k]];
      return `<line x2="${x}" y2="${y}" stroke="${tint}" stroke-width="2.5"/><text x="${1.3 * x}" y="${1.3 * y + 4}" fill="${tint}">${Math.hypot(x, y) > 6 ? name : ""}</text>`;
    }).join("");
  }
  function follow(to) {
    const key = keys().find((k) => to[k + ".camera"]);
    if (!key) return;
    const { _scene, domain } = at._fullLayout[key], camera = _scene.getCamera(), values = ({ x, y, z }) => [x, y, z];
    const eye = unit(values(camera.eye)), up = values(camera.up);
    if (dot(eye, unit(view.eye)) > 1 - 1e-9) view.zoom *= _scene.glplot.getAspectratio().x / fitted(domain).aspectratio.x;
    Object.assign(view, { eye, up });
    apply(key);
  }
  if (first) {
    const [start, startUp] = [view.eye, view.up], look = (eye, up) => { Object.assign(view, { eye, up, zoom: 1 }); apply(); };
    const group = box.appendChild(document.createElement("span"));
    group.className = "views";
    group.append("view ");
    button(group, "start", () => look(start, startUp));
    button(group, "behind", () => look(start.map((v) => -v), startUp));
    for (const [name, seen] of Object.entries(VIEWS)) button(group, name, () => look(...seen));
    at.tabIndex = 0;
    at.addEventListener("pointerdown", () => at.focus({ preventScroll: true }), true);
    at.addEventListener("keydown", (e) => { if (e.key === "Escape") at.blur(); });
    at.addEventListener("wheel", (e) => { if (document.activeElement !== at) e.stopPropagation(); }, true);  // the page scrolls
  }
  const axis = (k) => ({ visible: false, showspikes: false, range: range[k] });
  return {
    scene: (domain = {}) => ({ xaxis: axis(0), yaxis: axis(1), zaxis: axis(2), aspectmode: "manual", dragmode: "orbit", domain, ...fitted(domain) }),
    async drawn(shown) {
      await shown;
      axes();
      if (first) for (const event of ["plotly_relayouting", "plotly_relayout"]) at.on(event, (to) => requestAnimationFrame(() => follow(to)));
    },
  };
}

function ball([x, y, z], r, name, tint) {
  const p = [[], [], []], rows = 9, round = 16, faces = [[], [], []];
  for (let a = 0; a <= rows; a++)
    for (let b = 0; b < round; b++) {
      const u = (Math.PI * a) / rows, v = (2 * Math.PI * b) / round;
      [x + r * Math.sin(u) * Math.cos(v), y + r * Math.sin(u) * Math.sin(v), z + r * Math.cos(u)].forEach((w, k) => p[k].push(w));
      const [here, next, down] = [a * round + b, a * round + ((b + 1) % round), (a + 1) * round];
      if (a < rows) [[here, next, down + b], [next, down + ((b + 1) % round), down + b]].forEach((t) => t.forEach((w, k) => faces[k].push(w)));
    }
  return { type: "mesh3d", x: p[0], y: p[1], z: p[2], i: faces[0], j: faces[1], k: faces[2], color: colour(tint), opacity: 0.25,
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

function structure(at, data, shared, box) {
  const mesh = shared.mesh, xyz = places(mesh), traces = [], tints = ["found", "warn"], eye = unit(data.from?.eye ?? mesh.eye);
  const meant = new Map(data.spots.toReversed().flatMap((s) => s.parts.map((part) => [part, s]))), balls = data.spots.flatMap((s) => s.at.slice(0, 3).map((at) => ({ at, radius: s.radius }))), seen = stage(at, mesh, box, data.from, 0, balls);
  if (mesh.i.length) {
    traces.push(sheet(mesh, xyz, {}, meant.size ? (f) => !meant.has(mesh.part[f]) : null));
    for (const [part, s] of meant) traces.push(sheet(mesh, xyz, { color: colour(tints[s.rank]), hovertext: mesh.ids.map((id) => `grid ${id}, ${wrapped(s.text)}`) }, (f) => mesh.part[f] === part));
  }
  traces.push(lines(ends(mesh.fine, xyz), 1, "soft"), lines(ends(mesh.edges, xyz), 3, "ink"));
  for (const [name, list] of Object.entries(data.setup)) traces.push(...markers(list, name, ...SYMBOLS[name], name === "cords" ? 0 : 0.06 * mesh.size));
  for (const spot of data.spots) {
    const text = wrapped(spot.text), tint = tints[spot.rank], name = said(spot.name);
    if (spot.radius) for (const p of spot.at.slice(0, 3)) traces.push(ball(p, spot.radius, text, tint));
    for (const [mode, by] of spot.at.length ? [["markers+text", 0.03], ["markers", -0.03]] : []) {  // clear of the sheet, on either side
      const [x, y, z] = [0, 1, 2].map((k) => spot.at.map((p) => p[k] + by * mesh.size * eye[k]));
      traces.push({ type: "scatter3d", mode, name, x, y, z, text: [name], textposition: ["top center", "bottom center"][spot.rank], textfont: { color: colour(tint), size: 13 }, legendgroup: name, showlegend: by > 0,
        hoverinfo: "text", hovertext: text, marker: { size: 9, color: colour(tint), symbol: "cross" } });
    }
  }
  return seen.drawn(draw(at, traces, { scene: seen.scene(), margin: FLAT, legend: { orientation: "h", x: 1, xanchor: "right", y: 0, yanchor: "top" } }));
}

function remainder(at, data, shared, box) {
  const mesh = shared.mesh, xyz = places(mesh), value = scaled(data.value, data.step), title = data.title, seen = stage(at, mesh, box, {}, 100);
  const known = (f) => value[f] != null, shown = mesh.face.filter(known).map((f) => value[f]);
  return seen.drawn(draw(at, [
    sheet(mesh, xyz, {}, (f) => !known(f)),
    sheet(mesh, xyz, { intensity: shown, intensitymode: "cell", cmin: data.low, cmax: data.top, colorscale: data.colours.replace("_r", ""), reversescale: !data.colours.endsWith("_r"), colorbar: { thickness: 12, len: 0.8, title: { text: said(title), side: "right" } },
      hovertemplate: `${said(title)} %{intensity:.4g}<extra></extra>` }, known),
    lines(ends(mesh.edges, xyz), 3, "ink"),
  ], { scene: seen.scene(), margin: FLAT }));
}

// Modes of the test and of decks, each ``data.sides`` a list of them; ``data.rows`` pairs their
// positions, in the order of the sides. Two of them are seen next to each other.
function shapes(at, data, shared, box) {
  const mesh = shared.mesh, names = Object.keys(data.sides), count = data.rows.length;
  const state = { row: 0, side: [names[0], names.length > 1 ? names[names.length - 1] : null], at: [null, null], size: 0.08, run: !matchMedia("(prefers-reduced-motion: reduce)").matches };
  const called = (name) => (name === "expanded" ? "test on the mesh" : ["test", "model"].includes(name) || name.includes(".") ? name : "deck " + name), own = (row) => names.map((n, k) => data.sides[n][row[k]]).find((m) => m);
  const mode = (n) => data.sides[state.side[n]]?.[state.at[n]], sensed = (n) => mode(n)?.[state.side[n] === "test" ? "motion" : "sensors"];
  const list = choice(box, "mode", data.rows.map((row, k) => [k, `${own(row).number ?? k + 1}: ${hertz(own(row).hz)}`]), (v) => pair(Number(v)));
  if (count > 1) for (const [word, by] of [["previous", -1], ["next", 1]]) button(box, word, () => pair(((state.row ?? 0) + by + count) % count));
  const pickers = names.length < 2 ? [] : ["left", "right"].map((word, n) => choice(box, word, names.map((name) => [name, called(name)]), (v) => { state.side[n] = v; pair(state.row ?? 0); }));
  choice(box, "amplitude", [[0.03, "small"], [0.08, "medium"], [0.2, "large"]], (v) => { state.size = Number(v); show(); }).value = state.size;
  const stop = button(box, "", () => { state.run = !state.run; label(); tick(); }), seen = stage(at, mesh, box);
  const label = () => { stop.textContent = state.run ? "stop" : "play"; stop.setAttribute("aria-pressed", state.run); };

  function pair(k) {
    Object.assign(state, { row: k, at: state.side.map((name) => data.rows[k][names.indexOf(name)] ?? null) });
    return show();
  }
  function title(n) {
    const m = mode(n), [a, b] = state.side, name = called(state.side[n]), [i, j] = state.at;
    if (!m) return `${name}: no partner`;
    const mac = n && mode(0) ? data.mac[`${a}|${b}`]?.[i]?.[j] ?? data.mac[`${b}|${a}`]?.[j]?.[i] : null;
    return `${name} ${m.number ?? ""} ${hertz(m.hz)}` + (m.damping != null ? `, damping ${(100 * m.damping).toFixed(2)} %` : "") + (mac != null ? `, MAC ${mac.toFixed(3)}` : "");
  }
  function moved(n, phase) {  // coordinates of the traces that move: sensors with their sticks, or the mesh
    const far = state.size * mesh.size * phase, m = mode(n)?.motion;
    if (state.side[n] !== "test") {
      const sign = n && sensed(0) && sensed(1) && dot(sensed(0), sensed(1)) < 0 ? -1 : 1, xyz = places(mesh, m, (sign * far) / 1000);
      return [{ x: xyz[0], y: xyz[1], z: xyz[2] }, ends(mesh.edges, xyz), ends(mesh.fine, xyz)];
    }
    const tip = (k) => data.sensors.map((s, i) => s.at[k] + ((m ? m[i] : 0) / 1000) * far * s.along[k]);
    const [x, y, z] = [tip(0), tip(1), tip(2)], stick = (axis, k) => data.sensors.flatMap((s, i) => [s.at[k], axis[i], null]);
    return [{ x, y, z }, { x: stick(x, 0), y: stick(y, 1), z: stick(z, 2) }];
  }
  const scale = (more) => ({ cmin: 0, cmax: 1000, colorscale: "Viridis", colorbar: { orientation: "h", thickness: 8, len: 0.5, x: 1, xanchor: "right", y: 0, yanchor: "top", tickvals: [0, 500, 1000], ticktext: ["0", "0.5", "1"], title: { text: "share of the largest motion", side: "top", font: { size: 11 } } }, ...more });
  function traces(n, scene, last) {
    const [first, second, third] = moved(n, 1), m = mode(n)?.motion, rest = places(mesh), ghost = lines(ends(mesh.edges, rest), 2, "soft");
    if (state.side[n] === "test") {
      const marks = { type: "scatter3d", mode: "markers", ...first, showlegend: false, hoverinfo: "text", hovertext: data.sensors.map((s, i) => `${said(s.label)}: ${m ? (m[i] / 1000).toFixed(2) : "–"} of the largest`),
        marker: { size: 5, ...scale({ color: m ? m.map(Math.abs) : data.sensors.map(() => 0), showscale: last }) } };
      return [marks, lines(second, 5, "before"), ...(mesh.i.length ? [sheet(mesh, rest, { opacity: 0.35 })] : []), ghost].map((t) => ({ ...t, scene }));
    }
    const size = m ? m[0].map((_, k) => Math.hypot(m[0][k], m[1][k], m[2][k])) : mesh.x.map(() => 0);
    const surface = mesh.i.length ? sheet(mesh, [first.x, first.y, first.z], scale({ intensity: size, showscale: last, hovertext: mesh.ids.map((id, k) => `grid ${id}: ${(size[k] / 1000).toFixed(2)} of the largest`) })) : lines(first, 1, "line");
    return [surface, lines(second, 3, "ink"), lines(third, 1, "soft"), { ...ghost, opacity: 0.6 }].map((t) => ({ ...t, scene }));
  }
  let parts = [];  // traces of each side
  const narrow = at.clientWidth < 600;
  async function show() {
    const both = state.side[1] != null;
    list.value = state.row ?? "";
    pickers.forEach((picker, n) => { picker.value = state.side[n]; });
    at.style.height = both ? "" : "26rem";
    const note = (text, x, y) => ({ text: said(text), x, y, xref: "paper", yref: "paper", showarrow: false, xanchor: "left", yanchor: "top" });
    const domains = !both ? [{}] : narrow ? [{ x: [0, 1], y: [0.52, 1] }, { x: [0, 1], y: [0, 0.48] }] : [{ x: [0, 0.5], y: [0, 1] }, { x: [0.5, 1], y: [0, 1] }];
    parts = domains.map((_, n) => traces(n, n ? "scene2" : "scene", n === domains.length - 1));
    await seen.drawn(draw(at, parts.flat(), {
      ...Object.fromEntries(domains.map((place, n) => [n ? "scene2" : "scene", seen.scene(place)])), margin: FLAT,
      annotations: domains.map((place, n) => note(title(n), (place.x?.[0] ?? 0) + 0.01, place.y?.[1] ?? 1)),
    }));
    label();
  }
  let busy = false, timer, inView = true;
  const start = performance.now();
  async function tick() {
    clearTimeout(timer);
    if (busy || !state.run || !inView || document.hidden) return;
    busy = true;
    const begun = performance.now(), phase = Math.sin((begun - start) / 250), sides = parts.map((_, n) => moved(n, phase)), all = sides.flat();
    const of = (axis) => all.map((p) => p[axis]);
    await Plotly.restyle(at, { x: of("x"), y: of("y"), z: of("z") }, sides.flatMap((side, n) => side.map((_, k) => k + (n ? parts[0].length : 0))));
    at.dataset.frames = Number(at.dataset.frames || 0) + 1;
    busy = false;
    timer = setTimeout(tick, Math.max(30, performance.now() - begun));  // half the time is left to the rest of the page
  }
  at.redraw = () => show();
  at.open = (to) => {  // a row, or a mode of each side
    if (typeof to === "number") return pair(to);
    const whole = state.side.includes("expanded");  // the test stays on the mesh
    Object.assign(state, { side: to.map(([name]) => (whole && name === "test" ? "expanded" : name)), at: to.map(([, k]) => k) });
    const row = data.rows.findIndex((r) => to.every(([name, k]) => r[names.indexOf(name)] === k));
    state.row = row < 0 ? null : row;
    return show();
  };
  document.addEventListener("visibilitychange", tick);
  new IntersectionObserver(([shown]) => { inView = shown.isIntersecting; tick(); }).observe(at);
  return pair(0).then(tick);
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
  if (choices.length) at.open = (k) => { picked[0] = k; box.querySelector("select").value = k; return show(); };
  return show().then(() => { if (spec.pick) picks(at, spec.pick, box); brush?.listen(); at.on("plotly_click", opens); });
}

// A square of a matrix opens its pair of modes, a bar its row.
function opens({ points: [p] }) {
  const { opens, sides } = p.data.meta ?? {};
  if (opens) open(opens, sides ? [[sides[0], p.y], [sides[1], p.x]] : p.x);
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
const PAPER = 740;  // [px] of a page whose drawings fit a sheet of A4; they keep the width that they have on the screen
let once = () => {};

// Go to a drawing and show the given part of it.
async function open(name, to) {
  const figure = document.querySelector(`.live[data-name="${CSS.escape(name)}"]`);
  if (!figure) return;
  await once(figure);
  figure.scrollIntoView({ block: "center", behavior: "smooth" });
  await figure.querySelector(".plot").open?.(to);
}

async function begin() {
  document.querySelectorAll("table").forEach(sortable);
  for (const row of document.querySelectorAll("[data-opens]")) {
    const go = () => open(row.dataset.opens, Number(row.dataset.at));
    row.addEventListener("click", () => { if (!getSelection().toString()) go(); });
    row.addEventListener("keydown", (e) => { if (e.key === "Enter") go(); });
  }
  addEventListener("beforeprint", () => {
    document.querySelectorAll("details").forEach((d) => { d.open = true; });
    document.documentElement.style.setProperty("--fit", Math.min(1, PAPER / document.querySelector("main").clientWidth));
  });
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
  const begun = new Map();
  once = (figure) => begun.get(figure) ?? begun.set(figure, start(figure)).get(figure);
  const near = new IntersectionObserver((seen) => seen.filter((s) => s.isIntersecting).forEach((s) => once(s.target)), { rootMargin: "300px" });
  figures.forEach((figure) => near.observe(figure));
  const redraw = () => figures.filter((f) => f.dataset.ready).forEach((f) => f.querySelector(".plot").redraw());
  for (const media of ["(prefers-color-scheme: dark)", "print"]) matchMedia(media).addEventListener("change", redraw);
  for (const figure of figures) {  // all of it is there when it is printed
    await new Promise((next) => (window.requestIdleCallback ?? setTimeout)(next, { timeout: 300 }));  // a shape that moves leaves no idle time
    await once(figure);
  }
}

begin();
