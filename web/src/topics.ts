import type { FromPage, TopicMessage, Topics as TopicList, TopicView } from "./protocol";
import { Signal } from "./signal";

type Listener = (message: TopicMessage) => void;

/** The topics of the server's bus: asked for while somebody here listens. */
export class Topics {
  /** Every topic there is, as the server said last. */
  readonly list = new Signal<readonly TopicView[]>([]);
  readonly forgotten = new Signal<{ topic: string | undefined } | null>(null);
  private readonly listeners = new Map<string, Set<Listener>>();
  private readonly newest = new Map<string, TopicMessage>();

  constructor(private readonly send: (message: FromPage) => void) {}

  /** Hears a topic until the function that is returned is called; what is known of it comes at once. */
  listen(topic: string, listener: Listener): () => void {
    let all = this.listeners.get(topic);
    if (all === undefined) {
      all = new Set();
      this.listeners.set(topic, all);
      this.send({ type: "subscribe", topic });
    }
    all.add(listener);
    const known = this.newest.get(topic);
    if (known !== undefined) listener(known);
    return () => {
      all.delete(listener);
      if (all.size > 0 || this.listeners.get(topic) !== all) return;
      this.listeners.delete(topic);
      this.newest.delete(topic);
      this.send({ type: "unsubscribe", topic });
    };
  }

  /** The first topic that carries one of some types, empty where none does. */
  first(kinds: readonly string[]): string {
    return this.list.value.find((topic) => kinds.includes(topic.kind))?.name ?? "";
  }

  /** Asks anew for all: the server that is connected now knows nothing of it. */
  connected(): void {
    this.newest.clear();
    for (const topic of this.listeners.keys()) this.send({ type: "subscribe", topic });
  }

  /** What was said does not hold at the moment on show: of one topic, or of all. */
  forget(topic?: string): void {
    if (topic === undefined) this.newest.clear();
    else this.newest.delete(topic);
    this.forgotten.set({ topic });
  }

  heard(message: TopicMessage): void {
    const all = this.listeners.get(message.topic);
    if (all === undefined) return;
    this.newest.set(message.topic, message);
    for (const listener of all) listener(message);
  }

  listed(message: TopicList): void {
    for (const topic of this.newest.keys())
      if (!message.topics.some(({ name }) => name === topic)) this.newest.delete(topic);
    this.list.set(message.topics);
  }
}

const KINDS = { int8: Int8Array, uint8: Uint8Array, float32: Float32Array, float64: Float64Array };

/** A topic's message out of a binary frame; `src/kbot/workbench/topics/payload.py` says how it is laid out. */
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
