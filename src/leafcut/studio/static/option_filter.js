// Search among options and among the suggestions of a field.

/** Value and text of a suggestion. @typedef {[string, string]} Offer */
/**
 * A field of a form. `rule`: allowed values in words; `on`: default of a flag; `usual`: note on the usual value.
 * @typedef {{
 *   name: string, label: string, kind: string, default: string, choices: Offer[], flag?: string, help?: string,
 *   unit?: string, offers?: Offer[], rule?: string, on?: boolean, file?: boolean, axes?: string[], usual?: string,
 * }} Field
 * @typedef {{ key: string, title: string, folded: boolean, changed: number, fields: Field[] }} Group
 */

/** Return a text normalized for search: without accents, capitals, hyphens and underscores.
 * @param {string} text */
function plain(text) { return text.normalize("NFD").replace(/\p{M}/gu, "").toLowerCase().replace(/[-_\s]+/g, " ").trim(); }

/** Return the groups with the fields whose label, name, flag, help and unit contain all words of a text.
 * @param {Group[]} groups @param {string} wanted @returns {Group[]} */
export function matchingGroups(groups, wanted) {
  const words = plain(wanted).split(" ").filter(Boolean);
  if (!words.length) return groups;
  const fits = (/** @type {Field} */ { label, name, flag, help, unit }) => {
    const about = plain([label, name, flag, help, unit].join(" "));
    return words.every((word) => about.includes(word));
  };
  return groups.map((group) => ({ ...group, fields: group.fields.filter(fits) })).filter((group) => group.fields.length);
}

/** Return the offers whose value or text contains a text; ignores case.
 * @param {Offer[]} offers @param {string} filter */
export function matchingOffers(offers, filter) {
  const wanted = filter.trim().toLowerCase();
  return offers.filter((offer) => offer.join(" ").toLowerCase().includes(wanted));
}
