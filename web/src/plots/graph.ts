import type uPlot from "uplot";

import type { App } from "../app";
import { h } from "../dom";
import { clock } from "../time/format";
import { paddedRange, tickLabel } from "./axis";
import type { Span } from "./span";
import type { Table } from "./table";

const COLOURS = ["--plot-1", "--plot-2", "--plot-3", "--plot-4", "--plot-5", "--plot-6"];
/** Curves that reuse a colour are dashed, as in the server's SVG. */
const DASHES = [[], [8, 4]];
/** Limit of curves: more could not be distinguished. */
export const MOST_CURVES = COLOURS.length * DASHES.length;

/** The CSS custom property with the colour of a curve, and its dashes. */
export function strokeOf(index: number): { colour: string; dash: number[] } {
  return {
    colour: COLOURS[index % COLOURS.length]!,
    dash: DASHES[Math.floor(index / COLOURS.length) % DASHES.length]!,
  };
}

/** Pixels beside the time line within which a press grabs it. */
const REACH = 7;
/** Pixels that the pointer may move during a click. */
const STILL = 4;
/** Pixels that the label of a jump takes, such as "→ 123.45 s". Without that room it has no label. */
const JUMP_LABEL_PX = 72;
/** The curves, drawn by uPlot, with the time shown as a draggable line. */
export class Graph {
  private readonly line = h("div", {
    class: "moment",
    role: "slider",
    tabindex: 0,
    "aria-label": "Time in the plot",
    "aria-valuemin": 0,
    hidden: true,
    title: "Time shown. Drag it to move through time.",
  });
  /** Marks where the simulated time was set to another value. */
  private readonly marks = h("div", {});
  private chart: uPlot | null = null;
  private builds = 0;
  /** The time shown before the first click of a double click. */
  private timeBefore: number | null = null;
  /** Where the pointer was pressed, in pixels. NaN if it grabbed the line. */
  private pressedAt = NaN;

  constructor(
    private readonly app: App,
    private readonly holder: HTMLElement,
    private readonly table: Table,
    private readonly span: Span,
    private readonly pointed: (index: number) => void,
  ) {
    this.line.addEventListener("keydown", (event) => this.press(event));
    new ResizeObserver(() => this.chart?.setSize(size(holder))).observe(holder);
  }

  /** Creates the chart again, with other curves or colours. */
  async rebuild(): Promise<void> {
    const hadFocus = document.activeElement === this.line;
    this.chart?.destroy();
    this.chart = null; // a chart cannot draw other series than those it was created for
    const build = (this.builds += 1);
    const isStale = (): boolean => build !== this.builds || !this.app.plots.value;
    if (isStale()) return;
    const { default: UPlot } = await import("./chart");
    if (isStale()) return;
    this.chart = new UPlot(this.options(), this.data(), this.holder);
    this.chart.over.append(this.marks, this.line);
    this.chart.over.addEventListener("pointerdown", (event) => this.pointerDown(event));
    this.chart.over.addEventListener("pointermove", (event) =>
      this.chart?.over.classList.toggle("at-moment", this.isAtLine(event.clientX)),
    );
    this.chart.over.addEventListener("click", (event) => this.click(event));
    this.chart.over.addEventListener("dblclick", () => this.whole());
    this.draw();
    if (hadFocus) this.line.focus();
  }

  draw(): void {
    if (this.chart === null) return;
    this.chart.setData(this.data());
    this.drawLine();
    this.drawJumps();
  }

  /** Zooms out, and returns to the time before the double click. */
  private whole(): void {
    this.span.zoom = null;
    if (this.timeBefore !== null) this.goTo(this.timeBefore);
    this.draw();
  }

  private goTo(at: number, isBack = false): void {
    const { travel } = this.app;
    if (at >= this.span.end - 0.03 && !isBack && travel.timeline.value?.played !== true) travel.goLive();
    else travel.seek(Math.max(this.span.start, at));
  }

  /** The time shown or requested. */
  private get at(): number {
    const { travel } = this.app;
    return travel.awaited ?? (travel.showsHistory ? travel.at : this.span.end);
  }

