// Values of fields that the server has not answered yet: the text being typed, and the changes on their way.

export class FieldTexts {
  /** @param {number} answered number of the last change that the server has answered */
  constructor(answered) {
    this.sent = answered;
    /** Changes on their way. @type {Map<string, { value: any, number: number }>} */
    this.changes = new Map();
    /** Text being typed. @type {{ name: string, text: string } | null} */
    this.draft = null;
  }

  /** Return what a field contains: what is typed, what was sent last, or the value that the server knows.
   * @param {string} name @param {any} known @param {number} answered */
  content(name, known, answered) {
    if (this.draft?.name === name) return this.draft.text;
    const change = this.changes.get(name);
    if (change && change.number > answered) return change.value;
    this.changes.delete(name);
    return known;
  }

  /** @param {string} name @param {string} text */
  type(name, text) { this.draft = { name, text }; }

  leave() { this.draft = null; }

  /** Record a change; return its number, which the server returns with its answer.
   * @param {string} name @param {any} value */
  send(name, value) {
    this.changes.set(name, { value, number: ++this.sent });
    return this.sent;
  }
}
