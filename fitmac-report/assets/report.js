"use strict";
// The viewer of episodes: filters, a list, and the timeline of the chosen one.
(() => {
  const read = (id) => {
    const element = document.getElementById(id);
    return element ? JSON.parse(element.textContent) : null;
  };
  const all = read("episodes-data") || [];
  const pictures = read("pictures-data") || {};
  const MOST = 500; // lines that the list shows
  const filters = [
    ["s", "Suite"], ["p", "Perturbation"], ["b", "Surrogate"], ["c", "Configuration"], ["f", "Profile"],
  ];
  const results = {
    all: () => true,
    failed: (e) => !e.ok,
    harmed: (e) => harmed.has(e),
    saved: (e) => e.c !== "base" && e.ok && alone.get(e.q) === false,
    "with a correction": (e) => e.a.length > 0,
    "with pictures": (e) => key(e) in pictures,
  };
  const alone = new Map(all.filter((e) => e.c === "base").map((e) => [e.q, e.ok]));
  const harmed = new Set(all.filter((e) => e.c !== "base" && !e.ok && alone.get(e.q) === true));
  const key = (e) => [e.q, e.c, e.f, e.v, e.k].join("/");
  const byId = (id) => document.getElementById(id);
  const element = (name, text, attributes = {}) => {
    const made = document.createElement(name);
    if (text !== undefined) made.textContent = text;
    Object.entries(attributes).forEach(([k, v]) => made.setAttribute(k, v));
    return made;
  };
  const choice = (label, values) => {
    const box = element("label", label);
    const select = element("select");
    values.forEach((v) => select.append(element("option", v, { value: v })));
    select.addEventListener("change", fill);
    box.append(select);
    byId("filters").append(box);
    return select;
  };
  const selects = filters.map(([field, label]) => {
    const values = [...new Set(all.map((e) => e[field]))].sort();
    return [field, choice(label, ["all", ...values])];
  });
  const result = choice("Result", Object.keys(results));
  let shown = [];
  let current = -1;

  function fill() {
    shown = all.filter((e) =>
      selects.every(([field, s]) => s.value === "all" || e[field] === s.value) && results[result.value](e));
    const part = shown.length > MOST ? `, the first ${MOST} listed` : "";
    byId("count").textContent = `${shown.length} of ${all.length} episodes${part}`;
    byId("list").replaceChildren(...shown.slice(0, MOST).map(line));
    show(shown.length ? 0 : -1, false);
  }

  const verdict = (e) => (e.ok ? "success" : e.x) + (harmed.has(e) ? ", harmed" : "");

  function line(e, i) {
    const button = element("button", undefined, { type: "button" });
    button.append(element("span", verdict(e), { class: e.ok ? "good" : "bad" }));
    button.append(` ${e.s} ${e.t}, ${e.p}${e.l === "standard" ? "" : " " + e.l}, ${e.b} surrogate, ${e.c}, ` +
      `seed ${e.n}, episode ${e.e}`);
    button.addEventListener("click", () => show(i, true));
    const item = element("li");
    item.append(button);
    return item;
  }

  function show(i, focus) {
    const buttons = byId("list").querySelectorAll("button");
    buttons[current]?.removeAttribute("aria-current");
    current = i;
    byId("detail").replaceChildren();
    byId("previous").disabled = i <= 0;
    byId("next").disabled = i < 0 || i + 1 >= buttons.length;
    const button = buttons[i];
    if (!button) return;
    button.setAttribute("aria-current", "true");
    if (focus) {
      button.focus({ preventScroll: true });
      button.scrollIntoView({ block: "nearest" });
    }
    detail(shown[i]);
  }

  const COLOURS = { pick: "#0072b2", place: "#d55e00", settle: "#009e73" };
  const marks = (e) => [
    ["o", e.o, "onset of the failure, seen by the simulator", "#a33a00"],
    ["d", e.d, "first diagnosis", "#7a4fa3"],
    ["i", e.i, "first replaced action", "#0072b2"],
  ].filter((m) => m[1] !== null);

  function timeline(e) {
    const space = "http://www.w3.org/2000/svg";
    const width = 720, left = 10, right = 710;
    const x = (step) => left + (right - left) * step / Math.max(1, e.u);
    const parts = [];
    const add = (name, attributes, text) => {
      const made = document.createElementNS(space, name);
      Object.entries(attributes).forEach(([k, v]) => made.setAttribute(k, v));
      if (text !== undefined) {
        const title = document.createElementNS(space, "title");
        title.textContent = text;
        made.append(title);
      }
      parts.push(made);
      return made;
    };
    const words = (at, y, text, anchor = "middle") =>
      add("text", { x: at, y, "text-anchor": anchor, "font-size": 12, fill: "#1c2329" }).append(text);
    add("rect", { x: left, y: 34, width: right - left, height: 26, fill: "#e8ebef" }, "the policy acts");
    e.a.forEach(([kind, from, to, ending]) => {
      const w = Math.max(2, x(to + 1) - x(from));
      add("rect", { x: x(from), y: 34, width: w, height: 26, fill: COLOURS[kind] || "#555", stroke: "#fff" },
        `${kind}, steps ${from} to ${to}: ${ending}`);
    });
    marks(e).forEach(([name, step, what, colour], i) => {
      add("path", { d: `M${x(step)} 30v34`, stroke: colour, "stroke-width": 2 }, `${what}, step ${step}`);
      words(Math.min(Math.max(x(step), 16), width - 16), 26 - 13 * (i % 2), ["onset", "diagnosis", "acts"]["odi".indexOf(name)]);
    });
    for (let k = 0; k <= 4; k += 1) {
      const step = Math.round(e.u * k / 4);
      words(x(step), 80, String(step), k === 0 ? "start" : k === 4 ? "end" : "middle");
    }
    const svg = document.createElementNS(space, "svg");
    svg.setAttribute("viewBox", `0 0 ${width} 90`);
    svg.setAttribute("width", width);
    svg.setAttribute("role", "img");
    svg.setAttribute("aria-label", `Timeline of ${e.u} policy steps; the table below says the same in words.`);
    svg.append(...parts);
    return svg;
  }

  function detail(e) {
    const box = byId("detail");
    const title = element("h3", `${e.t}: `);
    title.append(element("span", verdict(e), { class: e.ok ? "good" : "bad" }));
    box.append(title, timeline(e), frames(e));
    const rows = [
      ["scene", `${e.s}, ${e.p} ${e.l}${e.y ? ": " + e.y : ""}`],
      ["policy", `${e.b} surrogate, ${e.c}, ${e.f} profile, ${e.v} poses, grounding by ${e.k}`],
      ["draws", `seed ${e.n}, episode ${e.e}`],
      ["length", `${e.u} steps, ${e.z.toFixed(1)} s`],
      ["alone", alone.has(e.q) ? (alone.get(e.q) ? "succeeds" : "fails") : "not played"],
      ["rebinds", String(e.r)],
      ["gate stayed shut for", e.g.join(", ") || "–"],
      ["object to destination in the end", `${e.m.toFixed(3)} m`],
    ];
    if (!e.w) rows.push(["ceiling", "the target is wider than the gripper opens"]);
    marks(e).forEach(([, step, what]) => rows.push([`step ${step}`, what]));
    e.a.forEach(([kind, from, to, ending]) => rows.push([`steps ${from} to ${to}`, `${kind}: ${ending}`]));
    const table = element("table");
    const body = element("tbody");
    rows.forEach(([name, value]) => {
      const row = element("tr");
      row.append(element("th", name, { scope: "row" }), element("td", value));
      body.append(row);
    });
    table.append(body);
    box.append(table);
  }

  function frames(e) {
    const box = element("div", undefined, { id: "frames" });
    (pictures[key(e)] || []).forEach(([caption, png]) => {
      const figure = element("figure");
      figure.append(element("img", undefined, { src: "data:image/png;base64," + png, alt: caption }));
      figure.append(element("figcaption", caption));
      box.append(figure);
    });
    return box;
  }

  const step = (by) => {
    const next = current + by;
    if (next >= 0 && next < Math.min(shown.length, MOST)) show(next, true);
  };
  byId("previous").addEventListener("click", () => step(-1));
  byId("next").addEventListener("click", () => step(1));
  byId("list").addEventListener("keydown", (event) => {
    const by = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (by) {
      event.preventDefault();
      step(by);
    }
  });
  fill();
})();
