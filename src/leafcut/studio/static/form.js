// Options form: groups of labelled fields from plain values; reports changes, one field at a time.
import { Combobox } from "leafcut-canvas/combobox.js";
import { FieldTexts } from "leafcut-canvas/field_texts.js";
import { matchingGroups } from "leafcut-canvas/option_filter.js";
import { send } from "leafcut-canvas/send.js";
import { computed, defineComponent, getCurrentInstance, h, ref } from "vue";

/** @import { Field, Group } from "./option_filter.js" */
/** @typedef {Record<string, unknown>} Attributes */

export default defineComponent({
  props: {
    groups: { type: /** @type {Prop<Group[]>} */ (Array), default: () => [] },
    values: { type: /** @type {Prop<Record<string, any>>} */ (Object), default: () => ({}) }, // name → text, texts of axes, or true/false
    shown: { type: /** @type {Prop<Record<string, string>>} */ (Object), default: () => ({}) }, // name → displayed name of a chosen file
    errors: { type: /** @type {Prop<Record<string, string>>} */ (Object), default: () => ({}) }, // name → line
    answered: { type: Number, default: 0 }, // number of the last change that the server has answered
    words: { type: /** @type {Prop<Words>} */ (Object), required: true }, // choose, remove, help, open, find, none_found, found
    fixed: Boolean, // read-only
    searchable: Boolean, // whether there is a search field for options
    live: Boolean, // reports a text while it is typed, not only when the field loses the focus
    prefix: String, // of the ids of the fields; by default a unique one
  },
  emits: ["change", "refused"],
  setup(props, { emit, expose }) {
    const prefix = props.prefix ?? `o${getCurrentInstance()?.uid}`; // two forms of a page may have a field with the same name
    const unfolded = ref(/** @type {Record<string, boolean>} */ ({})), wanted = ref("");
    const explained = ref(/** @type {string | null} */ (null)); // name of the field whose help is shown
    const found = computed(() => matchingGroups(props.groups, wanted.value));
    const texts = new FieldTexts(props.answered); // not reactive: typing must not redraw

    /** @param {Field} field @param {unknown} value */
    function change({ name }, value, shown = "") { emit("change", { name, value, shown, number: texts.send(name, value) }); }

    /** Return the value of a field as it is shown. @param {Field} field */
    function valueOf({ name }) { return texts.content(name, props.values[name], props.answered); }

    /** @param {Field} field @param {HTMLInputElement} input */
    async function upload(field, input) {
      const [file] = input.files ?? [];
      input.value = "";
      if (!file) return;
      await send(file).then((kept) => change(field, kept.id, kept.name), (problem) => emit("refused", { name: field.name, line: problem.message, parts: problem.parts }));
    }

    expose({
      /** Move the focus to a field. @param {string} name */
      focusField: (name) => document.getElementById(`${prefix}-${name}`)?.focus(),
    });

    /** @param {Field} field */
    function explain({ name }) { explained.value = explained.value === name ? null : name; }

    function finder() {
      const id = `${prefix}-find`, number = found.value.reduce((sum, group) => sum + group.fields.length, 0), { words } = props;
      return h("div", { class: "find", role: "search" }, [
        h("label", { for: id, class: "unseen", "data-key": "/" }, words.find),
        h("span", { class: "box" }, [
          h("input", {
            id,
            type: "search",
            value: wanted.value,
            placeholder: words.find,
            spellcheck: "false",
            autocomplete: "off",
            onInput: (/** @type {FieldEvent} */ { target }) => { wanted.value = target.value; },
            onKeydown: (/** @type {KeyboardEvent} */ event) => {
              if (event.key !== "Escape" || !wanted.value) return;
              event.stopPropagation();
              event.preventDefault();
              wanted.value = "";
            },
          }),
        ]),
        h("p", { role: "status", class: number ? "unseen" : "quiet small" },
          !wanted.value.trim() ? "" : number ? words.found.replace("{number}", String(number)) : words.none_found),
      ]);
    }

    /** @param {Field} field @param {string} id */
    function control(field, id) {
      const value = valueOf(field), about = {
        id,
        "aria-describedby": `${id}-help`,
        "aria-invalid": props.errors[field.name] ? "true" : undefined,
        "aria-keyshortcuts": field.help ? "F1" : undefined,
      };
      if (field.kind === "flag") {
        return h("input", {
          ...about,
          type: "checkbox",
          class: "switch",
          disabled: props.fixed,
          checked: value === undefined || value === "" ? field.on : value,
          onChange: (/** @type {FieldEvent} */ { target }) => change(field, target.checked),
        });
      }
      if (field.file) return chooser(field, about, props.values[field.name]); // with its name, which the server knows
      if (field.choices.length && field.kind !== "names") return selection(field, about, value);
      if (field.kind === "axes") return axes(field, about, value ?? []);
      return textField(field, about, value);
    }

    /** @param {Field} field @param {Attributes} about @param {string | undefined} value */
    function selection(field, about, value) {
      const known = field.choices.some(([word]) => word === field.default), chosen = value || (known ? field.default : "");
      // Recreate when the choices change, since browsers keep the selection by index, not by value.
      const key = field.choices.map(([word]) => word).join();
      return h("select", { ...about, key, disabled: props.fixed, onChange: (/** @type {FieldEvent} */ { target }) => change(field, target.value) }, [
        known ? null : h("option", { value: "" }, field.default),
        ...field.choices.map(([word, text]) => h("option", { value: word, selected: chosen === word }, text)),
      ]);
    }

    /** @param {Field} field @param {Attributes} about @param {any} value */
    function textField(field, about, value) {
      const typing = {
        ...about,
        readonly: props.fixed,
        inputmode: field.kind === "whole" ? "numeric" : field.unit && field.kind !== "point" && !field.offers?.length ? "decimal" : undefined,
        spellcheck: "false",
        autocomplete: "off",
        placeholder: field.default,
        title: value ? undefined : field.rule || field.default,
      };
      const text = value ?? "";
      const type = (/** @type {string} */ typed) => {
        texts.type(field.name, typed);
        if (props.live) change(field, typed);
      };
      const leave = () => texts.leave();
      return h("span", { class: ["box", props.errors[field.name] && "wrong"] }, [
        field.offers?.length
          ? h(Combobox, {
              about: typing,
              value: String(text),
              offers: field.offers,
              open: `${props.words.open}: ${field.label}`,
              onTyped: type,
              onLeft: leave,
              onChange: (/** @type {string} */ typed) => change(field, typed),
            })
          : h("input", {
              ...typing,
              type: "text",
              value: text,
              onInput: (/** @type {FieldEvent} */ { target }) => type(target.value),
              onBlur: leave,
              onChange: (/** @type {FieldEvent} */ { target }) => change(field, target.value.trim()),
            }),
        field.unit && !/[a-z"°µ]/i.test(value ?? "") ? h("span", { class: "unit", "aria-hidden": "true" }, field.unit) : null,
      ]);
    }

    /** One field per axis; a single value applies to all.
     * @param {Field} field @param {Attributes} about @param {string[]} values */
    function axes(field, about, values) {
      const names = field.axes ?? [];
      return h("span", { class: "per-axis", role: "group", "aria-label": field.label },
        names.map((axis, k) => h("span", { class: ["box", props.errors[field.name] && "wrong"] }, [
          h("input", {
            ...about,
            id: k ? `${about.id}-${axis}` : about.id,
            "aria-label": `${field.label} ${axis.toUpperCase()}`,
            type: "text",
            readonly: props.fixed,
            spellcheck: "false",
            autocomplete: "off",
            placeholder: k && values.length === 1 ? values[0] : k ? "" : field.default,
            title: axis.toUpperCase(),
            value: values[k] ?? "",
            onChange: (/** @type {FieldEvent} */ { target }) => {
              const now = valueOf(field) ?? []; // with changes that the server has not answered yet
              change(field, names.map((_, j) => (j === k ? target.value.trim() : now[j] ?? "")));
            },
          }),
        ])));
    }

    /** @param {Field} field @param {Attributes} about @param {string | undefined} value */
    function chooser(field, about, value) {
      const name = value ? props.shown[field.name] : "", { words } = props;
      return h("span", { class: "file" }, [
        field.choices.length
          ? h("select", { ...about, onChange: (/** @type {FieldEvent} */ { target }) => change(field, target.value) }, [
              h("option", { value: "", selected: !value }, field.default),
              ...field.choices.map(([word, text]) => h("option", { value: word, selected: value === word }, text)),
              name ? h("option", { value, selected: true }, name) : null,
            ])
          : h("span", { class: "picked", title: value ? name : field.rule || field.default }, value ? name : field.default),
        h("label", { class: "button small" }, [
          words.choose,
          h("input", {
            type: "file",
            class: "unseen",
            "aria-label": `${field.label}: ${words.choose}`,
            onChange: (/** @type {FieldEvent} */ { target }) => upload(field, target),
          }),
        ]),
        value
          ? h("button", { type: "button", class: "plain", "aria-label": `${field.label}: ${words.remove}`, onClick: () => change(field, "") }, "×")
          : null,
      ]);
    }

    /** @param {Field} field */
    function row(field) {
      const id = `${prefix}-${field.name}`, error = props.errors[field.name], value = valueOf(field);
      const open = explained.value === field.name;
      return h("div", {
        class: ["field", field.kind, value !== undefined && value !== "" && "given"],
        key: field.name,
        // The question mark is not a tab stop: F1 in the field shows the help, and screen readers read it anyway.
        onKeydown: (/** @type {KeyboardEvent} */ event) => {
          if (event.key !== "F1" || !field.help) return;
          event.preventDefault();
          explain(field);
        },
      }, [
        h("label", { for: id }, field.label),
        control(field, id),
        h("p", { class: ["about", open && "told"], id: `${id}-help` }, [
          error ? h("span", { class: "error", role: "alert" }, error) : null,
          h("span", { class: "help" }, [field.help, field.rule, field.flag].filter(Boolean).join(". ")),
        ]),
        field.usual ? h("p", { class: "usual quiet small" }, field.usual) : null,
        field.help
          ? h("button", {
              type: "button",
              class: "what",
              tabindex: "-1",
              "aria-label": `${props.words.help}: ${field.label}`,
              "aria-expanded": open ? "true" : "false",
              title: [field.help, field.rule].filter(Boolean).join(". "),
              onClick: () => explain(field),
            }, "?")
          : null,
      ]);
    }

    /** @param {Group} group */
    function section(group) {
      const { key, title, folded, changed } = group, searched = Boolean(wanted.value.trim());
      const open = !folded || searched || unfolded.value[key];
      // Folded groups are created when unfolded; they contain most of the options.
      const fields = open ? h("div", { class: "fields" }, group.fields.map(row)) : null;
      if (!folded) return h("section", { key, "aria-label": title, "data-group": key }, [h("h3", title), fields]);
      return h("details", {
        key,
        open,
        // Groups opened by a search were not unfolded by the user.
        onToggle: (/** @type {Event & { target: HTMLDetailsElement }} */ { target }) => { if (!wanted.value.trim()) unfolded.value[key] = target.open; },
      }, [
        h("summary", [title, changed ? h("span", { class: "count" }, String(changed)) : null]),
        fields,
      ]);
    }

    return () => h("div", { class: "form" }, [props.searchable ? finder() : null, ...found.value.map(section)]);
  },
});
