"use strict";
// The text editor of recipes: completion and help from the program's table of keys; errors are shown under their line.
(() => {
  const { el } = Sidewall, kHeader = /^\s*(\[\[?)\s*([\w.]+)\s*\]\]?/, kKey = /^\s*("[^"]*"|[\w-]+)\s*=/;

  // Makes `work` run one at a time: calls while it runs cause one more run after it.
  Sidewall.latest = (work, failed) => {
    let busy = null, again = false;
    const go = () => {
      again = Boolean(busy);
      return busy || (busy = work().finally(() => {
        busy = null;
        if (again) go().catch(failed);
      }));
    };
    return go;
  };

  class Editor {
    // `docs` are the sections of the key table; `changed` is called after every change by the user.
    constructor(holder, docs, changed) {
      this.docs = docs;
      this.help = el("p", { class: "help" });
      this.problem = el("p", { class: "problem", role: "alert", hidden: "" });
      const box = el("div", { class: "editor" });
      holder.append(box, this.problem, this.help);
      this.mirror = CodeMirror(box, {
        mode: "toml", lineNumbers: true, gutters: ["CodeMirror-linenumbers"], inputStyle: "contenteditable",
        extraKeys: {
          "Ctrl-Space": "autocomplete", Tab: (cm) => cm.execCommand("insertSoftTab"),
          Esc: (cm) => cm.getInputField().blur(),  // leaves the editor by keyboard, as Tab indents
        },
        hintOptions: { hint: (cm) => this.hint(cm), completeSingle: false },
      });
      this.mirror.getInputField().setAttribute("aria-label", "recipe");
      this.mirror.on("change", (cm, change) => change.origin !== "setValue" && changed());
      this.mirror.on("cursorActivity", () => this.showHelp());
      this.mirror.on("inputRead", (cm, change) => /[\w[]/.test(change.text[0]) && cm.showHint());
    }

    // The line ending of a text. The editor keeps only one, so mixed endings are refused.
    static lineEnd(text) {
      const ends = new Set(text.match(/\r\n?|\n/g));
      if (ends.size > 1) throw new Error("its lines end in different ways (LF and CRLF): convert it, for example with dos2unix");
      return [...ends][0] || "\n";
    }

    get text() { return this.mirror.getValue(this.newline); }
    set text(text) {
      this.newline = Editor.lineEnd(text);
      this.mirror.setValue(text);
      this.mirror.clearHistory();
    }

    append(text) {
      this.mirror.replaceRange(text, CodeMirror.Pos(this.mirror.lastLine()), undefined, "+input");
      this.mirror.setCursor(this.mirror.lastLine(), 0);
      this.mirror.focus();
    }

    // Columns [from, to] of a problem in its line: at its column if given, else the value or key that it names first.
    place(text, { column, problem }) {
      if (column) return [column - 1, column + /^[\w.-]*/.exec(text.slice(column))[0].length];
      const key = (/^[^\s:=]*?([\w-]+)(?:\[\d+\])*(?: =|:)/.exec(problem) || [])[1], from = key ? text.indexOf(key) : -1;
      const value = /=\s*([^#]*[^#\s])/.exec(text);
      if (from < 0) return null;
      return value && !problem.includes("unknown") ? [value.index + value[0].length - value[1].length, value.index + value[0].length]
        : [from, from + key.length];
    }

    // Shows a problem, under its line if that is known; null removes it.
    mark(problem) {
      if (this.fault) this.fault.clear();
      if (this.widget) this.widget.clear();
      if (this.marked) this.mirror.removeLineClass(this.marked, "background", "wrong");
      this.fault = this.widget = this.marked = null;
      this.problem.hidden = !problem || problem.line !== null;
      this.problem.textContent = problem ? problem.problem : "";
      if (!problem || problem.line === null) return;
      const line = Math.min(problem.line, this.mirror.lineCount()) - 1;
      this.marked = this.mirror.addLineClass(line, "background", "wrong");
      const place = this.place(this.mirror.getLine(line), problem);
      if (place) this.fault = this.mirror.markText(...place.map((ch) => ({ line, ch })), { className: "fault" });
      this.widget = this.mirror.addLineWidget(line, el("div", { class: "problem", role: "alert" }, problem.problem));
    }

    // The section of a line: its path, as in step[0], the name in its header, and its lines.
    section(line) {
      const count = new Map();
      let found = { path: "", name: "", lines: [] };
      this.mirror.eachLine((handle) => {
        const n = this.mirror.getLineNumber(handle), header = kHeader.exec(handle.text);
        if (header && n <= line) {
          let path = "";
          const parts = header[2].split(".");
          parts.forEach((part, k) => {
            path += (k ? "." : "") + part;
            if (header[1] === "[[") {
              const last = k + 1 === parts.length;
              if (last) count.set(path, (count.has(path) ? count.get(path) : -1) + 1);
              path += `[${count.get(path) || 0}]`;
            }
          });
          found = { path, name: header[2], lines: [] };
        } else if (header) {
          found.closed = true;
        } else if (!found.closed) {
          found.lines.push(handle.text);
        }
      });
      return found;
    }

    // The section of the key table that documents a section of the recipe.
    doc({ name, lines }) {
      const value = (key) => {
        const line = lines.find((text) => kKey.exec(text) && kKey.exec(text)[1] === key);
        return line ? (/=\s*"([^"]*)"/.exec(line) || [])[1] : undefined;
      };
      if (name === "layer") return this.docs.find((d) => d.name === `layer ${value("shape") || "plane"}`);
      if (name.startsWith("step")) return this.docs.find((d) => d.name === (value("model") || "loop"));
      return this.docs.find((d) => d.header === `[${name}]` || d.header === `[[${name}]]`);
    }

    keyAt(line) {
      const key = kKey.exec(this.mirror.getLine(line) || ""), section = this.section(line), doc = this.doc(section);
      const known = key && doc && doc.keys.find((k) => k.name === key[1]);
      return { path: key ? `${section.path ? `${section.path}.` : ""}${key[1]}` : "", known, doc };
    }

    // Value and key of the number in the line of the cursor; null: none.
    numberAtCursor() {
      const { line } = this.mirror.getCursor(), text = this.mirror.getLine(line).replace(/#.*/, "");
      const number = /=\s*([-+]?[\d_]*\.?\d+(?:[eE][-+]?\d+)?)\s*$/.exec(text);
      return number ? { key: this.keyAt(line).path, value: Number(number[1].replace(/_/g, "")) } : null;
    }

    showHelp() {
      const { path, known, doc } = this.keyAt(this.mirror.getCursor().line);
      this.help.replaceChildren(...(known ? [el("code", {}, path), ` ${known.type}`, known.doc ? `: ${known.doc}` : ""]
        : [doc ? `${doc.header}: ${doc.doc}. ` : "", "Ctrl-Space lists the keys and values allowed here."]));
    }

    hint(cm) {
      const cursor = cm.getCursor(), before = cm.getLine(cursor.line).slice(0, cursor.ch);
      const word = /["\w.-]*$/.exec(before)[0], key = kKey.exec(before);
      let list = [];
      if (before.includes("#")) return null;
      if (key) {
        const { known } = this.keyAt(cursor.line);
        list = (known ? known.words : []).map((text) => ({ text: `"${text}"`, displayText: text }));
      } else if (/^\s*\[*[\w.]*$/.test(before) && before.includes("[")) {
        const headers = new Set(this.docs.map((d) => d.header.split(" ")[0]));
        return this.offer([...headers].map((text) => ({ text })), before.trim(), cursor);
      } else {
        const doc = this.doc(this.section(cursor.line));
        list = (doc ? doc.keys : []).map((k) => ({ text: `${k.name} = `, displayText: k.name, doc: `${k.type}${k.doc ? `: ${k.doc}` : ""}` }));
      }
      return this.offer(list, word, cursor);
    }

    offer(list, word, cursor) {
      const plain = word.replace(/"/g, "");
      const render = (place, self, { displayText, text, doc }) =>
        place.append(el("b", {}, displayText || text), doc ? el("small", {}, ` ${doc}`) : "");
      return {
        list: list.filter((c) => (c.displayText || c.text).startsWith(plain)).map((c) => ({ ...c, render })),
        from: CodeMirror.Pos(cursor.line, cursor.ch - word.length), to: cursor,
      };
    }
  }

  Sidewall.Editor = Editor;
})();
