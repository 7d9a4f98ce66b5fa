/**
 * One beat for all that changes many times a second. Each change costs the browser a whole new picture of the page,
 * so changes wait for each other; where the processor has to draw those pictures, they wait longer.
 */

const LATEST_MS = 300; // a browser that has no time for pictures still gets its numbers

const waiting = new Map();
let period_ms = 1000 / 30;
let last = 0;
let frame = 0;
let early = 0;
let timer = 0;
let isAsked = false;

/**
 * Do something with the next beat; asked again before that, only the newest is done.
 * @param {object} key whose it is
 * @param {function(number): void} act gets the time of the picture, as `performance.now()`
 */
export function onBeat(key, act) {
  waiting.set(key, act);
  if (!isAsked) ask();
}

/** How often there may be a new picture. @param {number} wanted_ms from one to the next */
export function setPeriod(wanted_ms) {
  period_ms = wanted_ms;
}

function ask() {
  isAsked = true;
  const wait_ms = period_ms - (performance.now() - last);
  const draw = () => { frame = requestAnimationFrame(run); };
  frame = 0;
  early = 0;
  if (wait_ms > 18) early = setTimeout(draw, wait_ms - 12);
  else draw();
  timer = setTimeout(run, Math.max(0, wait_ms) + LATEST_MS);
}

function run() {
  clearTimeout(timer);
  clearTimeout(early);
  cancelAnimationFrame(frame);
  isAsked = false;
  last = performance.now();
  const now = [...waiting.values()];
  waiting.clear();
  for (const act of now) {
    try {
      act(last);
    } catch (error) {
      console.error(error); // a fault in one part must not stop the others
    }
  }
}
