// Opens files: by a dialog, or by dropping them anywhere on the page.
import { send } from "leafcut-canvas/send.js";
import { defineComponent, h, onMounted, onUnmounted, ref } from "vue";

export default defineComponent({
  props: {
    words: { type: /** @type {Prop<Words>} */ (Object), required: true },
    largest: { type: Number, default: Infinity }, // bytes
    several: Boolean, // all files of one drop, else the first
  },
  emits: ["opened", "refused"],
  setup(props, { emit }) {
    const over = ref(0), busy = ref(false);
    const holds = (/** @type {DragEvent} */ event) => Boolean(event.dataTransfer?.types.includes("Files"));
    const count = (/** @type {DragEvent} */ event, /** @type {number} */ by) => {
      if (holds(event)) over.value = Math.max(0, over.value + by);
    };
    const listeners = {
      dragenter: (/** @type {DragEvent} */ event) => count(event, 1),
      dragleave: (/** @type {DragEvent} */ event) => count(event, -1),
      dragover: (/** @type {DragEvent} */ event) => { if (holds(event)) event.preventDefault(); },
      drop: (/** @type {DragEvent} */ event) => {
        if (!holds(event)) return;
        event.preventDefault();
        over.value = 0;
        take([...(event.dataTransfer?.files ?? [])]);
      },
    };
    const names = /** @type {(keyof typeof listeners)[]} */ (Object.keys(listeners));
    onMounted(() => names.forEach((name) => window.addEventListener(name, listeners[name])));
    onUnmounted(() => names.forEach((name) => window.removeEventListener(name, listeners[name])));

    /** @type {File[]} */
    let waiting = []; // files to open, in order

    /** @param {File[]} files */
    async function take(files) {
      if (!files.length) return;
      // Of several files for one place, the newest is opened after the file that is being sent.
      waiting = props.several ? [...waiting, ...files] : files.slice(0, 1);
      if (busy.value) return;
      busy.value = true;
      for (let file = waiting.shift(); file; file = waiting.shift()) await upload(file);
      busy.value = false;
    }

    /** @param {File} file */
    async function upload(file) {
      if (file.size > props.largest) {
        emit("refused", { line: `${file.name}: ${props.words.large}` });
        return;
      }
      await send(file).then((kept) => emit("opened", kept), (problem) => emit("refused", { line: problem.message, parts: problem.parts }));
    }

    return () => {
      const { words, several } = props;
      return h("div", { class: "opener" }, [
        h("label", { class: ["button", "wide", busy.value && "busy"], "data-key": "o" }, [
          busy.value ? words.busy : several ? words.add : words.open,
          h("input", {
            type: "file",
            class: "unseen",
            id: "open-file",
            multiple: several,
            onChange: (/** @type {FieldEvent} */ { target }) => {
              take([...(target.files ?? [])]);
              target.value = "";
            },
          }),
        ]),
        h("p", { class: "quiet small" }, words.drop),
        over.value ? h("div", { class: "dropping" }, h("div", words.release)) : null,
      ]);
    };
  },
});
