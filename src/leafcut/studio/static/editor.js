// A text editor with line numbers, which marks a line with an error; shipped texts are read-only.
import { h } from "vue";

const PAUSE = 400; // ms without input before the text is checked

export default {
  props: { text: String, own: Boolean, label: String, line: Number, problem: String },
  emits: ["draft"],
  data() { return { now: this.text, down: 0 }; },
  watch: {
    /** The form changed the text; an edit in progress takes precedence. */
    text(made) { if (document.activeElement !== this.$refs.area) this.now = made; },
  },
  unmounted() { this.tell(); },
  methods: {
    type(event) {
      this.now = event.target.value;
      clearTimeout(this.waits);
      this.waits = setTimeout(this.tell, PAUSE);
    },
    tell() {
      clearTimeout(this.waits);
      this.waits = undefined;
      if (this.own && this.now !== this.told) this.$emit("draft", { text: (this.told = this.now) });
    },
    /** Select the marked line and scroll to it. */
    go() {
      const { area } = this.$refs, lines = this.now.split("\n"), from = lines.slice(0, this.line - 1).join("\n").length + (this.line > 1);
      area.focus();
      area.setSelectionRange(from, from + lines[this.line - 1].length);
      area.scrollTop = (this.line - 4) * parseFloat(getComputedStyle(area).lineHeight);
    },
  },
  created() { this.told = this.text; },
  render() {
    const lines = this.now.split("\n").length, about = `editor-${this.$.uid}`;
    return h("div", { class: "editor" }, [
      h("div", { class: "numbers", "aria-hidden": "true" }, [
        h("div", { style: { transform: `translateY(${-this.down}px)` } },
          Array.from({ length: lines }, (_, k) => h("span", { key: k, class: k + 1 === this.line && "wrong" }, String(k + 1)))),
      ]),
      h("textarea", {
        ref: "area",
        value: this.now,
        readonly: !this.own,
        rows: Math.min(lines + 1, 40),
        spellcheck: "false",
        wrap: "off",
        "aria-label": this.label,
        "aria-invalid": this.problem ? "true" : undefined,
        "aria-describedby": this.problem ? about : undefined,
        onInput: this.type,
        onChange: this.tell,
        onScroll: (e) => (this.down = e.target.scrollTop),
      }),
      this.problem ? h("p", { id: about, class: "unseen" }, this.problem) : null,
    ]);
  },
};
