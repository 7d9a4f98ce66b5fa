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
let isRunning = false;

/**
 * Do something with the next beat; asked again before that, only the newest is done. What is asked for during a beat is
 * done in the same one, unless it was done in it already: so what belongs together is drawn in one picture.
 * @param {object} key whose it is
 * @param {function(number): void} act gets the time of the picture, as `performance.now()`
 */
export function onBeat(key, act) {
  waiting.set(key, act);
  if (!isAsked && !isRunning) ask();
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
  isRunning = true;
  const done = new Set();
  for (const [key, act] of waiting) { // a map goes on with what is added meanwhile
    if (done.has(key)) continue;
    done.add(key);
    waiting.delete(key);
    try {
      act(last);
    } catch (error) {
      console.error(error); // a fault in one part must not stop the others
    }
  }
  isRunning = false;
  if (waiting.size > 0) ask();
}