  private drawLine(): void {
    const { chart, line } = this;
    const { at } = this;
    const [low, high] = this.span.range();
    const { travel } = this.app;
    // while the plot is live the line would hide its edge, so it is visible only when focused
    line.hidden = chart === null || at < low - 1e-6 || at > high + 1e-6;
    line.classList.toggle("now", !travel.showsHistory);
    if (chart === null || line.hidden) return;
    line.style.left = `${chart.valToPos(this.toX(at), "x")}px`;
    line.setAttribute("aria-valuemin", this.span.start.toFixed(2));
    line.setAttribute("aria-valuemax", this.span.end.toFixed(2));
    line.setAttribute("aria-valuenow", at.toFixed(2));
    line.setAttribute(
      "aria-valuetext",
      travel.timeline.value?.played ? clock(at) : `${(this.app.state.value?.time ?? 0).toFixed(2)} s`,
    );
  }

  private press(event: KeyboardEvent): void {
    const [low, high] = this.span.range();
    const step = (high - low) / (event.shiftKey ? 10 : 100);
    const keys: Record<string, () => void> = {
      ArrowLeft: () => this.goTo(this.at - step, true),
      ArrowRight: () => this.goTo(this.at + step),
      PageDown: () => this.goTo(this.at - (high - low) / 10, true),
      PageUp: () => this.goTo(this.at + (high - low) / 10),
      Home: () => this.goTo(low),
      End: () => this.goTo(high),
      "+": () => this.span.zoomBy(0.5, this.at),
      "-": () => this.span.zoomBy(2, this.at),
      "0": () => (this.span.zoom = null),
    };
    const action = keys[event.key === "=" ? "+" : event.key];
    if (action === undefined || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    event.stopPropagation();
    action();
    this.draw();
  }

  private isAtLine(clientX: number): boolean {
    const { left, width } = this.line.getBoundingClientRect();
    return (
      !this.line.hidden &&
      !this.line.classList.contains("now") &&
      Math.abs(clientX - left - width / 2) <= REACH
    );
  }

  private atOf(clientX: number): number {
    const box = this.chart!.over.getBoundingClientRect();
    return this.toAt(this.chart!.posToVal(Math.min(Math.max(clientX - box.left, 0), box.width), "x"));
  }

  /** A press on the line drags it. A click elsewhere moves to that time, and a drag zooms (drawn by uPlot). */
  private pointerDown(event: PointerEvent): void {
    if (event.button !== 0) return;
    const { over } = this.chart!;
    const from = event.clientX;
    const drags = this.isAtLine(from);
    this.pressedAt = drags ? NaN : from;
    if (drags) {
      event.stopPropagation();
      over.setPointerCapture(event.pointerId);
    }
    const moved = (now: PointerEvent): void => {
      if (drags) this.goTo(this.atOf(now.clientX));
    };
    const done = (): void => {
      removeEventListener("pointermove", moved);
      removeEventListener("pointerup", done);
      removeEventListener("pointercancel", done);
      this.line.focus({ preventScroll: true });
    };
    addEventListener("pointermove", moved);
    addEventListener("pointerup", done);
    addEventListener("pointercancel", done);
  }

  /** Moves to a time on a click, but not on the second click of a double click or after a drag. */
  private click(event: MouseEvent): void {
    if (event.detail > 1 || !(Math.abs(event.clientX - this.pressedAt) <= STILL)) return;
    const { travel } = this.app;
    this.timeBefore = travel.showsHistory || travel.awaited !== null ? this.at : Infinity; // live
    this.goTo(this.atOf(event.clientX));
  }

  /** Seconds from timeline time to simulated time at the end of the range. */
  private get offset(): number {
    if (this.app.travel.timeline.value?.played) return 0;
    const index = this.table.indexAt(this.span.range()[1]);
    return index < 0 ? 0 : Math.round((this.table.time[index]! - this.table.at[index]!) * 100) / 100;
  }

  private toX(at: number): number {
    return at + this.offset;
  }

  private toAt(x: number): number {
    return x - this.offset;
  }

  private data(): uPlot.AlignedData {
    const [low, high] = this.span.range();
    const { offset, table } = this;
    const first = Math.max(0, table.indexAt(low));
    const last = table.indexAt(high) + 2;
    const at = table.at.slice(first, last).map((moment) => moment + offset);
    const columns = table.columns.map((column) => column.slice(first, last));
    for (const index of this.jumps().reverse()) {
      // a gap, so that no curve joins the values before and after the jump
      at.splice(index - first, 0, (table.at[index - 1]! + table.at[index]!) / 2 + offset);
      for (const column of columns) column.splice(index - first, 0, null);
    }
    return [at, ...columns];
  }

  /** The visible rows that are the first after a jump of the simulated time. */
  private jumps(): number[] {
    const [low, high] = this.span.range();
    return this.app.travel.timeline.value?.played
      ? []
      : this.table.jumps(this.table.indexAt(low) + 1, this.table.indexAt(high) + 1);
  }

  private drawJumps(): void {
    const { chart, table } = this;
    let right = Number.POSITIVE_INFINITY;
    const marks = this.jumps()
      .toReversed()
      .map((index) => {
        const left = chart!.valToPos(this.toX((table.at[index - 1]! + table.at[index]!) / 2), "x");
        const hasRoom = right - left >= JUMP_LABEL_PX;
        if (hasRoom) right = left;
        const mark = h("div", { class: "jump" }, hasRoom ? `\u2192 ${table.time[index]!.toFixed(2)} s` : "");
        mark.style.left = `${left}px`;
        return mark;
      });
    this.marks.replaceChildren(...marks);
  }

  /** The simulated time at a tick. After a jump it differs from the tick's value and is not a round number. */
  private timeAt(x: number, apart: number): string {
    const index = this.table.indexAt(this.toAt(x));
    const time = this.table.time[index];
    const isOther = !this.app.travel.timeline.value?.played && time !== undefined && Math.abs(time - x) > 0.1;
    return `${Number(isOther ? time.toFixed(apart < 1 ? 2 : 1) : x.toFixed(2))} s`;
  }

  private options(): uPlot.Options {
    const colour = (name: string): string =>
      getComputedStyle(document.documentElement).getPropertyValue(name).trim();
    const font = `11px ${colour("--mono")}`;
    const axis = {
      stroke: colour("--quiet"),
      font,
      grid: { stroke: colour("--line"), width: 1 },
      ticks: { show: false },
    };
    return {
      ...size(this.holder),
      legend: { show: false },
      cursor: {
        y: false,
        drag: { x: true, y: false, setScale: false, dist: STILL },
        bind: {
          dblclick: () => () => null,
          mousedown: (_, __, handler) => (event) => (this.isAtLine(event.clientX) ? null : handler(event)),
        },
      },
      scales: {
        x: { time: false, range: () => this.span.range().map((at) => this.toX(at)) as [number, number] },
        y: { range: (_, low, high) => paddedRange(low, high) },
      },
      axes: [
        {
          ...axis,
          size: 28,
          values: (_, ticks) => ticks.map((tick) => this.timeAt(tick, (ticks[1] ?? tick + 1) - ticks[0]!)),
        },
        { ...axis, size: 54, values: (_, ticks) => ticks.map(tickLabel) },
      ],
      series: [
        {},
        ...this.table.fields.map((field, index) => ({
          label: field.name,
          stroke: colour(strokeOf(index).colour),
          dash: strokeOf(index).dash,
          width: 1.5,
          points: { show: false },
        })),
      ],
      hooks: {
        setSelect: [(chart) => this.select(chart)],
        setCursor: [
          (chart) =>
            this.pointed(
              chart.cursor.left === undefined || chart.cursor.left < 0
                ? -1
                : this.table.indexAt(this.toAt(chart.posToVal(chart.cursor.left, "x"))),
            ),
        ],
      },
    };
  }

  private select(chart: uPlot): void {
    const { left, width } = chart.select;
    if (width <= STILL) return;
    this.span.zoom = [this.toAt(chart.posToVal(left, "x")), this.toAt(chart.posToVal(left + width, "x"))];
    chart.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    this.draw();
  }
}

function size(holder: HTMLElement): { width: number; height: number } {
  return { width: Math.max(120, holder.clientWidth), height: Math.max(60, holder.clientHeight) };
}
