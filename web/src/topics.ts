import type { FromPage, TopicMessage, Topics as TopicList, TopicView } from "./protocol";
import { Signal } from "./signal";

type Listener = (message: TopicMessage) => void;

/** The topics of the server. A topic is subscribed while the page has listeners for it. */
export class Topics {
  /** All topics, as last sent by the server. */
  readonly list = new Signal<readonly TopicView[]>([]);
  /** The topic whose messages became invalid last; without a name, all topics. */
  readonly forgotten = new Signal<{ topic: string | undefined } | null>(null);
  private readonly listeners = new Map<string, Set<Listener>>();
  private readonly latestByTopic = new Map<string, TopicMessage>();

  constructor(private readonly send: (message: FromPage) => void) {}

  /** Subscribes to a topic. A known message is delivered at once. Returns a function that unsubscribes. */
  subscribe(topic: string, listener: Listener): () => void {
    let all = this.listeners.get(topic);
    if (all === undefined) {
      all = new Set();
      this.listeners.set(topic, all);
      this.send({ type: "subscribe", topic });
    }
    all.add(listener);
    const latest = this.latestByTopic.get(topic);
    if (latest !== undefined) listener(latest);
    return () => {
      all.delete(listener);
      if (all.size > 0 || this.listeners.get(topic) !== all) return;
      this.listeners.delete(topic);
      this.latestByTopic.delete(topic);
      this.send({ type: "unsubscribe", topic });
    };
  }

  /** The first topic with one of some types, empty if there is none. */
  firstOfType(kinds: readonly string[]): string {
    return this.list.value.find((topic) => kinds.includes(topic.kind))?.name ?? "";
  }

  /** Subscribes to all topics again after a reconnect. */
  resubscribe(): void {
    this.latestByTopic.clear();
    for (const topic of this.listeners.keys()) this.send({ type: "subscribe", topic });
  }

  /** Drops the messages of one topic, or of all, because they do not belong to the time shown. */
  forget(topic?: string): void {
    if (topic === undefined) this.latestByTopic.clear();
    else this.latestByTopic.delete(topic);
    this.forgotten.set({ topic });
  }

  receive(message: TopicMessage): void {
    const all = this.listeners.get(message.topic);
    if (all === undefined) return;
    this.latestByTopic.set(message.topic, message);
    for (const listener of all) listener(message);
  }

  setList(message: TopicList): void {
    for (const topic of this.latestByTopic.keys())
      if (!message.topics.some(({ name }) => name === topic)) this.latestByTopic.delete(topic);
    this.list.set(message.topics);
  }
}

const KINDS = { int8: Int8Array, uint8: Uint8Array, float32: Float32Array, float64: Float64Array };

/** Reads a message from a binary frame. `src/kbot/workbench/topics/payload.py` documents its layout. */
export function readFrame(buffer: ArrayBuffer): TopicMessage {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length))) as TopicMessage & {
    arrays: Record<string, [keyof typeof KINDS, number, number]>;
  };
  for (const [field, [kind, at, count]] of Object.entries(header.arrays)) {
    header.message[field] = new KINDS[kind](buffer, 4 + length + at, count);
  }
  return header;
}
