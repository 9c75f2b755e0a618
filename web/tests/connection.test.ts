import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";

import { Connection, FIRST_WAIT, LARGEST, LONGEST_WAIT, nextWait } from "../src/connection";
import type { FromPage, FromServer, TopicMessage } from "../src/protocol";
import { Signal } from "../src/signal";
import { readFrame, Topics } from "../src/topics";

/** A WebSocket that the tests control. */
class FakeSocket extends EventTarget {
  static readonly OPEN = 1;
  static all: FakeSocket[] = [];
  readonly sent: string[] = [];
  readyState = FakeSocket.OPEN;

  constructor(readonly url: string) {
    super();
    FakeSocket.all.push(this);
  }

  send(text: string): void {
    this.sent.push(text);
  }

  receive(message: object): void {
    this.dispatchEvent(new MessageEvent("message", { data: JSON.stringify(message) }));
  }

  close(code: number): void {
    this.readyState = 3;
    this.dispatchEvent(Object.assign(new Event("close"), { code }));
  }
}

describe("nextWait", () => {
  it("grows by 1.6", () => {
    expect(nextWait(FIRST_WAIT)).toBe(400);
  });

  it("is at most the longest wait", () => {
    expect(nextWait(1900)).toBe(LONGEST_WAIT);
    expect(nextWait(LONGEST_WAIT)).toBe(LONGEST_WAIT);
  });
});

describe("Connection", () => {
  let received: FromServer[] = [];

  beforeEach(() => {
    vi.useFakeTimers();
    FakeSocket.all = [];
    received = [];
    vi.stubGlobal("WebSocket", FakeSocket);
    vi.stubGlobal("location", { protocol: "http:", host: "localhost:8300", search: "?token=a%20b" });
    vi.stubGlobal("document", {
      getElementById: () => ({ textContent: '[{"type": "notice", "text": "hello"}]' }),
    });
  });

  afterEach(() => {
    vi.useRealTimers();
    vi.unstubAllGlobals();
  });

  async function connected(): Promise<Connection> {
    const connection = new Connection((message) => received.push(message));
    await Promise.resolve();
    return connection;
  }

  it("reads the first messages from the page before the socket connects", async () => {
    await connected();
    expect(received).toEqual([{ type: "notice", text: "hello" }]);
  });

  it("sends the token of the URL to the server", async () => {
    await connected();
    expect(FakeSocket.all[0]!.url).toBe("ws://localhost:8300/ws?token=a%20b");
  });

  it("refuses a message that the server would not accept, in bytes of UTF-8", async () => {
    const connection = await connected();
    const send = (text: string): void => connection.send({ type: "save_source", file: "a", was: "", text });
    const room = LARGEST - JSON.stringify({ type: "save_source", file: "a", was: "", text: "" }).length;
    send("字".repeat(Math.floor(room / 3)));
    expect(FakeSocket.all[0]!.sent).toHaveLength(1);
    send("字".repeat(Math.floor(room / 3) + 1));
    expect(FakeSocket.all[0]!.sent).toHaveLength(1);
    expect(received.at(-1)).toMatchObject({ type: "refused" });
  });

  it("is live with the first message", async () => {
    const connection = await connected();
    expect(connection.link.value).toBe("connecting");
    FakeSocket.all[0]!.receive({ type: "refused", reason: "no" });
    expect(connection.link.value).toBe("live");
    expect(received.at(-1)).toEqual({ type: "refused", reason: "no" });
  });

  it("answers a beat and does not pass it on", async () => {
    await connected();
    FakeSocket.all[0]!.receive({ type: "beat" });
    expect(FakeSocket.all[0]!.sent).toEqual(['{"type":"heard"}']);
    expect(received).toHaveLength(1);
  });

  it("is lost after six seconds of silence", async () => {
    const connection = await connected();
    FakeSocket.all[0]!.receive({ type: "beat" });
    vi.advanceTimersByTime(5000);
    expect(connection.link.value).toBe("live");
    vi.advanceTimersByTime(1000);
    expect(connection.link.value).toBe("lost");
  });

  it("reconnects after growing delays", async () => {
    await connected();
    FakeSocket.all[0]!.close(1006);
    vi.advanceTimersByTime(249);
    expect(FakeSocket.all).toHaveLength(1);
    vi.advanceTimersByTime(1);
    expect(FakeSocket.all).toHaveLength(2);
    FakeSocket.all[1]!.close(1006);
    vi.advanceTimersByTime(399);
    expect(FakeSocket.all).toHaveLength(2);
    vi.advanceTimersByTime(1);
    expect(FakeSocket.all).toHaveLength(3);
  });

  it("resets the delay after a message", async () => {
    await connected();
    FakeSocket.all[0]!.close(1006);
    vi.advanceTimersByTime(250);
    FakeSocket.all[1]!.receive({ type: "beat" });
    FakeSocket.all[1]!.close(1006);
    vi.advanceTimersByTime(250);
    expect(FakeSocket.all).toHaveLength(3);
  });

  it("reports a server with too many pages", async () => {
    const connection = await connected();
    FakeSocket.all[0]!.close(1013);
    expect(connection.link.value).toBe("full");
  });

  it("drops messages while disconnected", async () => {
    const connection = await connected();
    FakeSocket.all[0]!.readyState = 0;
    connection.send({ type: "stop" });
    expect(FakeSocket.all[0]!.sent).toEqual([]);
  });
});

