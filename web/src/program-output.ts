import type { App } from "./app";
import type { TopicView } from "./protocol";
import { DRAWN, PLOTTED } from "./program-topics";

/** Shows what the user's program plots and draws, when it first does. What the user hides then stays hidden. */
export function showProgramOutput(app: App): void {
  const seen = new Set<string>();
  app.topics.list.watch((topics) => {
    for (const { name, kind } of topics.filter((topic) => isOutput(topic) && !seen.has(topic.name))) {
      seen.add(name);
      if (name === DRAWN) showDrawings(app, kind.split("/").pop()!);
      else app.plotTopic(name, ["data"]);
    }
  });
}

function isOutput({ name }: TopicView): boolean {
  return name === DRAWN || name.startsWith(PLOTTED);
}

function showDrawings(app: App, kind: string): void {
  const { displays } = app;
  if (displays.all.value.some(({ properties }) => properties["topic"] === DRAWN)) return;
  const added = displays.add(kind);
  if (added === null) return;
  displays.rename(added.id, "Drawings");
  displays.set(added.id, "topic", DRAWN);
}
