import type { FromPage, FromServer } from "./protocol";
import { Signal } from "./signal";
import { readFrame } from "./topics";

export type Link = "connecting" | "live" | "lost" | "full";

export const FIRST_WAIT = 250;
export const LONGEST_WAIT = 2000;
/** Seconds in which a server that answers says something, even where nothing changes. */
const LONGEST_SILENCE = 5;
/** The code a server closes with that has as many pages as it serves ("try again later"). */
const FULL = 1013;

/** Milliseconds until the attempt to connect after the one that waited so long. */
export function nextWait(wait: number): number {
  return Math.min(wait * 1.6, LONGEST_WAIT);
}

/** What a page talks through. */
export interface Line {
  readonly link: Signal<Link>;
  /** Whether there is somebody who writes files. */
  readonly writes: boolean;
  send(message: FromPage): void;
}

/** The socket to the server; connects again by itself when it is lost. */
export class Connection implements Line {
  readonly link = new Signal<Link>("connecting");
  readonly writes = true;
  private socket: WebSocket | null = null;
  private wait = FIRST_WAIT;
  private silence = 0;

  constructor(private readonly hear: (message: FromServer) => void) {
    queueMicrotask(() => {
      this.hearGreeting();
      this.connect();
    });
    setInterval(() => this.count(), 1000);
  }

  /** One more second without a word. They are counted: a page that was busy or asleep hears what waits before the next. */
  private count(): void {
    this.silence += 1;
    if (this.link.value === "live" && this.silence > LONGEST_SILENCE) this.link.set("lost");
  }

  /** What the page was sent along with itself, so that it need not wait for the socket to draw. */
  private hearGreeting(): void {
    const greeting = document.getElementById("greeting")?.textContent;
    for (const message of JSON.parse(greeting || "[]") as FromServer[]) this.hear(message);
  }

  /** Sends a message; one that cannot be sent now is dropped, for it would be stale later. */
  send(message: FromPage): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
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
      this.link.set("live");
      const message =
        typeof event.data === "string" ? (JSON.parse(event.data) as FromServer) : readFrame(event.data);
      if (message.type === "beat") this.send({ type: "heard" });
      else this.hear(message);
    });
    socket.addEventListener("close", (event) => {
      this.link.set(event.code === FULL ? "full" : "lost");
      setTimeout(() => this.connect(), this.wait);
      this.wait = nextWait(this.wait);
    });
  }
}