function message(topic: string, data: unknown): TopicMessage {
  return { type: "message", topic, kind: "std_msgs/String", time: 0, is_latched: false, message: { data } };
}

describe("Topics", () => {
  let sent: FromPage[] = [];
  let topics: Topics;
  let received: unknown[] = [];
  const subscribe = (): (() => void) =>
    topics.subscribe("/chat", (now) => received.push(now.message["data"]));

  beforeEach(() => {
    [sent, received] = [[], []];
    topics = new Topics((now) => sent.push(now));
  });

  it("subscribes once for several listeners, and unsubscribes after the last", () => {
    const [first, second] = [subscribe(), subscribe()];
    first();
    expect(sent).toEqual([{ type: "subscribe", topic: "/chat" }]);
    second();
    expect(sent.at(-1)).toEqual({ type: "unsubscribe", topic: "/chat" });
  });

  it("gives a late listener the newest message", () => {
    subscribe();
    topics.receive(message("/chat", "first"));
    topics.receive(message("/chat", "second"));
    subscribe();
    expect(received).toEqual(["first", "second", "second"]);
  });

  it("drops the latest message when it is invalidated", () => {
    subscribe();
    topics.receive(message("/chat", "old"));
    topics.forget("/chat");
    subscribe();
    expect(received).toEqual(["old"]);
  });

  it("subscribes again when the connection is back", () => {
    subscribe();
    topics.resubscribe();
    expect(sent).toEqual([
      { type: "subscribe", topic: "/chat" },
      { type: "subscribe", topic: "/chat" },
    ]);
  });

  it("does not repeat a message from before the connection was lost", () => {
    subscribe();
    topics.receive(message("/chat", "old"));
    topics.resubscribe();
    subscribe();
    expect(received).toEqual(["old"]);
  });

  it("finds the first topic of some types", () => {
    topics.setList({
      type: "topics",
      topics: ["a/A", "b/B", "b/B"].map((kind, index) => ({
        name: `/t${index}`,
        kind,
        rate: null,
        is_input: false,
        is_latched: false,
      })),
    });
    expect(topics.firstOfType(["b/B"])).toBe("/t1");
    expect(topics.firstOfType(["c/C"])).toBe("");
  });
});

describe("readFrame", () => {
  it("reads the header, and the arrays behind it", () => {
    const header = new TextEncoder().encode(
      JSON.stringify({ ...message("/scan", 1), arrays: { ranges: ["float32", 0, 2] } }).padEnd(200),
    );
    const buffer = new ArrayBuffer(4 + 200 + 8);
    new DataView(buffer).setUint32(0, 200, true);
    new Uint8Array(buffer, 4, 200).set(header);
    new Float32Array(buffer, 204, 2).set([1.5, -2]);
    const read = readFrame(buffer);
    expect(read.topic).toBe("/scan");
    expect(read.message["ranges"]).toEqual(Float32Array.from([1.5, -2]));
  });
});

describe("Signal", () => {
  it("calls a listener with the present value and with later ones", () => {
    const signal = new Signal(1);
    const seen: number[] = [];
    const stop = signal.watch((value) => seen.push(value));
    signal.set(2);
    signal.set(2);
    stop();
    signal.set(3);
    expect(seen).toEqual([1, 2]);
  });

  it("calls a leisurely listener at intervals, with the newest value", () => {
    vi.useFakeTimers();
    const signal = new Signal(0);
    const seen: number[] = [];
    signal.watchThrottled((value) => seen.push(value), 100);
    for (let value = 1; value <= 5; value += 1) signal.set(value);
    expect(seen).toEqual([0]);
    vi.advanceTimersByTime(100);
    expect(seen).toEqual([0, 5]);
    vi.useRealTimers();
  });
});
