"use strict";
// Draws the figures, keeps them in the page's colours, and lets the legend hide what it names.
(function () {
  const documents = JSON.parse(document.getElementById("documents").textContent);
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const touch = window.matchMedia("(pointer: coarse)");
  const onDark = {
    "#000000": "#f0f3f5", "#0072b2": "#56b4e9", "#d55e00": "#ff8a3d", "#009e73": "#2fd3a2", "#7f7f7f": "#a3abb2",
    "#dddddd": "#4a535b", "#cc79a7": "#e79cc6", "#56b4e9": "#9bd3f5", "#e69f00": "#ffbf3f",
  };
  const drawn = {}, views = {};  // by figure: its document in BokehJS, and what shows it
  window.figures = views;  // for scripts that look at the page
  const inks = new WeakMap();  // by model: its colours on white paper

  const ink = (colour, night) => (night && onDark[String(colour).toLowerCase()]) || colour;

  function paint(night) {
    const style = getComputedStyle(document.documentElement);
    const named = (name) => style.getPropertyValue(name).trim();
    const [text, soft, grid] = night === dark.matches
      ? ["--ink", "--soft", "--grid"].map(named)
      : ["#000000", "#444444", "#e6eaed"];
    for (const doc of Object.values(drawn)) {
      for (const model of doc.all_models) recolour(model, { text, soft, grid }, night);
    }
    for (const mark of document.querySelectorAll("[data-ink]")) {
      const colour = ink(mark.dataset.ink, night);
      mark.setAttribute(mark.tagName === "line" ? "stroke" : "fill", colour);
    }
  }

  function recolour(model, page, night) {
    const kind = model.type;
    if (kind === "Figure") {
      model.setv({ background_fill_color: null, border_fill_color: null, outline_line_color: null });
    } else if (/Axis$/.test(kind)) {
      model.setv({ axis_line_color: page.soft, major_tick_line_color: page.soft, minor_tick_line_color: null,
        major_label_text_color: page.soft, axis_label_text_color: page.text, axis_label_text_font_style: "normal",
        axis_label_text_font_size: "12px", major_label_text_font_size: "11px", axis_label_standoff: 6 });
    } else if (kind === "Grid") {
      model.setv({ grid_line_color: page.grid });
    } else if (kind === "Title") {
      model.setv({ text_color: page.text });
    } else {
      for (const name of ["line_color", "fill_color"]) remember(model, name, night);
    }
  }

  function remember(model, name, night) {
    if (!(name in model.properties)) return;
    if (!inks.has(model)) inks.set(model, {});
    const kept = inks.get(model), now = model[name];
    const given = kept[name] ?? (now && typeof now === "object" ? now.value : now);
    if (typeof given !== "string") return;
    kept[name] = given;
    model[name] = now && typeof now === "object" ? { value: ink(given, night) } : ink(given, night);
  }

  function toggle(button) {
    const shown = button.getAttribute("aria-pressed") !== "true";
    button.setAttribute("aria-pressed", String(shown));
    const tag = "g" + button.dataset.group;
    for (const model of drawn[button.dataset.figure].all_models) {
      if (model.type === "GlyphRenderer" && model.tags.includes(tag)) model.visible = shown;
    }
  }

  // On a phone a finger that drags scrolls the page; and long names at an axis stand upright.
  function fit(doc, place) {
    const narrow = place.clientWidth < 560;
    for (const model of doc.all_models) {
      if (model.type === "Toolbar" && touch.matches) model.active_drag = null;
      if (!model.tags || !model.tags.includes("places")) continue;
      const names = [...model.major_label_overrides.values()].map((one) => one.text.length);
      const room = place.clientWidth / Math.max(1, names.length) / 7;
      const below = doc.roots()[0].children.some((plot) => plot.below.includes(model));
      if (below) model.major_label_orientation = Math.max(...names) > room ? (narrow ? "vertical" : 0.7) : "horizontal";
    }
  }

  async function draw(name) {
    const place = document.getElementById(name + "-plot");
    const json = documents[name];
    const items = [{ docid: name, roots: { [json.roots[0].id]: place }, root_ids: [json.roots[0].id] }];
    const [manager] = await Bokeh.embed.embed_items({ [name]: json }, items);
    views[name] = manager.roots[0];
    drawn[name] = views[name].model.document;
    fit(drawn[name], place);
  }

  // Paper has no canvas: while it is printed, a picture stands in each one's place.
  function beforePrint() {
    paint(false);
    for (const [name, view] of Object.entries(views)) {
      const place = document.getElementById(name + "-plot");
      for (const old of place.querySelectorAll(":scope > img")) old.remove();
      const picture = new Image();
      picture.alt = "";
      picture.src = view.export("png", true).canvas.toDataURL();
      place.append(picture);
      place.classList.add("printed");
    }
    for (const numbers of document.querySelectorAll("details.numbers")) numbers.open = true;
  }

  function afterPrint() {
    for (const place of document.querySelectorAll(".plot")) place.classList.remove("printed");
    paint(dark.matches);
  }

  async function all() {
    Bokeh.set_log_level("warn");
    for (const name of Object.keys(documents)) await draw(name);
    paint(dark.matches);
    dark.addEventListener("change", () => paint(dark.matches));
    window.addEventListener("beforeprint", beforePrint);
    window.addEventListener("afterprint", afterPrint);
    for (const button of document.querySelectorAll(".legend button")) {
      button.addEventListener("click", () => toggle(button));
    }
    document.documentElement.dataset.drawn = String(Object.keys(drawn).length);
  }

  all();
})();
