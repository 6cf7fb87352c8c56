"use strict";
// Draws measured profiles over computed ones; the form that starts sweeps and fits.
(() => {
  const { el } = Sidewall;
  const kMicrons = { nm: 1e-3, um: 1, "µm": 1, mm: 1e3, A: 1e-4, "Å": 1e-4 };

  // Points of a measured profile: columns x and z, else the first two; converted to `unit` if both units are known.
  Sidewall.profilePoints = (columns, unit) => {
    const column = (name, k) => columns.find((c) => c.name.toLowerCase() === name) || columns[k];
    const scaled = (c) => {
      const factor = kMicrons[c.unit] && kMicrons[unit] ? kMicrons[c.unit] / kMicrons[unit] : 1;
      return c.values.map((v) => v * factor);
    };
    if (columns.length < 2) throw new Error("a profile needs two columns, x and z");
    const x = scaled(column("x", 0)), z = scaled(column("z", 1));
    return x.map((v, k) => [v, z[k]]);
  };

  // Adds profiles, as [{ name, columns }], to the charts of sections through the wafer.
  Sidewall.overlay = (page, profiles) => {
    for (const section of page.sections)
      for (const chart of section.charts || [])
        if (chart.same_scale)
          profiles.forEach(({ name, columns }, k) => chart.series.push({
            name, dots: true, colour: `var(--c${(3 + k) % 8})`,
            points: Sidewall.profilePoints(columns, (/\[(.*)\]/.exec(chart.x) || [])[1]) }));
    return page;
  };

  const field = Sidewall.field = (label, width, value = "") => {
    const input = el("input", { type: "text", size: width, value, "aria-label": label });
    return { input, row: el("label", {}, `${label} `, input) };
  };

  // The form: a key, its range, and the targets of a fit. `start` takes { command, vary, target, target_profile }.
  Sidewall.studyForm = ({ numberAtCursor, profileNames, start }) => {
    const key = field("key", 20), low = field("from", 7), high = field("to", 7), count = field("runs", 3, "5");
    const target = field("target", 16), log = el("input", { type: "checkbox" }), profile = el("select", { "aria-label": "profile" });
    target.input.placeholder = "depth=2.0+-0.05";
    const take = () => {
      const found = numberAtCursor();
      if (!found) return false;
      key.input.value = found.key;
      const ends = [found.value * 0.5, found.value * 2].sort((a, b) => a - b);
      low.input.value = Number(ends[0].toPrecision(6));
      high.input.value = Number(ends[1].toPrecision(6));
      return true;
    };
    const range = (n) => `${key.input.value}=${low.input.value}:${high.input.value}${n}${log.checked ? ":log" : ""}`;
    const note = el("output", {});
    const go = (command) => {
      const aims = command === "fit" ? target.input.value.split(/[,;\s]+/).filter(Boolean) : [];
      const profiles = command === "fit" && profile.value ? [profile.value] : [];
      if (!key.input.value && !take()) { note.textContent = "First put the cursor on a number in the recipe."; return; }
      if (command === "fit" && !aims.length && !profiles.length) {
        note.textContent = "A fit needs a target, such as depth=2.0, or a measured profile, which is a CSV file in the folder.";
        return;
      }
      note.textContent = "";
      start({ command, vary: [range(command === "sweep" ? `:${count.input.value}` : "")], target: aims, target_profile: profiles });
    };
    const form = el("details", { class: "study" }, el("summary", {}, "Sweep or fit a number"),
      el("div", { class: "row" }, el("button", { type: "button", onclick: take }, "Number at the cursor"), key.row, low.row, high.row,
         el("label", {}, log, " log")),
      el("div", { class: "row" }, count.row, el("button", { type: "button", onclick: () => go("sweep") }, "Sweep"), target.row,
         el("label", {}, "or profile ", profile), el("button", { type: "button", onclick: () => go("fit") }, "Fit"), note));
    form.showProfiles = () => {
      const chosen = profile.value;
      profile.replaceChildren(el("option", { value: "" }, "none"), ...profileNames().map((name) => el("option", { value: name }, name)));
      profile.value = profileNames().includes(chosen) ? chosen : "";
    };
    form.showProfiles();
    return form;
  };
})();
