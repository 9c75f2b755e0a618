import type { FromPage, FromServer } from "./protocol";
import { Signal } from "./signal";
import { readFrame } from "./topics";

export type Link = "connecting" | "live" | "lost" | "full";

export const FIRST_WAIT = 250;
export const LONGEST_WAIT = 2000;
/** A server that runs sends something within this many seconds, even if nothing changes. */
const LONGEST_SILENCE = 5;
/** The WebSocket close code "try again later", which the server sends when too many pages are open. */
const FULL = 1013;
/** The WebSocket close code "going away", which the server sends when it ends. */
const ENDED = 1001;

/** The largest message in bytes that the server accepts. It closes the connection after a larger one. */
export const LARGEST = 7 * 1024 * 1024;

/** The delay in ms before the next attempt to connect, after an attempt with the delay `wait`. */
export function nextWait(wait: number): number {
  return Math.min(wait * 1.6, LONGEST_WAIT);
}

/** The connection of a page to its server. */
export interface Channel {
  readonly link: Signal<Link>;
  /** Whether the link is lost because KBot has ended. */
  readonly hasEnded: boolean;
  /** Whether the server can write files. */
  readonly writes: boolean;
  send(message: FromPage): void;
}

/** The WebSocket to the server. It reconnects automatically. */
export class Connection implements Channel {
  readonly link = new Signal<Link>("connecting");
  readonly writes = true;
  hasEnded = false;
  private socket: WebSocket | null = null;
  private wait = FIRST_WAIT;
  private silence = 0;

  constructor(private readonly receive: (message: FromServer) => void) {
    queueMicrotask(() => {
      this.readGreeting();
      this.connect();
    });
    setInterval(() => this.countSilence(), 1000);
  }

  /** Counts a second without a message. Counting, unlike a timestamp, is right after the page was busy or asleep: the
   * messages that are waiting arrive before the next count. */
  private countSilence(): void {
    this.silence += 1;
    if (this.link.value === "live" && this.silence > LONGEST_SILENCE) this.link.set("lost");
  }

  /** Reads the first messages from the page itself, so that drawing need not wait for the socket. */
  private readGreeting(): void {
    const greeting = document.getElementById("greeting")?.textContent;
    for (const message of JSON.parse(greeting || "[]") as FromServer[]) this.receive(message);
  }

  /** Sends a message, or refuses one that is too large. While disconnected, messages are dropped because they would be
   * stale later. */
  send(message: FromPage): void {
    if (this.socket?.readyState !== WebSocket.OPEN) return;
    const text = JSON.stringify(message);
    // a UTF-16 unit has at most three bytes of UTF-8, so that short texts need not be encoded
    if (text.length > LARGEST / 3 && new TextEncoder().encode(text).length > LARGEST)
      this.receive({
        type: "refused",
        reason: "The text is too large for the page. Change it in another editor.",
      });
    else this.socket.send(text);
  }

  private connect(): void {
    const token = new URLSearchParams(location.search).get("token");
    const query = token === null ? "" : `?token=${encodeURIComponent(token)}`;
    const socket = new WebSocket(
      `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/ws${query}`,
    );
    this.socket = socket;
    socket.binaryType = "arraybuffer";
    socket.addEventListener("message", (event: MessageEvent<string | ArrayBuffer>) => {
      this.wait = FIRST_WAIT;
      this.silence = 0;
      this.hasEnded = false;
      this.link.set("live");
      const message =
        typeof event.data === "string" ? (JSON.parse(event.data) as FromServer) : readFrame(event.data);
      if (message.type === "beat") this.send({ type: "heard" });
      else this.receive(message);
    });
    socket.addEventListener("close", (event) => {
      this.hasEnded ||= event.code === ENDED;
      this.link.set(event.code === FULL ? "full" : "lost");
      setTimeout(() => this.connect(), this.wait);
      this.wait = nextWait(this.wait);
    });
  }
}
