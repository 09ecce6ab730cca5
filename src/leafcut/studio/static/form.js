// The options form: groups of labelled fields from plain values; says what was changed, one field at a time.
import { h } from "vue";
import { send } from "/static/send.js";

export default {
  props: {
    groups: Array, // [{key, title, folded, changed, fields: [{name, label, kind, unit, help, choices, default, on, file}]}]
    values: Object, // name → text or true/false
    shown: Object, // name → what a chosen file is called
    errors: Object, // name → line
    words: Object, // {choose, remove, changed, help}
  },
  emits: ["change", "refused"],
  data: () => ({ unfolded: {}, told: null }),
  created() { this.draft = null; }, // not among the data: to type draws nothing
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
    control(field, id) {
      const value = this.values[field.name];
      const error = this.errors[field.name];
      const about = { id, "aria-describedby": `${id}-help`, "aria-invalid": error ? "true" : undefined };
      if (field.kind === "flag") {
        return h("input", {
          ...about,
          type: "checkbox",
          class: "switch",
          checked: value === undefined || value === "" ? field.on : value,
          onChange: (e) => this.change(field, e.target.checked),
        });
      }
      if (field.choices.length && field.kind !== "names" && !field.file) {
        const list = [...field.choices];
        const plain = list.find(([word]) => word === field.default);
        const first = plain ? [] : [h("option", { value: "" }, field.default)];
        // Made anew when the choices change: a browser keeps what was selected by its place, not by its value.
        const key = list.map(([word]) => word).join();
        return h(
          "select",
          { ...about, key, onChange: (e) => this.change(field, e.target.value) },
          [
            ...first,
            ...list.map(([word, text]) =>
              h("option", { value: word, selected: (value || (plain ? field.default : "")) === word }, text),
            ),
          ],
        );
      }
      if (field.file) return this.chooser(field, about, value);
      return h("span", { class: ["box", error && "wrong"] }, [
        h("input", {
          ...about,
          type: "text",
          inputmode: field.unit && field.kind !== "point" ? "decimal" : undefined,
          spellcheck: "false",
          autocomplete: "off",
          // What is being typed stays, also when the form is drawn anew meanwhile.
          value: this.draft?.name === field.name ? this.draft.text : value ?? "",
          placeholder: field.default,
          title: value ? undefined : field.default,
          onInput: (e) => { this.draft = { name: field.name, text: e.target.value }; },
          onBlur: () => { this.draft = null; },
          onChange: (e) => this.change(field, e.target.value.trim()),
        }),
        field.unit && !/[a-z"°µ]/i.test(value ?? "") ? h("span", { class: "unit", "aria-hidden": "true" }, field.unit) : null,
      ]);
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
        : h("span", { class: "picked", title: value ? this.shown[field.name] : field.default }, value ? this.shown[field.name] : field.default);
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
      const id = `o${this.$.uid}-${field.name}`; // two forms of a page may have a field of one name
      const error = this.errors[field.name];
      const given = this.values[field.name];
      return h("div", { class: ["field", field.kind, given !== undefined && given !== "" && "given"], key: field.name }, [
        h("label", { for: id }, field.label),
        this.control(field, id),
        h("p", { class: ["about", this.told === field.name && "told"], id: `${id}-help` }, [
          error ? h("span", { class: "error", role: "alert" }, error) : null,
          h("span", { class: "help" }, `${field.help}. ${field.flag}`),
        ]),
        field.help ? h(
          "button",
          {
            type: "button",
            class: "what",
            "aria-label": `${this.words.help}: ${field.label}`,
            "aria-expanded": this.told === field.name ? "true" : "false",
            title: field.help,
            onClick: () => (this.told = this.told === field.name ? null : field.name),
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
      this.groups.map((group) => {
        const fields = h("div", { class: "fields" }, group.fields.map((f) => this.field(f)));
        if (!group.folded) return h("section", { key: group.key, "aria-label": group.title }, [h("h3", group.title), fields]);
        return h(
          "details",
          { key: group.key, open: this.unfolded[group.key], onToggle: (e) => (this.unfolded[group.key] = e.target.open) },
          [
            h("summary", [group.title, group.changed ? h("span", { class: "count" }, String(group.changed)) : null]),
            fields,
          ],
        );
      }),
    );
  },
};
