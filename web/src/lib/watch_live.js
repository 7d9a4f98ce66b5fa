/** The live channel with a line at the top of the page that says when it was lost and when it is back. */
import { LiveChannel } from "./live_channel.js";
import { setText } from "./dom.js";

/** @import {Live} from "./messages.js" */

const SILENCE_MS = 4000; // poses come 20 times a second; a link that fell silent is gone even if nobody closed it
const SHOWN_MS = 6000;

/**
 * Connect, and after each loss connect again.
 * @param {{[K in Live.ToPage["kind"]]?: (message: Extract<Live.ToPage, {kind: K}>) => void}} hear what to do with a message of each kind
 * @param {HTMLElement} line where it says what happened; hidden while there is nothing to say
 * @param {function(boolean): void} [onChange] told true when connected and false when not
 */
export function watchLive(hear, line, onChange = () => {}) {
  const channel = new LiveChannel();
  let [lostAt, lastPose, hiding] = /** @type {[number|null, number|null, number]} */ ([null, null, 0]);

  /** @param {string} text @param {string} look */
  const say = (text, look) => {
    clearTimeout(hiding);
    line.hidden = false;
    line.dataset.look = look;
    setText(line, text);
  };
  const lost = () => {
    lastPose = null;
    if (lostAt !== null) return;
    lostAt = performance.now();
    say("connection to the monitor lost, trying again", "bad");
    onChange(false);
  };
  const back = () => {
    if (lostAt !== null) {
      const away_s = (performance.now() - lostAt) / 1000;
      say(`back after ${away_s.toFixed(away_s < 10 ? 1 : 0)} s`, "good");
      hiding = setTimeout(() => { line.hidden = true; }, SHOWN_MS);
    }
    lostAt = null;
    onChange(true);
  };

  for (const [kind, take] of Object.entries(hear)) channel.on(/** @type {Live.ToPage["kind"]} */ (kind), /** @type {(message: any) => void} */ (take));
  channel.on("pose", ({ drones }) => { lastPose = drones.length > 0 ? performance.now() : null; });
  channel.onState((state) => (state === "open" ? back() : lost()));
  document.addEventListener("visibilitychange", () => {
    lastPose = null; // a hidden page hears little; that is no silence
    if (!document.hidden) channel.open();
  });
  setInterval(() => {
    if (document.hidden || lastPose === null || performance.now() - lastPose < SILENCE_MS) return;
    lost();
    channel.reopen();
  }, 1000);
  return channel;
}
