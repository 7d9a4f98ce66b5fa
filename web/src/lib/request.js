/** Requests to the monitor, which are answered with JSON or refused in a line. */

const MOST_LETTERS = 400; // of a reason

/**
 * @param {string} address
 * @param {object} [content] to be sent; without it something is only asked for
 * @returns {Promise<any>} throws an Error with one line for people; its `status` is that of HTTP, 0 without an answer
 */
export async function request(address, content) {
  const sent = content && { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(content) };
  const answer = await fetch(address, sent).catch(() => null);
  if (answer?.ok) return answer.json();
  const words = answer ? reasonIn(await answer.text()) || `the monitor answers ${answer.status}` : "the monitor does not answer";
  throw Object.assign(new Error(words), { status: answer?.status ?? 0 });
}

/** Why something failed, in one line. @param {unknown} error */
export const reasonOf = (error) => (error instanceof Error ? error.message : String(error));

/** @param {string} text of a refusal @returns {string} "" if it has no reason for people */
function reasonIn(text) {
  try {
    const { detail } = JSON.parse(text);
    return typeof detail === "string" ? detail : "";
  } catch {
    return text.trim().slice(0, MOST_LETTERS);
  }
}
