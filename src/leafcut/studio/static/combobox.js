// A text field with a menu of suggestions (combobox of the ARIA practices).
import { h } from "vue";

let count = 0;

export const Combobox = {
  props: {
    about: Object, // attributes of the input: id, aria-describedby, …
    value: String, // shown text; a text being typed takes precedence
    offers: Array, // [[value, text]]
    open: String, // label of the button
  },
  emits: ["typed", "change", "left"],
  data: () => ({ shown: false, at: -1, filter: "", typing: null }),
  created() { this.list = `menu-${++count}`; },
  computed: {
    found() {
      const wanted = this.filter.trim().toLowerCase();
      const all = this.offers.map(([value, text]) => ({ value, text }));
      return wanted ? all.filter((one) => `${one.value} ${one.text}`.toLowerCase().includes(wanted)) : all;
    },
  },
  methods: {
    show(filter = "") {
      this.filter = filter;
      this.shown = this.found.length > 0;
      this.at = filter ? -1 : this.found.findIndex((one) => one.value === this.value);
      this.reveal();
    },
    reveal() {
      this.$nextTick(() => {
        const list = this.$refs.list;
        list?.scrollIntoView({ block: "nearest" });
        list?.children[this.at]?.scrollIntoView({ block: "nearest" });
      });
    },
    hide() { this.shown = false; this.at = -1; },
    take(one) {
      this.hide();
      this.typing = one.value;
      this.$emit("typed", one.value);
      this.$emit("change", one.value);
    },
    key(event) {
      if (event.key === "ArrowDown" || event.key === "ArrowUp") {
        event.preventDefault();
        if (!this.shown) return this.show();
        const count = this.found.length, step = event.key === "ArrowDown" ? 1 : -1;
        this.at = this.at < 0 ? (step > 0 ? 0 : count - 1) : (this.at + step + count) % count;
        this.reveal();
      } else if (event.key === "Enter" && this.shown && this.at >= 0) {
        event.preventDefault();
        this.take(this.found[this.at]);
      } else if (event.key === "Escape" && this.shown) {
        event.preventDefault();
        event.stopPropagation();
        this.hide();
      }
    },
  },
  render() {
    const { about, list } = this;
    return h("span", { class: "combobox" }, [
      h("input", {
        ...about,
        ref: "input",
        role: "combobox",
        type: "text",
        value: this.typing ?? this.value, // redrawing the menu keeps the text being typed
        "aria-expanded": this.shown ? "true" : "false",
        "aria-autocomplete": "list",
        "aria-controls": list,
        "aria-activedescendant": this.shown && this.at >= 0 ? `${list}-${this.at}` : undefined,
        onInput: (e) => {
          this.typing = e.target.value;
          this.$emit("typed", this.typing);
          this.show(this.typing);
        },
        onKeydown: this.key,
        onBlur: () => {
          this.hide();
          this.typing = null;
          this.$emit("left");
        },
        onChange: (e) => this.$emit("change", e.target.value.trim()),
      }),
      h(
        "button",
        {
          type: "button",
          class: "opens",
          tabindex: "-1", // opened with the arrow keys in the field
          "aria-label": this.open,
          // Not on click, as the field would lose the focus and regain it in between.
          onPointerdown: (e) => { e.preventDefault(); this.$refs.input.focus(); this.shown ? this.hide() : this.show(); },
        },
        [h("span", { "aria-hidden": "true" }, "▾")],
      ),
      h(
        "ul",
        { ref: "list", id: list, role: "listbox", class: ["menu", this.shown || "hidden"], "aria-label": this.open },
        this.shown
          ? this.found.map((one, k) =>
              h(
                "li",
                {
                  key: one.value,
                  id: `${list}-${k}`,
                  role: "option",
                  "aria-selected": k === this.at ? "true" : "false",
                  onPointerdown: (e) => { e.preventDefault(); this.take(one); },
                },
                one.text,
              ),
            )
          : [],
      ),
    ]);
  },
};
