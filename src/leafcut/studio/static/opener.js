// Opens files: by a dialog, or by dropping them anywhere on the page.
import { h } from "vue";
import { send } from "leafcut-canvas/send.js";

export default {
  props: { words: Object, largest: Number, several: Boolean }, // several: all files of one drop, else the first
  emits: ["opened", "refused"],
  data: () => ({ over: 0, busy: false }),
  mounted() {
    this.on = {
      dragenter: (e) => this.drag(e, 1),
      dragleave: (e) => this.drag(e, -1),
      dragover: (e) => this.holds(e) && e.preventDefault(),
      drop: (e) => {
        if (!this.holds(e)) return;
        e.preventDefault();
        this.over = 0;
        this.take([...e.dataTransfer.files]);
      },
    };
    for (const [name, act] of Object.entries(this.on)) window.addEventListener(name, act);
  },
  unmounted() {
    for (const [name, act] of Object.entries(this.on)) window.removeEventListener(name, act);
  },
  methods: {
    holds: (e) => [...(e.dataTransfer?.types ?? [])].includes("Files"),
    drag(e, by) {
      if (this.holds(e)) this.over = Math.max(0, this.over + by);
    },
    async take(files) {
      if (!files.length || this.busy) return;
      this.busy = true;
      try {
        for (const file of this.several ? files : files.slice(0, 1)) await this.send(file);
      } finally {
        this.busy = false;
      }
    },
    async send(file) {
      if (file.size > this.largest) {
        this.$emit("refused", { line: `${file.name}: ${this.words.large}` });
        return;
      }
      try {
        this.$emit("opened", await send(file));
      } catch (problem) {
        this.$emit("refused", { line: problem.message });
      }
    },
  },
  render() {
    return h("div", { class: "opener" }, [
      h("label", { class: ["button", "wide", this.busy && "busy"], "data-key": "o" }, [
        this.busy ? this.words.busy : this.several ? this.words.add : this.words.open,
        h("input", {
          type: "file",
          class: "unseen",
          id: "open-file",
          multiple: this.several,
          onChange: (e) => {
            this.take([...e.target.files]);
            e.target.value = "";
          },
        }),
      ]),
      h("p", { class: "quiet small" }, this.words.drop),
      this.over ? h("div", { class: "dropping" }, h("div", this.words.release)) : null,
    ]);
  },
};
