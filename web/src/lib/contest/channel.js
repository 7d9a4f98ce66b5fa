/** How the contest's pages exchange data with the monitor: requests, judges' changes, and a WebSocket that reports changes. */
import { ReconnectingSocket } from "../reconnecting_socket.js";
import { request } from "../request.js";

/** @import {Contest} from "../messages.js" */

/** Tries that are being flown, as the WebSocket sent them last, and how many times it did. */
const latest = { running: /** @type {Contest.RunningView[]} */ ([]), messages: 0 };

/**
 * Request something. The tries of an answer are replaced by those that the WebSocket sent while it was under way.
 * @param {string} path below /api/competition/
 * @returns {Promise<any>} what the path gives; throws an Error with one line for people
 */
export async function ask(path) {
  const before = latest.messages;
  const given = await request(`/api/competition/${path}`);
  if (latest.messages !== before && given.running !== undefined) given.running = latest.running;
  return given;
}

/**
 * Have something done; only judges may.
 * @param {string} path below /api/competition/
 * @param {object} form
 * @returns {Promise<any>} throws an Error with one line for people; its `status` is that of HTTP
 */
export function send(path, form) {
  return request(`/api/competition/${path}`, form);
}

/**
 * Hear of changes, for as long as the page lives; a lost connection is opened again.
 * @param {{changed: (message: Contest.ChangedMessage) => void, running: (tries: Contest.RunningView[]) => void, link: (isOpen: boolean) => void}} hear
 *   changed: something is other than before, also after each new connection; link: whether there is a connection
 */
export function watch(hear) {
  /** @type {ReconnectingSocket<never, Contest.ToPage>} */
  const socket = new ReconnectingSocket("/ws/competition", {
    message: (message) => {
      if (message.kind === "changed") hear.changed(message);
      else if (message.kind === "running") {
        latest.running = message.tries;
        latest.messages += 1;
        hear.running(message.tries);
      }
    },
    state: (state) => hear.link(state === "open"),
  });
  return socket;
}

/**
 * Makes one call at a time of a function that asks, and one more if it was wanted meanwhile.
 * @param {function(): Promise<void>} work
 * @param {function(Error): void} fail
 * @returns {function(): Promise<void>} done when what was wanted by then was asked for
 */
export function oneAtATime(work, fail) {
  /** @type {Promise<void>|null} */
  let going = null;
  let again = false;
  const run = async () => {
    while (again) {
      again = false;
      try {
        await work();
      } catch (error) {
        fail(error instanceof Error ? error : new Error(String(error)));
      }
    }
    going = null;
  };
  return () => {
    again = true;
    going ??= run();
    return going;
  };
}
