// Uploads files to the studio. During uploads, window.leafcutSending is a promise. When the studio has reported all
// files, it becomes true, or false if a file was refused.

/** A refusal of the studio: its English text, and template and values of the message for a translation. */
export class Refusal extends Error {
  /** @param {string} text @param {object | null} parts */
  constructor(text, parts) {
    super(text);
    this.parts = parts;
  }
}

/** Upload a file; return {id, name, size}, or throw a Refusal.
 * @param {File} file @returns {Promise<{ id: string, name: string, size: number }>} */
export function send(file) {
  const sent = transfer(file);
  /** @type {Promise<boolean>} */
  const told = sent.then(() => true, () => false).then((came) => new Promise((done) => { setTimeout(done, 0, came); }));
  const all = Promise.all([window.leafcutSending ?? true, told]).then((came) => came.every(Boolean));
  window.leafcutSending = all;
  all.then(() => { if (window.leafcutSending === all) window.leafcutSending = null; });
  return sent;
}

/** @param {File} file */
async function transfer(file) {
  let answer;
  try {
    answer = await fetch(`/api/files?name=${encodeURIComponent(file.name)}`, {
      method: "POST",
      body: file,
      headers: { "content-type": "application/octet-stream" },
    });
  } catch {
    const meta = /** @type {HTMLMetaElement | null} */ (document.querySelector("meta[name=leafcut-lost]"));
    throw new Error(`${file.name}: ${meta?.content.split("|")[0]}`);
  }
  const text = await answer.text();
  if (answer.ok) return JSON.parse(text);
  let refusal = { error: text, message: null };
  try {
    refusal = JSON.parse(text);
  } catch {
    // the access check of the server answers in plain text
  }
  throw new Refusal(refusal.error, refusal.message ?? null);
}
