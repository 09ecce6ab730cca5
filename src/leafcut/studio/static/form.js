// Options form: groups of labelled fields from plain values; reports changes, one field at a time.
import { h } from "vue";
import { Combobox } from "leafcut-canvas/combobox.js";
import { send } from "leafcut-canvas/send.js";

/** Return a text normalized for search: without accents, capitals, hyphens and underscores. */
const plain = (text) => text.normalize("NFD").replace(/\p{M}/gu, "").toLowerCase().replace(/[-_\s]+/g, " ").trim();

export default {
  props: {
    groups: Array, // [{key, title, folded, changed, fields: [{name, label, kind, unit, help, choices, offers, default, rule, on, file}]}]
    values: Object, // name → text or true/false
    shown: Object, // name → displayed name of a chosen file
    errors: Object, // name → line
    words: Object, // {choose, remove, help, open, find, none_found, found}
    fixed: Boolean, // read-only
    searchable: Boolean, // whether there is a search field for options
  },
  emits: ["change", "refused"],
  data: () => ({ unfolded: {}, told: null, wanted: "" }),
  created() { this.draft = null; }, // not reactive: typing must not redraw
  computed: {
    /** Groups filtered by the search text: label, name, flag, help and unit. */
    found() {
      const words = plain(this.wanted).split(" ").filter(Boolean);
      if (!words.length) return this.groups;
      const fits = (field) => {
        const about = plain([field.label, field.name, field.flag, field.help, field.unit].join(" "));
        return words.every((word) => about.includes(word));
      };
      return this.groups.map((group) => ({ ...group, fields: group.fields.filter(fits) })).filter((group) => group.fields.length);
    },
  },
  methods: {
    change(field, value, shown = "") {
      this.$emit("change", { name: field.name, value, shown });
    },
    async file(field, event) {
      const file = event.target.files[0];
      event.target.value = "";
      if (!file) return;
      try {
        const kept = await send(file);
        this.change(field, kept.id, kept.name);
      } catch (problem) {
        this.$emit("refused", { name: field.name, line: problem.message });
      }
    },
    tell(field) {
      this.told = this.told === field.name ? null : field.name;
    },
    finder() {
      const id = `o${this.$.uid}-find`, number = this.found.reduce((sum, group) => sum + group.fields.length, 0);
      return h("div", { class: "find", role: "search" }, [
        h("label", { for: id, class: "unseen", "data-key": "/" }, this.words.find),
        h("span", { class: "box" }, [
          h("input", {
            id,
            type: "search",
            value: this.wanted,
            placeholder: this.words.find,
            spellcheck: "false",
            autocomplete: "off",
            onInput: (e) => (this.wanted = e.target.value),
            onKeydown: (e) => { if (e.key === "Escape" && this.wanted) { e.stopPropagation(); e.preventDefault(); this.wanted = ""; } },
          }),
        ]),
        h("p", { role: "status", class: number ? "unseen" : "quiet small" },
          !this.wanted.trim() ? "" : number ? this.words.found.replace("{number}", number) : this.words.none_found),
      ]);
    },
    control(field, id) {
      const value = this.values[field.name];
      const error = this.errors[field.name];
      const about = {
        id,
        "aria-describedby": `${id}-help`,
        "aria-invalid": error ? "true" : undefined,
        "aria-keyshortcuts": field.help ? "F1" : undefined,
      };
      if (field.kind === "flag") {
        return h("input", {
          ...about,
          type: "checkbox",
          class: "switch",
          disabled: this.fixed,
          checked: value === undefined || value === "" ? field.on : value,
          onChange: (e) => this.change(field, e.target.checked),
        });
      }
      if (field.choices.length && field.kind !== "names" && !field.file) {
        const list = [...field.choices];
        const plain = list.find(([word]) => word === field.default);
        const first = plain ? [] : [h("option", { value: "" }, field.default)];
        // Recreate when the choices change, since browsers keep the selection by index, not by value.
        const key = list.map(([word]) => word).join();
        return h(
          "select",
          { ...about, key, disabled: this.fixed, onChange: (e) => this.change(field, e.target.value) },
          [
            ...first,
            ...list.map(([word, text]) =>
              h("option", { value: word, selected: (value || (plain ? field.default : "")) === word }, text),
            ),
          ],
        );
      }
      if (field.file) return this.chooser(field, about, value);
      if (field.kind === "axes") return this.axes(field, about, value ?? []);
      const typing = {
        ...about,
        readonly: this.fixed,
        inputmode: field.unit && field.kind !== "point" && !field.offers?.length ? "decimal" : undefined,
        spellcheck: "false",
        autocomplete: "off",
        placeholder: field.default,
        title: value ? undefined : field.rule || field.default,
      };
      // Keep the text being typed when the form is redrawn.
      const now = this.draft?.name === field.name ? this.draft.text : value ?? "";
      const type = (text) => { this.draft = { name: field.name, text }; };
      const leave = () => { this.draft = null; };
      return h("span", { class: ["box", error && "wrong"] }, [
        field.offers?.length
          ? h(Combobox, {
              about: typing,
              value: String(now),
              offers: field.offers,
              open: `${this.words.open}: ${field.label}`,
              onTyped: type,
              onLeft: leave,
              onChange: (text) => this.change(field, text),
            })
          : h("input", {
              ...typing,
              type: "text",
              value: now,
              onInput: (e) => type(e.target.value),
              onBlur: leave,
              onChange: (e) => this.change(field, e.target.value.trim()),
            }),
        field.unit && !/[a-z"°µ]/i.test(value ?? "") ? h("span", { class: "unit", "aria-hidden": "true" }, field.unit) : null,
      ]);
    },
    /** One field per axis; a single value applies to all. */
    axes(field, about, values) {
      const change = (k, text) => this.change(field, field.axes.map((_, j) => (j === k ? text.trim() : values[j] ?? "")));
      return h("span", { class: "per-axis", role: "group", "aria-label": field.label },
        field.axes.map((axis, k) => h("span", { class: ["box", this.errors[field.name] && "wrong"] }, [
          h("input", {
            ...about,
            id: k ? `${about.id}-${axis}` : about.id,
            "aria-label": `${field.label} ${axis.toUpperCase()}`,
            type: "text",
            readonly: this.fixed,
            spellcheck: "false",
            autocomplete: "off",
            placeholder: k && values.length === 1 ? values[0] : k ? "" : field.default,
            title: axis.toUpperCase(),
            value: values[k] ?? "",
            onChange: (e) => change(k, e.target.value),
          }),
        ])));
    },
    chooser(field, about, value) {
      const own = field.choices.length
        ? h(
            "select",
            { ...about, onChange: (e) => this.change(field, e.target.value) },
            [
              h("option", { value: "", selected: !value }, field.default),
              ...field.choices.map(([word, text]) => h("option", { value: word, selected: value === word }, text)),
              value && this.shown[field.name] ? h("option", { value, selected: true }, this.shown[field.name]) : null,
            ],
          )
        : h("span", { class: "picked", title: value ? this.shown[field.name] : field.rule || field.default }, value ? this.shown[field.name] : field.default);
      return h("span", { class: "file" }, [
        own,
        h("label", { class: "button small" }, [
          this.words.choose,
          h("input", {
            type: "file",
            class: "unseen",
            "aria-label": `${field.label}: ${this.words.choose}`,
            onChange: (e) => this.file(field, e),
          }),
        ]),
        value
          ? h("button", { type: "button", class: "plain", "aria-label": `${field.label}: ${this.words.remove}`, onClick: () => this.change(field, "") }, "×")
          : null,
      ]);
    },
    field(field) {
      const id = `o${this.$.uid}-${field.name}`; // two forms of a page may have a field with the same name
      const error = this.errors[field.name];
      const given = this.values[field.name];
      const about = {
        class: ["field", field.kind, given !== undefined && given !== "" && "given"],
        key: field.name,
        // The question mark is not a tab stop: F1 in the field shows the help, and screen readers read it anyway.
        onKeydown: (e) => {
          if (e.key !== "F1" || !field.help) return;
          e.preventDefault();
          this.tell(field);
        },
      };
      return h("div", about, [
        h("label", { for: id }, field.label),
        this.control(field, id),
        h("p", { class: ["about", this.told === field.name && "told"], id: `${id}-help` }, [
          error ? h("span", { class: "error", role: "alert" }, error) : null,
          h("span", { class: "help" }, [field.help, field.rule, field.flag].filter(Boolean).join(". ")),
        ]),
        field.usual ? h("p", { class: "usual quiet small" }, field.usual) : null,
        field.help ? h(
          "button",
          {
            type: "button",
            class: "what",
            tabindex: "-1",
            "aria-label": `${this.words.help}: ${field.label}`,
            "aria-expanded": this.told === field.name ? "true" : "false",
            title: [field.help, field.rule].filter(Boolean).join(". "),
            onClick: () => this.tell(field),
          },
          "?",
        ) : null,
      ]);
    },
  },
  render() {
    return h(
      "div",
      { class: "form" },
      [this.searchable ? this.finder() : null, ...this.found.map((group) => {
        const open = !group.folded || (this.wanted.trim() ? true : this.unfolded[group.key]);
        // Folded groups are created when unfolded; they contain most of the options.
        const fields = open ? h("div", { class: "fields" }, group.fields.map((f) => this.field(f))) : null;
        if (!group.folded) return h("section", { key: group.key, "aria-label": group.title }, [h("h3", group.title), fields]);
        return h(
          "details",
          {
            key: group.key,
            open,
            // Groups opened by a search were not unfolded by the user.
            onToggle: (e) => { if (!this.wanted.trim()) this.unfolded[group.key] = e.target.open; },
          },
          [
            h("summary", [group.title, group.changed ? h("span", { class: "count" }, String(group.changed)) : null]),
            fields,
          ],
        );
      })],
    );
  },
};
